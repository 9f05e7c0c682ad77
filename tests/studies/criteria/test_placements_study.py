"""Drawing placements, the criteria beside coverage, and what is kept of a study."""

import math
from dataclasses import replace
from types import SimpleNamespace

from headless.studies.full_scan import beam_directions

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.detection.recordings import SampledRun
from headless.studies.criteria.criteria import cars_at, criteria_of
from headless.studies.criteria.drawing import (
    BETWEEN,
    NEAR,
    OPTIMAL,
    RANDOM,
    PlacementsStudySettings,
    draw_placements,
)
from headless.studies.criteria.pose_criteria import SeenShare
from headless.studies.criteria.site_criteria import best_of, problem_of
from headless.studies.detection.sensor_configuration import SensorConfiguration

import numpy as np

from seip_addon.core.choosing.placement.deployment import deploy
from seip_addon.core.choosing.placement.search_limits import DEFAULT_LIMITS
from seip_addon.core.geometry.orientation import orientation
from seip_addon.core.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.noisy_returns import return_chance
from seip_addon.core.sensing.returns.bodies import PANELS
from seip_addon.core.sensing.returns.expected_returns import expected_returns
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.scans.static_scene import StaticScene
from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.site.site import Targets
from tests.builders.small_junction import make_example

SETTINGS = PlacementsStudySettings(placements=11, count=2, training_placements=6)


@pytest.fixture(scope="module")
def survey():
    """A survey of one type, with visibility by plain lines of sight."""
    example = make_example(spacing=4.0, heights=(5.4,))
    candidates = example.site.candidates
    kept = np.flatnonzero(candidates.sensor == "type2")
    columns = {
        name: getattr(candidates, name)[kept] for name in ("position_of", "sensor", "height", "xyz", "yaw", "tilt")
    }
    return SimpleNamespace(
        site=replace(example.site, candidates=replace(candidates, **columns)),
        models={"type2": example.models["type2"]},
        grid=SimpleNamespace(visible=example.visible[kept]),
        settings=SimpleNamespace(limits=DEFAULT_LIMITS),
    )


def poses(configurations):
    return [frozenset(sensor.pose for sensor in one.deployment.sensors) for one in configurations]


def test_placements_are_feasible_different_and_spread(survey):
    drawn = finish(draw_placements(survey, SETTINGS, {}))
    assert drawn.kind == (OPTIMAL, *[RANDOM] * 5, *[BETWEEN] * 5)
    everything = poses(drawn.evaluated) + poses(drawn.training)
    assert len(set(everything)) == len(everything) == 17
    position = survey.site.candidates.position_of
    assert all(len({position[pose] for pose in some}) == 2 for some in everything)
    coverage = np.array([one.deployment.coverage for one in drawn.evaluated])
    visible = survey.grid.visible
    best = max(
        (visible[a] | visible[b]).mean() for a in range(len(visible)) for b in range(a) if position[a] != position[b]
    )
    assert coverage[0] == pytest.approx(best)
    assert np.ptp(coverage[6:]) > 0.4 * np.ptp(coverage)
    assert (coverage[6:] >= coverage[0] - NEAR).sum() >= 2
    assert (coverage[6:] < coverage[0] - NEAR).sum() >= 2


@pytest.mark.parametrize("key", ["coverage", "occupancy_entropy"])
def test_what_coverage_rates_best_is_proven_optimal(survey, key):
    """Of all pairs: a greedy choice would be another, worse one."""
    visible, weight = survey.grid.visible, np.ones(len(survey.site.targets))
    criterion = SeenShare(key, key, visible, weight)
    problem = problem_of(survey, 2)
    found = finish(best_of(criterion, survey, problem))
    position = survey.site.candidates.position_of
    best = max(
        (visible[a] | visible[b]).mean() for a in range(len(visible)) for b in range(a) if position[a] != position[b]
    )
    assert criterion.value(found) == pytest.approx(best)


def test_random_placements_are_uniform(survey):
    """Each pose is in as many of them as chance has it."""
    number = len(survey.site.candidates)
    counts = np.zeros(number)
    for seed in range(12):
        drawn = finish(draw_placements(survey, replace(SETTINGS, placements=60, seed=seed), {}))
        for some in poses(drawn.evaluated[1:31]):
            counts[list(some)] += 1
    expected = counts.sum() / number
    assert ((counts - expected) ** 2 / expected).sum() < number + 4 * math.sqrt(2 * number)


CAR = PANELS["car"]


def rectangle(sensor, target):
    """The car as two triangles that face the sensor."""
    offset = target - sensor.xyz
    across = np.array([-offset[1], offset[0], 0.0]) / np.hypot(*offset[:2]) * CAR.width / 2
    up = np.array([0.0, 0.0, CAR.height])
    a, b, c, d = target - across, target + across, target + across + up, target - across + up
    return np.array([(a, b, c), (a, c, d)])


