"""Models of one LiDAR side by side: beams that diverge, random placements, and what each model changes."""

from __future__ import annotations

import math
from dataclasses import replace

from headless.studies.benchmark.sensor_models import (
    FINEST,
    PLAIN,
    SHIPPED,
    SUB_RAYS,
    DivergentCaster,
    sensor_models,
    site_front,
)
from headless.studies.benchmark.visibility import Cost

import bpy
import numpy as np
import pytest

from seip_addon.core.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.sensor import MountedSensor, level_orientation
from seip_addon.core.sensing.scans.simulation import ScanSettings, prepare
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.traffic.bodies import fitted_body
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from tests.builders.small_junction import ORIGIN, box_triangles, make_example
from tests.builders.small_scene import make_run

assert bpy.app.version  # the engine bvh needs Blender's module, which is there from here on

LIDAR = replace(load_catalogue()["os1_128"], points_per_second=2_621_440 / 8)
AHEAD = np.array([[1.0, 0.0, 0.0]])
WALL = box_triangles((10, -20, -20), (11, 20, 20))


def beam(*obstacles, along=AHEAD, divergence=0.035):
    """Cast a beam from the origin, which is 0.35 m wide at the wall; return its range, and whether it hits the wall."""
    caster = DivergentCaster(make_ray_caster(np.concatenate([WALL, *obstacles])), divergence)
    distance, triangle = caster.cast(np.zeros(3), along, 100.0)
    return float(distance[0]), int(triangle[0])


def test_a_beam_ends_where_most_of_its_rays_do():
    facing, triangle = beam()
    assert facing == pytest.approx(10.0, abs=1e-4)
    assert 0 <= triangle < len(WALL)
    speck = box_triangles((5, -0.02, -0.02), (5.1, 0.02, 0.02))  # stops the axis alone
    assert beam(speck)[0] == pytest.approx(10.0, abs=1e-4)
    pole = box_triangles((5, -0.02, -9), (5.1, 0.02, 9))  # stops the axis and the rays above and below
    assert beam(pole)[0] == pytest.approx(5.0, abs=1e-4)
    beside = box_triangles((5, 0.01, -9), (5.1, 9, 9))  # stops one of five
    assert beam(beside)[0] == pytest.approx(10.0, abs=1e-4)


def test_a_beam_meets_a_plane_where_its_axis_does():
    road = box_triangles((-200, -200, -5.1), (200, 200, -5))
    for along in ((0.6, 0.0, -0.8), (0.0, 0.0, -1.0), (0.05, 0.3, -math.sqrt(1 - 0.0925))):
        distance, _ = beam(road, along=np.array([along]), divergence=math.radians(0.2))
        assert distance == pytest.approx(-5 / along[2], rel=1e-5)
    assert beam(along=-AHEAD) == (math.inf, -1)


def test_beams_from_many_points_are_the_beams_of_each():
    caster = DivergentCaster(make_ray_caster(WALL), 0.01)
    starts = np.array([[0.0, 0.0, 0.0], [4.0, 1.0, 2.0]])
    together, _ = caster.cast(starts, np.repeat(AHEAD, 2, axis=0), 100.0)
    np.testing.assert_allclose(together, (10.0, 6.0), atol=1e-4)


def own_site():
    site = make_example(spacing=4.0, reach=36.0, heights=(5.4,)).site
    one = site.candidates.sensor == "type1"
    parts = {name: getattr(site.candidates, name)[one] for name in ("position_of", "height", "xyz", "yaw", "tilt")}
    return replace(site, candidates=replace(site.candidates, sensor=np.full(one.sum(), LIDAR.key), **parts))


@pytest.fixture(scope="module")
def front():
    pytest.importorskip("embreex", reason="embreex is not installed")
    amount = {"counts": (1, 2), "placements": 5, "checked": 3, "seed": 0, "effort": 10.0}
    return site_front(own_site(), sensor_models(LIDAR), **amount)


def test_every_model_sees_the_same_placements(front):
    assert list(front.costs) == [PLAIN, SHIPPED, FINEST]
    assert all(len(front.coverage[name][n]) == 5 for name in front.costs for n in ("1", "2"))
    for plain, shipped in zip(front.coverage[PLAIN]["2"], front.coverage[SHIPPED]["2"], strict=True):
        assert plain >= shipped  # the law takes returns away and adds none
    assert front.costs[PLAIN].seen > front.costs[SHIPPED].seen > 0
    assert front.costs[FINEST].rays % SUB_RAYS == 0
    assert front.costs[FINEST].rays > 3 * front.costs[SHIPPED].rays
    assert front.differing <= 0.01 * front.compared
    claimed, true = front.best[FINEST]["2"]
    assert claimed == true >= front.best[PLAIN]["2"][1]


def test_frames_by_the_shipped_model_are_the_product_s_own():
    pytest.importorskip("torch", reason="torch is not installed")
    from headless.detection.recordings import SampledRun  # noqa: PLC0415 -- needs torch
    from headless.studies.benchmark.sensor_precision import frames_by  # noqa: PLC0415 -- as above

    static = static_scene(make_example(reach=36.0).geometry)
    sensor = MountedSensor("S1", LIDAR, np.array([9.0, -9.0, 5.4]), level_orientation(2.3))
    traffic = make_run(1, 10.0).moved_to(ORIGIN)
    run = SampledRun("run", traffic, np.array([4.0, 6.0]))
    bodies = [fitted_body(user) for user in traffic.users]
    simulation = finish(prepare(static, [sensor], traffic, bodies, ScanSettings(seed=5)))
    costs = {}
    for model in sensor_models(LIDAR):
        cost = costs[model.name] = Cost()
        frames = [frame for _, frame in frames_by(model, static, [sensor], [run], seed=5, cost=cost)]
        if model.name == SHIPPED:
            for number, (frame, time) in enumerate(zip(frames, run.times, strict=True)):
                own = simulation.frame(number, float(time))
                np.testing.assert_array_equal(frame.points, own.points)
                np.testing.assert_array_equal(frame.intensity, own.intensity)
    assert costs[PLAIN].seen > costs[SHIPPED].seen > 0
    assert costs[FINEST].seen == pytest.approx(costs[SHIPPED].seen, rel=0.02)
    assert costs[FINEST].rays == SUB_RAYS * costs[SHIPPED].rays
