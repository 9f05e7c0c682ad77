"""The chapter of the detector, from a scene and its traffic to rows and charts, with little of everything."""

from unittest.mock import patch

import pytest

from tests.builders.small_scene import save_small_scene

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.studies.detector_limits import chapter as detector_limits
from headless.studies.detector_limits import study as limits_study
from headless.studies.stability import chapters
from headless.studies.stability import command as stability

COARSE = ["--sensor", "type1", "--heights", "5.4", "--grid", "8", "--spacing", "20"]
TRIED = (limits_study.DropOff(0.5),), (limits_study.YawError(1.0, 0),)


def test_the_chapter_holds_rows_and_charts_of_home_and_away(tmp_path):
    for name in ("work", "home", "away"):
        (tmp_path / name).mkdir()
    home = save_small_scene(tmp_path / "home", kinds=("", "_dense"))
    away = save_small_scene(tmp_path / "away", title="Another junction")
    little = chapters.StabilityScope(detector={"seeds": 2, "steps": 2})
    argv = [str(home), "-o", str(tmp_path), "--work", str(tmp_path / "work"), *COARSE]
    only = patch.object(stability, "chapters", lambda _stage: [("detector", chapters.detector)])
    few = patch.multiple(detector_limits, TRAINING_INTERVAL=29.0, TEST_INTERVAL=29.0)
    with only, few, patch.object(limits_study, "full_series", lambda _sensor: TRIED):
        stability.main([*argv, "--other", str(away)], little)
    page = (tmp_path / "stability.md").read_text(encoding="utf-8")
    assert "## The detector" in page
    for told in ("returns lost", "Another junction", "denser traffic", "padded with zeros", "over-full"):
        assert told in page
    assert {path.name for path in (tmp_path / "stability").iterdir()} == {"detector.png", "detector_away.png"}
