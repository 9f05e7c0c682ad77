"""Float32: both ray casters against float64 on hard scenes."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.lidar.beams import BeamPattern
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.settings import MAX_DELTA, Engine, VisibilitySettings
from seip_addon.core.site.site import Candidates, Site, Targets
from tests.engines import each_engine
from tests.oracles.float64_bounds import FirstHits, first_hits
from tests.oracles.float64_rays import first_hits as plain_first_hits
from tests.oracles.hard_scenes import HardScene, hard_scenes, ordinary_scene, stored_far_away, with_stray

FLOAT32_STEP = float(np.finfo(np.float32).eps)
"""Largest step of float32 as a share of a coordinate."""

MAX_ROUNDINGS = 64
"""Tolerance of a hit, in steps of float32 at the scene's extent; visibility uses the same."""

RAY_LENGTH = 1e9  # metres
TARGETS = 300
SENSOR = LidarModel(
    key="probe",
    name="probe",
    manufacturer="none",
    source="none",
    elevations=np.radians(np.linspace(-70, 0, 24)),
    min_range=0.001,
    max_range=9000.0,
    points_per_second=24 * 10 * 150.0,
    rotation_rate=10.0,
    price_range=(1.0, 1.0),
)
"""Sensor with so few rays that all of them can be cast in float64."""

SCENES = {scene.name: scene for scene in hard_scenes(1500, np.random.default_rng(1))}
STREET = ordinary_scene(1500, np.random.default_rng(2))


def extent_of(scene: HardScene) -> float:
    """Return the longest side of the box about a scene and the start of its rays, in metres."""
    points = np.concatenate([scene.triangles.reshape(-1, 3), scene.origin[None]])
    return float(np.ptp(points, axis=0).max())


def tolerance_of(scene: HardScene) -> float:
    """Return the largest error of a hit that rounding explains, in metres."""
    return MAX_ROUNDINGS * FLOAT32_STEP * extent_of(scene)


def truth(scene: HardScene) -> FirstHits:
    return first_hits(scene.origin, scene.directions, scene.triangles, tolerance_of(scene))


def errors_across(scene: HardScene, engine: Engine, exact: FirstHits) -> tuple[np.ndarray, np.ndarray]:
    """Return distances, and errors perpendicular to the surfaces; infinite for a hit instead of a miss."""
    found, _ = make_ray_caster(scene.triangles, engine).cast(scene.origin, scene.directions, RAY_LENGTH)
    hit, there = np.isfinite(found), np.isfinite(exact.distance)
    errors = np.where(hit == there, 0.0, np.inf)
    both = hit & there
    errors[both] = np.abs(found[both] - exact.distance[both]) * exact.slope[both]
    return found, errors


def site_of(scene: HardScene) -> Site:
    """Return a scene as a site: targets on its surfaces, and one pose at the origin of its rays."""
    random = np.random.default_rng(len(scene.triangles))
    share = random.dirichlet((1.0, 1.0, 1.0), TARGETS)
    targets = (scene.triangles[random.integers(0, len(scene.triangles), TARGETS)] * share[:, :, None]).sum(axis=1)
    pose = scene.origin[None]
    return Site(
        name=scene.name,
        origin=np.zeros(3),
        region=shapely.box(*scene.triangles[:, :, :2].min(axis=(0, 1)), *scene.triangles[:, :, :2].max(axis=(0, 1))),
        targets=Targets(targets, np.ones(TARGETS), np.zeros(TARGETS, dtype=bool), 1.0),
        candidates=Candidates(
            position=pose,
            position_name=np.array(["probe"]),
            on_pole=np.zeros(1, dtype=bool),
            pole_source=np.full(1, ""),
            position_of=np.zeros(1, dtype=np.int64),
            sensor=np.array([SENSOR.key]),
            height=pose[:, 2],
            xyz=pose,
            yaw=np.zeros(1),
            tilt=np.zeros(1),
            mandatory=np.zeros((0, 1), dtype=bool),
            mandatory_name=np.zeros(0, dtype=np.str_),
            dropped={},
        ),
        triangles=scene.triangles,
        reflectivity=np.ones(len(scene.triangles)),
    )


def surely_and_possibly_seen(scene: HardScene, targets: np.ndarray, delta: float) -> tuple[np.ndarray, np.ndarray]:
    """Return whether targets are visible whatever the rounding, and whether they may be, (t,) bool each."""
    directions = BeamPattern(SENSOR).directions(np.arange(SENSOR.channels * SENSOR.azimuth_count))
    tolerance = tolerance_of(scene)
    hits = first_hits(scene.origin, directions, scene.triangles, tolerance)
    in_range = (hits.farthest >= SENSOR.min_range) & (hits.farthest <= SENSOR.max_range)
    surely, maybe = np.zeros(len(targets), dtype=bool), np.zeros(len(targets), dtype=bool)
    for number, target in enumerate(targets - scene.origin):
        along = directions @ target
        aside = np.sqrt(np.maximum(target @ target - along**2, 0.0))
        near, far = (np.where(np.isfinite(end), end, RAY_LENGTH) for end in (hits.nearest, hits.farthest))
        ends = np.hypot(aside, np.maximum(np.abs(near - along), np.abs(far - along)))
        surely[number] = ((ends < delta - tolerance) & in_range).any()
        closest = np.hypot(aside, np.clip(along, near, far) - along)
        maybe[number] = (np.isfinite(hits.nearest) & (closest < delta + tolerance)).any()
    return surely, maybe


@pytest.mark.slow
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


@pytest.mark.slow
@each_engine
@pytest.mark.parametrize("name", SCENES)
def test_hard_scenes_flip_no_hit_and_no_target(engine: Engine, name: str) -> None:
    scene, exact = SCENES[name], truth(SCENES[name])
    found, errors = errors_across(scene, engine, exact)
    assert errors.max() <= tolerance_of(scene)
    assert exact.allow(found).all()

    site, delta = site_of(scene), min(extent_of(scene) / 40.0, MAX_DELTA)
    seen = finish(compute_visibility(site, {SENSOR.key: SENSOR}, VisibilitySettings(delta), engine)).visible[0]
    surely, maybe = surely_and_possibly_seen(scene, site.targets.xyz, delta)
    assert (seen | ~surely).all()
    assert (maybe | ~seen).all()


@each_engine
def test_float32_moves_hits_where_coordinates_are_large(engine: Engine) -> None:
    here = truth(STREET)

    def largest_error(scene: HardScene, exact: FirstHits) -> float:
        return float(errors_across(scene, engine, exact)[1].max())

    near, far = 3e3, 3e5
    assert largest_error(stored_far_away(STREET, near), here) < 1e-3
    assert largest_error(stored_far_away(STREET, far), here) > 1e-2
    for distance, off in ((near, False), (far, True)):
        scene = with_stray(STREET, distance)
        assert (largest_error(scene, truth(scene)) > 1e-3) == off
