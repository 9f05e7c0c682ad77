"""Disturbances: at size 0 they change nothing, else exactly what they say."""

import math
from dataclasses import replace

from headless.detection.detector import Detector
from headless.detection.settings import NetworkSettings
from headless.studies.detector_limits.disturbances import (
    DROP_INTENSITY,
    DROP_RANGE,
    ERROR_AXIS,
    CappedPillars,
    ClockOffset,
    Disturbance,
    DropOff,
    OtherSizes,
    PositionError,
    Rain,
    RangeNoise,
    SensorFailure,
    Thinned,
    TiltError,
    YawError,
    keeping_at_most,
    losing,
    range_in,
)

import numpy as np
import pytest

from seip_addon.core.progress import finish
from seip_addon.core.sensing.lidar.range_equation import RangeEquation
from seip_addon.core.sensing.scans.simulation import ScanSettings, prepare
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.traffic.bodies import fitted_body
from tests.builders.square_by_hand import road, sensors

ALL = (RangeNoise, DropOff, Rain, PositionError, YawError, TiltError, ClockOffset, Thinned, OtherSizes)
TIME = 1.0


def frame_under(disturbance, *, time=TIME):
    geometry, trajectories = road()
    hung, driving = disturbance.disturbed_sensors(sensors()), disturbance.disturbed_traffic(trajectories)
    bodies = [fitted_body(user) for user in driving.users]
    simulation = finish(prepare(static_scene(geometry), hung, driving, bodies, ScanSettings(seed=3)))
    taken = disturbance.disturbed_scan(simulation, 7, time)
    return disturbance.disturbed_frame(taken, hung, np.random.default_rng([3, 7]))


@pytest.fixture(scope="module")
def plain():
    return frame_under(Disturbance())


def same(one, other):
    for name in ("points", "sensor", "delay", "intensity", "instance", "foreground"):
        assert getattr(one, name).dtype == getattr(other, name).dtype
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    for name, value in vars(one.labels).items():
        np.testing.assert_array_equal(value, getattr(other.labels, name))


@pytest.mark.parametrize("kind", ALL)
def test_size_0_changes_nothing_bit_for_bit(kind, plain):
    same(frame_under(kind(0.0)), plain)


def test_no_cap_leaves_the_detector_alone():
    detector = Detector(NetworkSettings(width=8, blocks=(0, 0, 0)))
    assert CappedPillars(0.0).disturbed_detector(detector) is detector


def test_noise_has_the_spread_that_is_asked_for():
    quiet, noisy = (frame_under(disturbance) for disturbance in (RangeNoise(0.0), RangeNoise(0.4)))
    places = np.array([sensor.xyz for sensor in sensors()])[quiet.sensor]
    more = np.linalg.norm(noisy.points - places, axis=1) - np.linalg.norm(quiet.points - places, axis=1)
    own = sensors()[0].model.range_noise_std
    # The same numbers are drawn, so that what differs is a multiple of them.
    assert np.std(more) == pytest.approx(math.hypot(own, 0.4) - own, rel=0.03)


@pytest.mark.parametrize("share", [0.2, 0.7])
def test_the_share_lost_is_the_share_asked_for(share, plain):
    left = frame_under(DropOff(share))
    expected, spread = len(plain) * (1 - share), math.sqrt(len(plain) * share * (1 - share))
    assert abs(len(left) - expected) < 4 * spread
    whole = {tuple(point) for point in plain.points.tolist()}
    assert all(tuple(point) in whole for point in left.points.tolist())  # lost, not drawn again


def test_a_law_that_loses_half_detects_half():
    clear = RangeEquation.of_ranges(40.0, 110.0)
    assert losing(clear, 0.5).chance(np.array([1.0]), np.array([1.0]))[0] == pytest.approx(clear.ceiling / 2)


def test_a_larger_loss_takes_what_a_smaller_one_takes():
    some, fewer = ({tuple(p) for p in frame_under(DropOff(share)).points.tolist()} for share in (0.3, 0.6))
    assert fewer < some


def test_rain_takes_light_range_and_returns():
    clear, wet = sensors()[0].model, Rain(20.0).disturbed_sensors(sensors())[0].model
    assert wet.law.attenuation == pytest.approx(clear.law.attenuation + 0.04)
    # As strong as from 100 m in clear air: exp(-0.04 r) / r^2 = 1 / 100^2.
    assert math.exp(-0.04 * wet.max_range) / wet.max_range**2 == pytest.approx(1e-4, rel=1e-9)
    assert range_in(100.0, 0.0) == 100.0
    assert range_in(100.0, 0.01) > range_in(100.0, 0.04) > range_in(100.0, 0.2)


def test_rain_puts_drops_near_the_sensor_and_takes_more_from_afar(plain):
    size = 40.0
    wet = frame_under(Rain(size))
    places = np.array([sensor.xyz for sensor in sensors()])
    far = [np.linalg.norm(frame.points - places[frame.sensor], axis=1) for frame in (plain, wet)]
    drops = wet.intensity == np.float32(DROP_INTENSITY)
    share = 1 - math.exp(-size / 1000 * DROP_RANGE)
    assert abs(drops.sum() - share * len(wet)) < 4 * math.sqrt(len(wet) * share * (1 - share))
    assert far[1][drops].max() <= DROP_RANGE + 1e-3
    assert (wet.instance[drops] == -1).all()
    left = [np.count_nonzero(far[1][~drops] >= r) / np.count_nonzero(far[0] >= r) for r in (10, 20)]
    assert left[1] < left[0] < 1
    assert wet.labels.points.sum() == np.count_nonzero(wet.instance >= 0)


