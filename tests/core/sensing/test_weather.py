"""Weather: what it takes from light and roads, and words that mean none."""

import math

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.weather import WET_FACTOR, Weather, weather_of
from seip_addon.core.site.scene_geometry import DEFAULT_REFLECTIVITY
from tests.builders.plain_street import street


def test_words_are_weather():
    assert weather_of([]) == Weather()
    assert weather_of(["rain=10", "visibility=150"]) == Weather(rain=10.0, visibility=150.0)
    assert weather_of(["wet"]) == Weather(wet_road=True)


@pytest.mark.parametrize(
    "weather", [Weather(), Weather(rain=0.1), Weather(visibility=150.5), Weather(7.0, 80.0, wet_road=True)]
)
def test_weather_in_words_is_the_same_weather(weather):
    assert weather_of(weather.words()) == weather


@pytest.mark.parametrize(
    "words", [["sun"], ["rain"], ["rain=hard"], ["rain=nan"], ["visibility=inf"], ["wet=1"], ["fog=3"]]
)
def test_other_words_are_refused(words):
    with pytest.raises(SeipError, match="is not understood: give rain=MM/H"):
        weather_of(words)


@pytest.mark.parametrize(("words", "message"), [(["rain=-1"], "rain must lie"), (["visibility=0.5"], "1 m or more")])
def test_impossible_weather_is_refused(words, message):
    with pytest.raises(SeipError, match=message):
        weather_of(words)


def test_extinction_is_that_of_rain_and_of_fog():
    assert Weather().extinction == 0.0
    assert Weather(visibility=100.0).extinction == pytest.approx(0.03)
    drops = math.pi * 8000e-3 / (4.1 * 10.0**-0.21) ** 3 / 1000  # Marshall and Palmer's, each counted twice: 1/m
    assert Weather(rain=10.0).extinction == pytest.approx(drops, rel=0.01)


def test_fair_weather_changes_nothing_and_rain_makes_roads_darker():
    geometry, model = street(), load_catalogue()["vlp16"]
    assert Weather().over(geometry) is geometry
    assert Weather().through(model) is model
    wet = Weather(rain=5.0)
    (road,) = wet.over(geometry).roads
    assert np.allclose(road.reflectivity, WET_FACTOR * DEFAULT_REFLECTIVITY)
    assert wet.over(geometry).occluders is geometry.occluders
    assert wet.through(model).law.reach(0.8, 0.9) < model.law.reach(0.8, 0.9)
