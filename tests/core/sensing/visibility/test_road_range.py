"""Ranges on the road: the law on a level road, and the share of a region that lies beyond."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.range_equation import RangeEquation
from seip_addon.core.sensing.visibility.road_range import (
    range_warnings,
    road_range,
    upright_range,
)
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.weather import Weather
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.scene_geometry import Mesh, Pole, SceneGeometry
from seip_addon.core.workflows.survey import carla_warnings, grid_key, lay_out
from seip_addon.core.workflows.survey_settings import SurveySettings
from tests.builders.synthetic_junction import junction_site

CATALOGUE = load_catalogue()
SIGHT = VisibilitySettings()


def short_sighted(at_10):
    law = RangeEquation.of_ranges(at_10, 2.5 * at_10)
    return {"type1": replace(CATALOGUE["type1"], law=law)}


@pytest.mark.parametrize(
    ("reach", "reflected"),
    [
        (lambda model: road_range(model, 0.17, 5.4, SIGHT), lambda far: 0.17 * 5.4 / far),
        (lambda model: upright_range(model, 0.283, SIGHT), lambda _: 0.283),
    ],
    ids=["road", "upright body"],
)
def test_range_is_that_of_the_law_within_the_longest_range(reach, reflected):
    model = short_sighted(40.0)["type1"]
    far = reach(model)
    assert model.law.chance(np.array([far]), np.array([reflected(far)]))[0] == pytest.approx(0.9, abs=1e-6)
    assert reach(replace(model, max_range=12.0)) == 12.0
    assert reach(CATALOGUE["type1"]) == CATALOGUE["type1"].max_range


def test_warnings_say_which_share_lies_beyond_every_candidate():
    site = junction_site(positions=1, sensors=["type1"], heights=[8.0])
    (warning,) = range_warnings(site, short_sighted(30.0), 0.17, SIGHT)
    reach = road_range(short_sighted(30.0)["type1"], 0.17, 8.0, SIGHT)
    away = np.linalg.norm(site.targets.xyz[None] - site.candidates.xyz[:, None], axis=2).min(axis=0)
    share = np.count_nonzero(away > reach) / len(away)
    assert 0.1 < share < 1.0
    assert f"up to {reach:.0f} m from 8 m height: {share:.0%} of the region lies beyond" in warning


def test_sensors_that_see_through_any_weather_are_named():
    alike = SurveySettings(CandidateSettings(sensors=("type1", "type2")))
    models = {key: CATALOGUE[key] for key in ("type1", "type2", "os1_128")}
    carla = {key: models[key] for key in ("type1", "type2")}
    assert carla_warnings(carla, alike) == ()
    assert carla_warnings({"os1_128": models["os1_128"]}, replace(alike, weather=Weather(rain=5.0))) == ()
    (warning,) = carla_warnings(carla, replace(alike, weather=Weather(rain=5.0)))
    assert warning.startswith("type1, type2: every return in range counts")
    (warning,) = carla_warnings(carla, replace(alike, visibility=VisibilitySettings(detection=0.5)))
    assert "do not compare the two" not in warning
    (warning,) = carla_warnings(models, alike)
    assert warning.endswith("os1_128 must detect it: do not compare the two")


def geometry(triangles, *strays):
    road = Mesh("carriageway", triangles)
    region = shapely.box(*triangles.min(axis=(0, 1))[:2], *triangles.max(axis=(0, 1))[:2])
    pole = Pole("pole", np.array([0.0, 6.0, 0.0]))
    return SceneGeometry("street", np.zeros(3), (road,), (), strays, region, poles=(pole,))


GROUND = np.array([[[-20.0, -4, 0], [20, -4, 0], [20, 4, 0]], [[-20, -4, 0], [20, 4, 0], [-20, 4, 0]]])


def moved(x, y):
    return GROUND + np.array([x, y, 0.0])


SHORT = SurveySettings(candidates=CandidateSettings(sensors=("type3",), heights=(5.4,), setback=0.5))


def test_what_was_forgotten_far_away_changes_nothing_and_is_named():
    plain = lay_out(geometry(GROUND), SHORT)
    stray = lay_out(geometry(GROUND, Mesh("left behind", moved(5e5, 0)), Mesh("another", moved(0, 400))), SHORT)
    np.testing.assert_array_equal(stray.site.triangles, plain.site.triangles)
    assert grid_key(stray) == grid_key(plain)
    (warning,) = set(stray.warnings) - set(plain.warnings)
    assert "4 triangles of 2 objects lie beyond every sensor's range of 301 m" in warning
    assert "'left behind'" in warning
    assert "499,9" in warning
    assert "wide" not in warning