def test_points_of_a_misplaced_sensor_are_moved_and_no_others(plain):
    moved = frame_under(PositionError(0.5, sensor=1))
    own = plain.sensor == 1
    np.testing.assert_array_equal(moved.points[~own], plain.points[~own])
    by = moved.points[own] - plain.points[own] - np.array([0.5, 0.5, 0.0]) / math.sqrt(2)
    assert np.abs(by).max() < 3e-5


def test_points_of_a_sensor_with_a_yaw_error_are_rotated_about_its_own_place(plain):
    place, angle = sensors()[1].xyz, math.radians(2.0)
    turned, own = frame_under(YawError(2.0, sensor=1)), plain.sensor == 1
    way, other = plain.points[own] - place, turned.points[own] - place
    np.testing.assert_allclose(other[:, 2], way[:, 2], atol=1e-5)
    after = (way[:, 0] + 1j * way[:, 1]) * complex(math.cos(angle), math.sin(angle))
    np.testing.assert_allclose(other[:, 0] + 1j * other[:, 1], after, atol=1e-4)
    np.testing.assert_array_equal(turned.points[~own], plain.points[~own])


def test_points_of_a_tilted_sensor_keep_their_distance_and_what_lies_on_the_axis(plain):
    place = sensors()[0].xyz
    tilted, own = frame_under(TiltError(1.0, sensor=0)), plain.sensor == 0
    way, other = plain.points[own] - place, tilted.points[own] - place
    np.testing.assert_allclose(np.linalg.norm(other, axis=1), np.linalg.norm(way, axis=1), rtol=1e-5)
    np.testing.assert_allclose(other @ ERROR_AXIS, way @ ERROR_AXIS, atol=1e-4)
    # At right angles to the axis, on the ground: lifted or sunk by its distance times the angle.
    across = way @ np.cross(ERROR_AXIS, [0.0, 0, 1])
    np.testing.assert_allclose(other[:, 2] - way[:, 2], -across * math.sin(math.radians(1.0)), atol=0.01)


def test_a_lost_sensor_has_no_points_and_nobody_returns_to_it(plain):
    left = frame_under(SensorFailure.each(1))
    assert set(left.sensor.tolist()) == {0}
    np.testing.assert_array_equal(left.points, plain.points[plain.sensor == 0])
    assert (left.labels.points[:, 1] == 0).all()
    np.testing.assert_array_equal(left.labels.points[:, 0], plain.labels.points[:, 0])


def test_a_late_clock_shows_the_street_of_before(plain):
    late = frame_under(ClockOffset(0.4, sensor=0))
    of_other = [frame.points[frame.sensor == 1] for frame in (plain, late)]
    np.testing.assert_array_equal(*of_other)
    before = frame_under(Disturbance(), time=TIME - 0.4)
    np.testing.assert_array_equal(late.points[late.sensor == 0], before.points[before.sensor == 0])
    assert not np.array_equal(before.points[before.sensor == 0], plain.points[plain.sensor == 0])
    assert late.labels.points[:, 0].tolist() == before.labels.points[:, 0].tolist()
    np.testing.assert_array_equal(late.labels.centre, plain.labels.centre)  # where they are, not where they were
    assert (np.diff(late.sensor) >= 0).all()


def test_thinner_traffic_leaves_whole_road_users_out():
    _, trajectories = road()
    many = replace(
        trajectories,
        users=tuple(replace(trajectories.users[0], name=str(number)) for number in range(400)),
        first=np.arange(0, 801, 2),
        **{name: np.tile(getattr(trajectories, name)[:2].T, 400).T for name in ("time", "yaw", "pitch", "speed")},
        position=np.tile(trajectories.position[:2], (400, 1)),
    )
    left = Thinned(0.3).disturbed_traffic(many)
    assert abs(len(left) - 280) < 4 * math.sqrt(400 * 0.3 * 0.7)
    assert len(left.time) == left.first[-1] == 2 * len(left)
    assert {user.name for user in Thinned(0.6).disturbed_traffic(many).users} < {user.name for user in left.users}
    np.testing.assert_array_equal(left.at(1.0).position, many.at(1.0).position[: len(left)])


def test_other_sizes_keep_the_motion_and_the_look():
    _, trajectories = road()
    other = OtherSizes(0.15).disturbed_traffic(trajectories)
    np.testing.assert_array_equal(other.position, trajectories.position)
    for user, own in zip(other.users, trajectories.users, strict=True):
        assert (user.name, user.category, user.paint) == (own.name, own.category, own.paint)
        assert 0.849 <= user.length / own.length <= 1.151
    assert [user.length for user in other.users] != [user.length for user in trajectories.users]


def test_a_capped_detector_has_the_same_weights():
    detector = Detector(NetworkSettings(width=8, blocks=(0, 0, 0)), seed=5)
    capped = CappedPillars(2.0).disturbed_detector(detector)
    assert capped.settings == replace(detector.settings, most_points=2)
    for name, value in keeping_at_most(detector, 2).state_dict().items():
        assert (value == detector.state_dict()[name]).all()
        assert (value == capped.state_dict()[name]).all()
