"""The command that drives every method to where it fails, on the shipped junction with little of everything."""

from pathlib import Path
from unittest.mock import patch

from headless.studies.stability import command as stability

from seip_addon.core.choosing.placement.scenarios import Scenarios

SCENE = Path(__file__).resolve().parents[3] / "scenes" / "junction.blend"
COARSE = ["--sensor", "type1", "--heights", "5.4", "--grid", "8", "--spacing", "25", "--effort", "2"]
LITTLE = stability.StabilityScope(
    grids=8,
    draws=(20, 5),
    robust=Scenarios("pose-errors", count=3, held_out=20),
    traffic=Scenarios("traffic", count=2, held_out=12),
)


def test_the_page_has_all_chapters_and_charts(tmp_path):
    with patch.multiple(
        "headless.studies.stability.criterion",
        DELTAS=(4.0, 6.0),
        GRID_SPACINGS=(8.0, 6.0),
        CANDIDATE_SPACINGS=(30.0, 25.0),
        EVALUATION_SPACING=4.0,
    ):
        stability.main([str(SCENE), "-o", str(tmp_path), "--work", str(tmp_path / "work"), *COARSE], LITTLE)
    page = (tmp_path / "stability.md").read_text(encoding="utf-8")
    titles = [line[3:].partition(":")[0] for line in page.splitlines() if line.startswith("## ")]
    assert titles == ["The criterion of visibility", "Pose errors", "Failures", "Occlusion by traffic"]
    named = {part.split(")")[0] for part in page.split("](stability/")[1:]}
    assert named == {path.name for path in (tmp_path / "stability").iterdir()}
    rows = [line for line in page.splitlines() if line.startswith("| ") and "---" not in line]
    assert len(rows) == 4 + 5 + 6 + 2 + 2
    assert all(line.count(" | ") == 4 for line in rows)
