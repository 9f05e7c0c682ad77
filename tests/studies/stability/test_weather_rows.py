"""Coverage in rain and fog: the study, its rows, and the chapter in a page that is there."""

from __future__ import annotations

import shutil
from dataclasses import replace
from unittest.mock import patch

from headless.studies.stability import command as stability
from headless.studies.stability import weather as weather_limits
from headless.studies.stability.page import Chapter, Chart, save_page
from headless.studies.stability.rows import Row
from headless.studies.stability.weather import (
    UntouchedTypes,
    WeatherAnswer,
    WeatherStudy,
    weather_rows,
    weather_study,
)

import bpy
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.workflows.survey import lay_out, with_grid
from seip_addon.core.workflows.survey_settings import SurveySettings
from tests.builders.small_junction import make_geometry

assert bpy.app.version  # the engine bvh needs Blender's module, which is there from here on

COARSE = SurveySettings(CandidateSettings(sensors=("type1",), heights=(5.4,), spacing=12.0), grid_spacing=4.0)
STUDY = WeatherStudy(
    "near",
    "far",
    8,
    0.8,
    1.0,
    (WeatherAnswer("rain=20", 0.57, 0.64, 0.99, 0.031), WeatherAnswer("visibility=100", 0.46, 0.53, 0.95, 0.0)),
)
UNTOUCHED = UntouchedTypes(("type1", "type2"), "4 × type2", {"clear": 0.9, "rain=20": 0.85, "visibility=100": 0.7})
CHAPTER = Chapter(
    "Weather", (Row("coverage", "fog", "fails", "counted", "places for it"),), (Chart("w.png", "By fog"),)
)


def surveyed(words=COARSE):
    layout = lay_out(make_geometry(36.0), words)
    return with_grid(layout, finish(compute_visibility(layout.site, layout.models, words.visibility)))


@pytest.fixture(scope="module")
def study():
    geometry = make_geometry(36.0)
    with patch.object(weather_limits, "WEATHERS", ("visibility=200", "visibility=50", "rain=50")):
        return finish(weather_study(geometry, COARSE, count=2))


def test_a_placement_for_the_weather_is_no_worse_in_it(study):
    assert [one.words for one in study.answers] == ["visibility=200", "visibility=50", "rain=50"]
    thin, thick, rain = study.answers
    for one in (thin, thick, rain):
        assert one.gap == pytest.approx(0.0)  # else the next line need not hold
        assert one.kept <= one.placed <= one.longer
        assert one.placed < study.clear
    assert thick.placed < thin.placed
    assert study.longer_clear >= study.clear


def test_weather_is_what_a_survey_in_it_sees(study):
    one = replace(COARSE.candidates, sensors=(study.sensor,))
    settings = replace(COARSE, candidates=one, weather=weather_limits.weather_of(["visibility=50"]))
    visible = surveyed(settings).grid.visible
    position = surveyed(settings).site.candidates.position_of
    pairs = [(a, b) for a in range(len(visible)) for b in range(a) if position[a] != position[b]]
    best = max((visible[a] | visible[b]).mean() for a, b in pairs)
    assert study.answers[1].placed == pytest.approx(best)


def test_rows_say_where_it_fails_and_what_helps():
    holds, fails, untouched = weather_rows(STUDY, UNTOUCHED)
    assert holds.regime == "rain of 20 mm/h"
    assert holds.begins == "holds: 57.0%, 23.0 points less than in clear air"
    assert "3.1%" in holds.how
    assert fails.begins.startswith("fails, below 50%: 46.0%")
    assert fails.answer == "`--weather visibility=100` places for it: 53.0%; 8 × far placed for it cover 95.0%"
    assert "90.0% of the hits" in untouched.begins
    assert "70.0% in the worst" in untouched.begins
    assert len(weather_rows(STUDY, replace(UNTOUCHED, sensors=()))) == 2


def test_one_chapter_is_studied_and_put_into_the_page(small_scene, tmp_path):
    argv = [str(small_scene), "-o", str(tmp_path), "--work", str(tmp_path / "work"), "--only", "weather"]
    argv += ["--sensor", "type1", "--heights", "5.4", "--grid", "8", "--spacing", "12", "--effort", "2"]
    with pytest.raises(SeipError, match="leave out --only"):
        stability.main(argv)
    save_page(tmp_path / "stability.md", "The lead.", [replace(CHAPTER, title="First", charts=())], "stability")
    with patch.object(weather_limits, "WEATHERS", ("visibility=50",)):
        stability.main(argv)
    page = (tmp_path / "stability.md").read_text(encoding="utf-8")
    assert page.startswith("# Stability\n\nThe lead.\n\n## First")
    assert "## Weather: 8 × os1_128" in page
    assert "fog, visibility 50 m" in page
    assert "coverage, type1" in page
    assert {path.name for path in (tmp_path / "stability").iterdir()} == {"weather.png"}
    shutil.rmtree(tmp_path / "work")
