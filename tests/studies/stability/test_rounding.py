"""Float32: both ray casters against float64 on hard scenes, and the warnings where it is too coarse."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

from headless.studies.stability.arithmetic import ArithmeticStudy, arithmetic_rows, check_grid, check_hits, tolerance_of
from headless.studies.stability.charts import save_rounding_chart
from headless.studies.stability.float64_rays import first_hits
from headless.studies.stability.hard_scenes import far_away, hard_scenes, ordinary_scene, stored_far_away, with_stray
from headless.studies.stability.shares import Share

import numpy as np
import pytest
import shapely

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.visibility import ray_casting
from seip_addon.core.sensing.visibility.float32_precision import rounding_warnings
from seip_addon.core.sensing.visibility.settings import Engine
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.scene_geometry import Mesh, Pole, SceneGeometry
from seip_addon.core.workflows.survey import grid_key, lay_out
from seip_addon.core.workflows.survey_settings import SurveySettings
from tests.engines import each_engine, needs_embree
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


@needs_embree
def test_without_float64_on_needles_embree_is_off() -> None:
    with patch.object(ray_casting, "_MAX_NEEDLE_HEIGHT", 0.0):
        check = check_hits(SCENES["slivers"], "embree", truth(SCENES["slivers"]))
    assert check.unexplained.count > 0


@each_engine
def test_without_a_common_middle_far_scenes_are_off(engine: Engine) -> None:
    far, here = far_away(STREET, 1e6), truth(STREET)
    assert check_hits(far, engine, here).flipped.count == 0

    def where_it_is(triangles, keep):
        return np.arange(len(triangles)), np.zeros(3), triangles

    with patch.object(ray_casting, "_rebased", where_it_is):
        assert check_hits(far, engine, here).flipped.count > 0


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


def test_scenes_near_their_origin_are_not_warned_of() -> None:
    assert rounding_warnings(geometry(GROUND)) == ()
    assert rounding_warnings(geometry(moved(4e3, -4e3))) == ()


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


def wide_ground(extent: float) -> np.ndarray:
    """A triangle from beside the road to far away."""
    return np.array([[[-20.0, 8, 0], [20, 8, 0], [extent, 9, 0]]])


def test_a_survey_carries_the_warning() -> None:
    plain = lay_out(geometry(GROUND), SHORT)
    wide = lay_out(geometry(GROUND, Mesh("terrain", wide_ground(3e4))), SHORT)
    assert [w for w in wide.warnings if "'terrain'" in w and "wide" in w]
    assert not [w for w in plain.warnings if "wide" in w]


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


def test_ground_that_the_builder_laid_out_is_left_out_and_not_named() -> None:
    """Its verge goes on as far as what stands there: nobody has to move it."""
    plain = lay_out(geometry(GROUND), SHORT)
    near, far = np.array([[[-20.0, 8, 0], [20, 8, 0], [20, 9, 0]]]), moved(5e2, 0)
    laid = lay_out(geometry(GROUND, Mesh("Verge", np.concatenate([near, far]), source="extract")), SHORT)
    assert laid.warnings == plain.warnings
    assert len(laid.site.triangles) == len(plain.site.triangles) + 1
    by_hand = lay_out(geometry(GROUND, Mesh("Verge", np.concatenate([near, far]))), SHORT)
    assert any("of 'Verge', are 4" in warning for warning in by_hand.warnings)


def test_what_is_just_within_reach_stays() -> None:
    inside, beyond = (lay_out(geometry(GROUND, Mesh("wall", moved(x, 0))), SHORT) for x in (340.5, 343))
    assert len(inside.site.triangles) == 4
    assert len(beyond.site.triangles) == 2


def test_scans_leave_out_what_no_sensor_reaches() -> None:
    sensor = MountedSensor("one", load_catalogue()["type1"], np.array([0.0, 0.0, 5.0]), np.eye(3))
    stray = Mesh("left behind", moved(5e5, 0), np.full(2, 0.7))
    near, far = static_scene(geometry(GROUND), [sensor]), static_scene(geometry(GROUND, stray), [sensor])
    np.testing.assert_array_equal(far.triangles, near.triangles)
    np.testing.assert_array_equal(far.reflectivity, near.reflectivity)
    assert near.warnings == ()
    assert "'left behind'" in far.warnings[0]


def test_rows_say_where_it_begins(tmp_path: Path) -> None:
    here = truth(STREET)
    engine: Engine = ray_casting.engine_name("auto")
    plain = check_hits(STREET, engine, here)
    far = check_hits(stored_far_away(STREET, 3e5), engine, here, 3e5, kept_at=3e5)
    study = ArithmeticStudy((plain,), (replace(plain, distance=1e3),), (far,), (replace(plain, distance=1e3),), ())
    rows = arithmetic_rows(study)
    save_rounding_chart(tmp_path / "rounding.png", study, "float32")
    assert (tmp_path / "rounding.png").read_bytes().startswith(b"\x89PNG")
    assert "nowhere" in rows[1].begins
    assert "over 1 cm from 300,000 m" in rows[2].begins


@pytest.mark.parametrize(("count", "trials"), [(0, 1000), (3, 50), (50, 50)])
def test_shares_hold_the_probability(count: int, trials: int) -> None:
    low, high = Share(count, trials).interval
    assert 0 <= low <= count / trials <= high <= 1
    assert high - low > 0
