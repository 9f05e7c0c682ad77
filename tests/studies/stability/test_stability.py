"""The command that drives every method to where it fails, on the shipped junction with little of everything."""

import json
from pathlib import Path
from unittest.mock import patch

from headless.studies.stability import chapters as stability_chapters
from headless.studies.stability import command as stability

import pytest

from seip_addon.core.choosing.placement.scenarios import Scenarios

SCENE = Path(__file__).resolve().parents[3] / "scenes" / "junction.blend"
COARSE = [
    "--sensor",
    "type1",
    "--heights",
    "5.4",
    "--grid",
    "8",
    "--spacing",
    "25",
    "--effort",
    "2",
]
LITTLE = stability_chapters.StabilityScope(
    grids=8,
    rays=200,
    draws=(20, 5),
    robust=Scenarios("pose-errors", count=3, held_out=20),
    traffic=Scenarios("traffic", count=2, held_out=12),
)


def run(folder, *options):
    criterion = "headless.studies.stability.criterion"
    spacings = {"GRID_SPACINGS": (8.0, 6.0), "CANDIDATE_SPACINGS": (30.0, 25.0)}
    with (
        patch.multiple(criterion, DELTAS=(4.0, 6.0), **spacings),
        patch("headless.studies.stability.spacings.EVALUATION_SPACING", 4.0),
    ):
        stability.main(
            [str(SCENE), "-o", str(folder / "docs"), "--work", str(folder / "work"), *COARSE, *options], LITTLE
        )
    return (folder / "docs" / "stability.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_page_has_all_chapters_and_a_rerun_goes_on(tmp_path, capsys):
    page = run(tmp_path)
    charts = tmp_path / "docs" / "stability"
    named = {part.split(")")[0] for part in page.split("](stability/")[1:]}
    assert named == {path.name for path in charts.iterdir()}
    chapters = sorted(path.stem for path in (tmp_path / "work").glob("*.json"))
    assert page.count("\n## ") == len(chapters)
    for name in chapters:
        kept = json.loads((tmp_path / "work" / f"{name}.json").read_text(encoding="utf-8"))
        assert kept["rows"]
        assert all(row["begins"] in page for row in kept["rows"])

    (charts / "failures.png").unlink()
    (tmp_path / "work" / "arithmetic.json").write_text("{", encoding="utf-8")
    capsys.readouterr()
    assert run(tmp_path).count("\n## ") == len(chapters)
    said = capsys.readouterr().out
    assert "Failures" in said
    assert "Arithmetic:" in said
    assert "Pose errors" not in said
