"""Coverage in rain and fog: the study and its rows."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch

from headless.studies.stability import weather as weather_limits
from headless.studies.stability.weather import WeatherAnswer, weather_rows, weather_study

import bpy
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.weather import weather_of
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.workflows.survey import lay_out
from seip_addon.core.workflows.survey_settings import SurveySettings
from tests.builders.small_junction import make_geometry

assert bpy.app.version  # the engine bvh needs Blender's module, which is there from here on

COARSE = SurveySettings(CandidateSettings(sensors=("type1",), heights=(5.4,), spacing=12.0), grid_spacing=4.0)


@pytest.fixture(scope="module")
def answers():
    with patch.object(weather_limits, "WEATHERS", ("visibility=200", "visibility=50", "rain=50")):
        return finish(weather_study(make_geometry(36.0), COARSE, count=2))


def test_a_placement_for_the_weather_is_no_worse_in_it(answers):
    assert [one.weather for one in answers] == ["", "visibility=200", "visibility=50", "rain=50"]
    clear, thin, thick, rain = answers
    assert clear.kept == clear.placed <= clear.longer
    for one in (thin, thick, rain):
        assert one.gap == pytest.approx(0.0)  # else the next line need not hold
        assert one.kept <= one.placed <= one.longer
        assert one.placed < clear.placed
    assert thick.placed < thin.placed


def test_weather_is_what_a_survey_in_it_sees(answers):
    own = replace(COARSE.candidates, sensors=(weather_limits.SENSOR,))
    layout = lay_out(make_geometry(36.0), replace(COARSE, candidates=own, weather=weather_of(["visibility=50"])))
    visible = finish(compute_visibility(layout.site, layout.models, layout.settings.visibility)).visible
    position = layout.site.candidates.position_of
    pairs = [(a, b) for a in range(len(visible)) for b in range(a) if position[a] != position[b]]
    best = max((visible[a] | visible[b]).mean() for a, b in pairs)
    assert answers[2].placed == pytest.approx(best)


def test_rows_say_where_it_fails_and_what_helps():
    clear = WeatherAnswer("", 0.8, 0.8, 1.0, 0.0)
    rain, fog = (
        WeatherAnswer("rain=20", 0.57, 0.64, 0.99, 0.031),
        WeatherAnswer("visibility=100", 0.46, 0.53, 0.95, 0.0),
    )
    holds, fails = weather_rows([clear, rain, fog])
    assert holds.regime == "rain of 20 mm/h"
    assert holds.begins == "holds: 57.0%, 23.0 points less than in clear air"
    assert "3.1%" in holds.how
    assert fails.begins.startswith("fails, below 50%: 46.0%")
    assert fails.answer == (
        "`--weather visibility=100` places for it: 53.0%; 8 × os1_128_rev7 placed for it cover 95.0%"
    )
