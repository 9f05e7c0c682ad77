"""Frames as in field recordings: each change does what it says, and nothing else."""

import math
from dataclasses import replace

from headless.detection.detection_area import area_of
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

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.scans.frame import STATIC_INSTANCE
from seip_addon.core.sensing.scans.simulation import ScanSettings, prepare
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.traffic.bodies import fitted_body
from tests.builders.square_by_hand import road, sensors

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
