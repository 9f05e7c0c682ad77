"""Float32: both ray casters against float64 on hard scenes, and the warnings where it is too coarse."""

from __future__ import annotations

from headless.studies.stability.arithmetic import check_grid, check_hits, tolerance_of
from headless.studies.stability.float64_rays import first_hits
from headless.studies.stability.hard_scenes import hard_scenes, ordinary_scene, stored_far_away, with_stray

import numpy as np
import pytest
import shapely

from seip_addon.core.sensing.visibility.float32_precision import rounding_warnings
from seip_addon.core.sensing.visibility.settings import Engine
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.scene_geometry import Mesh, Pole, SceneGeometry
from seip_addon.core.workflows.survey import grid_key, lay_out
from seip_addon.core.workflows.survey_settings import SurveySettings
from tests.engines import each_engine
from tests.oracles.float64_rays import first_hits as plain_first_hits

SCENES = {scene.name: scene for scene in hard_scenes(1500, np.random.default_rng(1))}
STREET = ordinary_scene(1500, np.random.default_rng(2))


def truth(scene):
    return first_hits(scene.origin, scene.directions, scene.triangles, tolerance_of(scene))


@pytest.mark.parametrize("name", SCENES)
def test_the_reference_is_plain_arithmetic(name: str) -> None:
    scene = SCENES[name]
    few = scene.directions[:200]
    found = first_hits(scene.origin, few, scene.triangles, tolerance_of(scene))
    plain = plain_first_hits(scene.origin, few, scene.triangles)
    same = np.isclose(found.distance, plain, rtol=1e-7, atol=0) | (found.distance == plain)
    on_an_edge = ~np.isfinite(plain)  # plain arithmetic may let a ray slip through an edge
    assert (same | on_an_edge).all()
    assert found.allow(found.distance).all()


@each_engine
@pytest.mark.parametrize("name", SCENES)
def test_hard_scenes_flip_no_hit_and_no_target(engine: Engine, name: str) -> None:
    check = check_hits(SCENES[name], engine, truth(SCENES[name]))
    assert check.flipped.count == 0
    assert check.unexplained.count == 0
    assert check_grid(SCENES[name], engine).outside.count == 0


@each_engine
def test_where_the_tool_warns_float32_moves_hits(engine: Engine) -> None:
    here = truth(STREET)
    near, far = 3e3, 3e5
    assert check_hits(stored_far_away(STREET, near), engine, here, kept_at=near).off < 1e-3
    assert check_hits(stored_far_away(STREET, far), engine, here, kept_at=far).off > 1e-2
    for distance, off in ((near, False), (far, True)):
        scene = with_stray(STREET, distance)
        assert (check_hits(scene, engine, truth(scene)).off > 1e-3) == off


def geometry(triangles: np.ndarray, *strays: Mesh) -> SceneGeometry:
    road = Mesh("carriageway", triangles)
    region = shapely.box(*triangles.min(axis=(0, 1))[:2], *triangles.max(axis=(0, 1))[:2])
    pole = Pole("pole", np.array([0.0, 6.0, 0.0]))
    return SceneGeometry("street", np.zeros(3), (road,), (), strays, region, poles=(pole,))


GROUND = np.array([[[-20.0, -4, 0], [20, -4, 0], [20, 4, 0]], [[-20, -4, 0], [20, 4, 0], [-20, 4, 0]]])


def moved(x: float, y: float) -> np.ndarray:
    return GROUND + np.array([x, y, 0.0])


def test_a_scene_at_map_coordinates_is_warned_of() -> None:
    (warning,) = rounding_warnings(geometry(moved(5e5, 5.3e6)))
    assert "5,300,0" in warning
    assert "move it to the origin" in warning


def test_a_stray_mesh_is_warned_of_by_name() -> None:
    stray = Mesh("left behind", moved(3e4, 0))
    (warning,) = rounding_warnings(geometry(GROUND, stray))
    assert "'left behind'" in warning
    assert "30,0" in warning


SHORT = SurveySettings(candidates=CandidateSettings(sensors=("type3",), heights=(5.4,), setback=0.5))


def test_what_was_forgotten_far_away_changes_nothing_and_is_named() -> None:
    plain = lay_out(geometry(GROUND), SHORT)
    stray = lay_out(geometry(GROUND, Mesh("left behind", moved(5e5, 0)), Mesh("another", moved(0, 400))), SHORT)
    np.testing.assert_array_equal(stray.site.triangles, plain.site.triangles)
    assert grid_key(stray) == grid_key(plain)
    (warning,) = set(stray.warnings) - set(plain.warnings)
    assert "4 triangles of 2 objects lie beyond every sensor's range of 301 m" in warning
    assert "'left behind'" in warning
    assert "499,9" in warning
    assert "wide" not in warning