GROUND = np.array([[(-90, -90, 0), (90, -90, 0), (90, 90, 0)], [(-90, -90, 0), (90, 90, 0), (-90, 90, 0)]], dtype=float)
WALL = np.array([[(10, -9, 0), (10, 9, 0), (10, 9, 6)], [(10, -9, 0), (10, 9, 6), (10, -9, 6)]], dtype=float)


@pytest.mark.parametrize("turn", [orientation(0.0, 0.0), orientation(2.0, math.radians(12))])
def test_a_cars_returns_are_those_of_a_scan_of_it(turn):
    """The oracle stands the car in the scene and casts every ray at both."""
    model = load_catalogue()["type1"]
    sensor = MountedSensor("S1", model, np.array([1.0, 2.0, 4.0]), turn)
    targets = np.array([[2.0, 18.0, 0.0], [-14.0, 2.0, 0.0], [25.0, 2.0, 0.0], [-3.0, -30.0, 0.0], [-60.0, 0.5, 0.0]])
    static = np.concatenate([GROUND, WALL])
    beams = beam_directions(model).reshape(-1, 3) @ turn.T
    expected = []
    for target in targets:
        car = rectangle(sensor, target)
        reach, triangle = make_ray_caster(np.concatenate([static, car])).cast(sensor.xyz, beams, model.max_range)
        on_car = reach[triangle >= len(static)]
        expected.append(return_chance(model, on_car, np.full(len(on_car), CAR.reflected)).sum())
    found, _ = expected_returns(make_ray_caster(static), sensor.xyz, turn, model, cars_at(targets))
    assert expected[2] == 0  # behind the wall
    assert min(expected[:2]) > 20
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=2.0)


def one_car(name="car", x=0.0, seconds=12.0):
    return Trajectories(
        users=(RoadUser("it", name, 4.0, 2.0, 1.5),),
        origin=np.zeros(3),
        first=np.array([0, 3]),
        time=np.array([0.0, seconds / 2, seconds]),
        position=np.array([[x, 0.0, 0.0], [x, 0.0, 0.0], [x + 100.0, 0.0, 0.0]]),
        yaw=np.full(3, np.pi / 2),
        pitch=np.zeros(3),
        speed=np.zeros(3),
        source=name,
    )


def run_of(trajectories):
    return SampledRun("run", trajectories, np.arange(2.0, 12.0, 2.0))


def test_criteria_by_hand():
    """Three targets of which one is central and one holds a car: each of three placements sees one of them."""
    models = load_catalogue()
    example = make_example(spacing=4.0)
    xyz = np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [0.0, 20.0, 0.0]])
    targets = Targets(xyz, np.array([1.0, 4.0, 1.0]), np.array([False, True, False]), 1.0)
    site = replace(example.site, targets=targets)
    everything = np.zeros((len(site.candidates), 3), dtype=bool)
    everything[[0, 1, 2], [0, 1, 2]] = True
    placements = [
        SensorConfiguration(f"{pose}", deploy(site, models, everything[[pose]], [pose]), "type1", 1, "random", np.inf)
        for pose in (0, 1, 2)
    ]
    simulator = SimpleNamespace(static=StaticScene(GROUND, np.full(2, 0.3), site.region), settings=ScanSettings())
    precise = SimpleNamespace(share_with_returns=np.array([0.1, 0.2, 0.3]))
    trained = SimpleNamespace(training=(run_of(one_car(seconds=40.0)),))  # for 18 of 38 s, and then passing the second
    found = {
        one.key: one for one in finish(criteria_of(SimpleNamespace(site=site), simulator, placements, trained, precise))
    }
    assert found["coverage"].values == pytest.approx([1 / 3] * 3)
    assert found["weighted_coverage"].values == pytest.approx([1 / 6, 4 / 6, 1 / 6])
    assert found["traffic_coverage"].values == pytest.approx([1, 0, 0], abs=0.05)
    assert found["occupancy_entropy"].values[0] > found["occupancy_entropy"].values[1] > 0
    assert found["occupancy_entropy"].values[2] == 0
    assert ((found["targets_with_returns"].values >= 0) & (found["targets_with_returns"].values <= 1)).all()
    assert (found["log_returns"].values > 0).all()
    assert [key for key, one in found.items() if not one.beforehand] == ["test_vehicles_with_returns"]
    flat = replace(site, targets=replace(targets, central=np.zeros(3, dtype=bool)))
    steps = criteria_of(SimpleNamespace(site=flat), simulator, placements, trained, precise)
    assert "weighted_coverage" not in {one.key for one in finish(steps)}
