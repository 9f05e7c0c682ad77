"""Frames as in field recordings: each change does what it says, and nothing else."""

import math
from dataclasses import replace
from pathlib import Path

from headless.detection.detection_area import area_of
from headless.studies.site_training.companions import with_companions
from headless.studies.site_training.field_conditions import (
    ANGLE_ERROR,
    GROUND_ERROR,
    POSITION_ERROR,
    field_frame,
    with_calibration_errors,
    with_inexact_ground,
    with_lost_rows,
    with_spurious_points,
)

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.lidar.carla_dropoff import CarlaDropoff
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.frame import STATIC_INSTANCE
from seip_addon.core.sensing.scans.sensor import MountedSensor, level_orientation
from seip_addon.core.sensing.scans.simulation import ScanSettings, prepare
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.traffic.bodies import fitted_body
from seip_addon.core.sensing.traffic.overlaps import find_overlaps
from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry


def road():
    """A level square of 80 m, a car and a van that drive east, one behind the other, and four parked cars."""
    corners = np.array([[-40.0, -40, 0], [40, -40, 0], [40, 40, 0], [-40, 40, 0]])
    triangles = corners[[[0, 1, 2], [0, 2, 3]]]
    surface = Mesh("road", triangles, np.full(2, 0.3))
    geometry = SceneGeometry("Square", np.zeros(3), (surface,), (), (), shapely.box(-30, -30, 30, 30))
    parked = tuple(RoadUser(f"parked {number}", "car", 4.5, 1.8, 1.5) for number in range(4))
    users = (RoadUser("one", "car", 4.5, 1.8, 1.5), RoadUser("other", "van", 5.5, 2.0, 2.2), *parked)
    driving = [[-20.0, 2, 0], [20, 2, 0], [-30, 2, 0], [10, 2, 0]]
    standing = [[x, -10.0, 0] for x in (-24, -12, 0, 12) for _ in range(2)]
    trajectories = Trajectories(
        users=users,
        origin=np.zeros(3),
        first=np.arange(0, 13, 2),
        time=np.tile([0.0, 4.0], 6),
        position=np.array(driving + standing),
        yaw=np.zeros(12),
        pitch=np.zeros(12),
        speed=np.repeat([10.0, 0.0], [4, 8]),
    )
    return geometry, trajectories


def sensors():
    model = replace(load_catalogue()["type1"], law=CarlaDropoff(general=0.1))
    return tuple(
        MountedSensor(f"S{number}", model, np.array(place), level_orientation(0.3 * number))
        for number, place in enumerate([(-8.0, -6.0, 5.0), (12.0, 9.0, 6.0)])
    )


SEEDS = range(12)


def scanned():
    geometry, trajectories = road()
    bodies = [fitted_body(user) for user in trajectories.users]
    simulation = finish(prepare(static_scene(geometry), sensors(), trajectories, bodies, ScanSettings(seed=3)))
    return simulation.frame(7, 1.0), area_of(geometry, 0.4)


FRAME, AREA = scanned()
PLACES = np.array([sensor.xyz for sensor in sensors()])


def rows_of(points):
    return {row.tobytes() for row in np.ascontiguousarray(points)}


def test_whole_rows_are_lost_up_to_a_third():
    shares = []
    for seed in SEEDS:
        after = with_lost_rows(FRAME, sensors(), np.random.default_rng(seed))
        kept = rows_of(after.points)
        assert kept <= rows_of(FRAME.points)
        for number, sensor in enumerate(sensors()):
            own = FRAME.points[FRAME.sensor == number]
            way = (own - sensor.xyz) @ sensor.orientation
            row = np.round(np.degrees(np.arctan2(way[:, 2], np.hypot(way[:, 0], way[:, 1]))) / 0.2)
            here = np.array([point.tobytes() in kept for point in own])
            assert all(len(set(here[row == one].tolist())) == 1 for one in np.unique(row))
            shares.append(1 - here.mean())
    assert max(shares) > 0.02
    assert np.mean(np.array(shares) == 0) > 0.25


