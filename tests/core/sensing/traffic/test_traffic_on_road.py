"""Road users on a road made by hand: heights, slopes, stays, and who is off it."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.traffic.overlaps import find_overlaps, footprints, without_overlaps
from seip_addon.core.sensing.traffic.road_fit import ROAD_TOLERANCE, fit_to_road, smooth_walks
from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry
from tests.oracles.random_cases import cases

GRADE = 0.05
CAR = RoadUser("car", "car", 4.0, 1.8, 1.5)
WALKER = RoadUser("walker", "pedestrian", 0.4, 0.5, 1.7)


def strip(left, right, low, high, height):
    """Two triangles over a rectangle, each corner as high as ``height`` says."""
    corners = [(left, low), (right, low), (right, high), (left, high)]
    a, b, c, d = (np.array([x, y, height(x)]) for x, y in corners)
    return np.array([[a, b, c], [a, c, d]])


def scene(*roads, ground=(), region=None):
    """By default a street along x from -100 to 100, 8 m wide, that climbs."""
    roads = roads or (strip(-100.0, 100.0, -4.0, 4.0, lambda x: GRADE * x),)
    return SceneGeometry(
        name="street",
        origin=np.zeros(3),
        roads=tuple(Mesh("road", road) for road in roads),
        ground=tuple(Mesh("pavement", part) for part in ground),
        occluders=(),
        region=shapely.box(-80.0, -4.0, 80.0, 4.0) if region is None else region,
    )


def moving(x, y, user=CAR, *, yaw=0.0, z=np.nan, time=None):
    """One road user at points of the plan, ten times a second."""
    x = np.asarray(x, dtype=float)
    count = len(x)
    return Trajectories(
        users=(user,),
        origin=np.zeros(3),
        first=np.array([0, count]),
        time=np.arange(count) / 10.0 if time is None else np.asarray(time, dtype=float),
        position=np.column_stack([x, np.broadcast_to(y, count), np.broadcast_to(z, count)]),
        yaw=np.full(count, yaw),
        pitch=np.zeros(count),
        speed=np.zeros(count),
        source="by hand",
    )


def together(*parts):
    return replace(
        parts[0],
        users=tuple(user for part in parts for user in part.users),
        first=np.cumsum([0, *(len(part.time) for part in parts)]),
        **{
            name: np.concatenate([getattr(part, name) for part in parts])
            for name in ("time", "position", "yaw", "pitch", "speed")
        },
    )


@pytest.mark.parametrize(("yaw", "slope"), [(0.0, GRADE), (np.pi, -GRADE), (np.pi / 2.0, 0.0)])
def test_height_and_pitch_are_those_of_the_road(yaw, slope):
    fit = fit_to_road(moving([-3.0, 0.0, 3.0], 1.0, yaw=yaw), scene()).trajectories
    np.testing.assert_allclose(fit.position[:, 2], [-0.15, 0.0, 0.15], atol=5e-4)
    np.testing.assert_allclose(fit.pitch, np.arctan(slope), atol=1e-4)


def test_another_origin_is_minded():
    fit = fit_to_road(moving([10.0, 11.0], 0.0), scene()).trajectories
    away = replace(moving([10.0, 11.0], 0.0), origin=np.array([30.0, 1.0, 0.0]))
    moved = fit_to_road(away, scene()).trajectories
    np.testing.assert_allclose(moved.position[:, :2], fit.position[:, :2] + [30.0, 1.0])
    np.testing.assert_array_equal(moved.origin, np.zeros(3))


def test_under_a_bridge_the_height_in_the_data_decides():
    both = (strip(-100.0, 100.0, -4.0, 4.0, lambda _: 0.0), strip(-20.0, 20.0, -4.0, 4.0, lambda _: 6.0))
    for z, expected in ((0.3, 0.0), (5.0, 6.0), (np.nan, 6.0)):
        fit = fit_to_road(moving([0.0, 1.0], 0.0, z=z), scene(*both)).trajectories
        assert (fit.position[:, 2] == expected).all()
        assert (fit.pitch == 0.0).all()


def test_pedestrians_walk_on_pavements_and_vehicles_do_not():
    ground = (strip(-100.0, 100.0, 4.0, 12.0, lambda _: 9.0),)
    region = shapely.box(-80.0, -4.0, 80.0, 12.0)
    walks = fit_to_road(moving([0.0, 1.0], 8.0, WALKER), scene(ground=ground, region=region)).trajectories
    assert (walks.position[:, 2] == 9.0).all()
    with pytest.raises(SeipError, match="FCD of another map: 1 of 1 road user"):
        fit_to_road(moving([0.0, 1.0], 8.0), scene(ground=ground, region=region))


def test_who_leaves_the_road_is_named_and_cut_in_two():
    region = shapely.box(-80.0, -20.0, 80.0, 20.0)
    y = np.where(np.abs(np.arange(-20.0, 21.0)) < 3.0, 15.0, 0.0)
    fit = fit_to_road(together(moving(np.arange(-20.0, 21.0), y), moving([0.0, 1.0], 0.0)), scene(region=region))
    assert fit.warnings == (
        f"1 of 2 road users leaves the road by more than {ROAD_TOLERANCE:g} m and is left out there: car",
    )
    assert [user.name for user in fit.trajectories.users] == ["car", "car/2", "car"]
    assert np.diff(fit.trajectories.first).tolist() == [18, 18, 2]
    assert fit.trajectories.position[17, 0] == -3.0
    assert fit.trajectories.position[18, 0] == 3.0


def test_a_gap_in_time_ends_a_stay():
    fit = fit_to_road(moving([0.0, 1.0, 2.0, 3.0], 0.0, time=[0.0, 0.1, 5.0, 5.1]), scene()).trajectories
    assert [user.name for user in fit.users] == ["car", "car/2"]
    assert len(fit.at(2.0)) == 0


def test_pedestrians_walk_without_leaps_and_vehicles_stay_as_they_are():
    x = np.where(np.arange(60) < 30, 0.1, 2.0) + 0.12 * np.arange(60)
    both = together(moving(x, 0.0, WALKER), moving(x, 0.0))
    both = replace(both, yaw=np.where(np.arange(120) % 60 < 30, 0.0, 3.0))
    smooth = smooth_walks(both)
    np.testing.assert_array_equal(smooth.position[60:, :2], both.position[60:, :2])
    np.testing.assert_array_equal(smooth.yaw[60:], both.yaw[60:])
    step = np.diff(smooth.position[:60, 0])
    assert step.max() == pytest.approx(0.12 + 1.9 / 19)  # the leap, shared by 1.8 seconds
    assert np.diff(smooth.yaw[:60]).max() == pytest.approx(3.0 / 19)
    np.testing.assert_allclose(smooth.position[[0, 59], 0], x[[0, 59]])
    np.testing.assert_allclose(smooth.position[:20, 0], x[:20], atol=1e-12)  # straight on nothing changes


def test_the_traffic_of_another_map_is_refused_and_named():
    with pytest.raises(SeipError, match="1 road user, none in the region"):
        fit_to_road(moving([5000.0, 5001.0], 0.0), scene())
    region = shapely.box(-80.0, -40.0, 80.0, 40.0)
    strays = [moving([0.0, 1.0], 20.0, replace(CAR, name=f"stray {number}")) for number in range(7)]
    with pytest.raises(SeipError) as caught:
        fit_to_road(together(*strays, moving([0.0, 1.0], 0.0)), scene(region=region))
    assert "7 of 8 road users" in str(caught.value)
    assert "stray 0, stray 1, stray 2, stray 3, stray 4 and 2 more" in str(caught.value)


def test_kept_to_the_millimetre():
    fit = fit_to_road(moving([0.12345678, 1.0], 0.0), scene()).trajectories
    assert fit.position[0, 0] == 0.123


def test_footprints_and_overlaps_by_hand():
    crossing = together(
        moving(np.linspace(-10.0, 10.0, 101), 0.0),
        moving(np.zeros(101), np.linspace(-10.0, 10.0, 101), replace(CAR, name="across"), yaw=np.pi / 2.0),
        moving(np.full(101, 6.0), 3.0, replace(CAR, name="beside")),
    )
    np.testing.assert_allclose(
        footprints(crossing, crossing.at(0.0))[0], [[-8, 0.9], [-12, 0.9], [-12, -0.9], [-8, -0.9]], atol=1e-12
    )
    assert finish(find_overlaps(crossing)).tolist() == [[0, 1]]
    apart, names = finish(without_overlaps(crossing))
    assert names == ("car",)
    assert [user.name for user in apart.users] == ["across", "beside"]
    assert apart.first.tolist() == [0, 101, 202]
    np.testing.assert_array_equal(apart.position, crossing.position[101:])
    assert not len(finish(find_overlaps(apart)))


@given(st.lists(st.floats(-50.0, 50.0), min_size=2, max_size=20), st.floats(0.0, 1.0))
@cases(25)
def test_between_two_samples_motion_is_straight(x, share):
    line = moving(x, 0.0, z=0.0)
    end = line.span[1]
    got = line.at(share * end)
    assert got.position[0, 0] == pytest.approx(np.interp(share * end, line.time, x), abs=1e-9)