def test_spurious_points_are_on_the_ways_of_rays_and_in_the_foreground():
    after = with_spurious_points(FRAME, sensors(), np.random.default_rng(1))
    count = len(after) - len(FRAME)
    assert 0 < count <= 60
    np.testing.assert_array_equal(after.points[: len(FRAME)], FRAME.points)
    assert after.foreground[-count:].all()
    assert (after.instance[-count:] == STATIC_INSTANCE).all()
    for point, number in zip(after.points[-count:], after.sensor[-count:], strict=True):
        ways = FRAME.points[FRAME.sensor == number] - PLACES[number]
        way = point - PLACES[number]
        cosine = (ways @ way) / np.linalg.norm(ways, axis=1) / np.linalg.norm(way)
        assert math.degrees(math.acos(min(float(cosine.max()), 1.0))) < 0.1


def test_each_sensor_is_moved_and_turned_as_a_whole_within_bounds():
    after = with_calibration_errors(FRAME, sensors(), np.random.default_rng(2))
    for number, sensor in enumerate(sensors()):
        own = FRAME.sensor == number
        reach = np.linalg.norm(FRAME.points[own] - sensor.xyz, axis=1)
        moved = np.linalg.norm(after.points[own] - FRAME.points[own], axis=1)
        assert (moved <= POSITION_ERROR + ANGLE_ERROR * reach + 1e-5).all()
        assert moved.max() > 1e-4
        apart = np.linalg.norm(np.diff(FRAME.points[own].astype(float), axis=0), axis=1)
        assert np.linalg.norm(np.diff(after.points[own].astype(float), axis=0), axis=1) == pytest.approx(
            apart, abs=1e-4
        )
    one = replace(FRAME, sensor=np.zeros_like(FRAME.sensor))
    assert with_calibration_errors(one, sensors()[:1], np.random.default_rng(2)) is one


def test_points_and_boxes_share_the_error_of_the_ground():
    after = with_inexact_ground(FRAME, np.random.default_rng(4))
    np.testing.assert_array_equal(after.points[:, :2], FRAME.points[:, :2])
    rise = after.points[:, 2] - FRAME.points[:, 2]
    assert 0.01 < np.abs(rise).max() <= GROUND_ERROR
    for user, before, now in zip(FRAME.labels.user, FRAME.labels.centre, after.labels.centre, strict=True):
        own = np.flatnonzero(FRAME.instance == user)
        if len(own):
            nearest = own[np.hypot(*(FRAME.points[own, :2] - before[:2]).T).argmin()]
            assert now[2] - before[2] == pytest.approx(float(rise[nearest]), abs=0.1)


def test_labels_count_the_points_that_are_left():
    for seed in SEEDS:
        after = field_frame(FRAME, AREA, sensors(), np.random.default_rng(seed))
        for user, counted in zip(after.labels.user, after.labels.points, strict=True):
            own = after.sensor[after.instance == user]
            assert counted.tolist() == np.bincount(own, minlength=len(sensors())).tolist()


RUN = Path(__file__).parents[3] / "scenes" / "junction_traffic_dense" / "run-21.npz"


@pytest.fixture(scope="module")
def alone():
    return Trajectories.load(RUN)


@pytest.fixture(scope="module")
def grouped(alone):
    return finish(with_companions(alone, 3))


def test_companions_keep_near_the_one_they_walk_with(alone, grouped):
    names = {user.name: number for number, user in enumerate(alone.users)}
    for number in range(len(alone), len(grouped)):
        leader = names[grouped.users[number].name.rsplit(" companion ", 1)[0]]
        own = slice(*grouped.first[number : number + 2])
        theirs = slice(*grouped.first[leader : leader + 2])
        np.testing.assert_array_equal(grouped.time[own], grouped.time[theirs])
        apart = np.linalg.norm(grouped.position[own] - grouped.position[theirs], axis=1)
        assert apart.min() > 0.5
        assert apart.max() < 2.1
        assert np.ptp(apart) < 1e-6


def test_no_companion_overlaps_anyone(alone, grouped):
    before = {tuple(pair) for pair in finish(find_overlaps(alone)).tolist()}
    assert {tuple(pair) for pair in finish(find_overlaps(grouped)).tolist()} <= before
