"""Geometry in plan, rotations, and the view of a map in a window."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from seip_addon.core.geometry.map_view import MAX_SCALE, MapView
from seip_addon.core.geometry.orientation import quaternion_of, quaternion_rotation
from seip_addon.core.geometry.plan import closed, opened, outline, plane_height, signed_area, surface_height
from tests.oracles.random_cases import cases

corner = st.tuples(st.integers(-50, 50), st.integers(-50, 50), st.integers(-5, 5))
triangles = st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=6).map(lambda t: np.array(t, dtype=float))


@given(triangles)
def test_areas_are_signed_by_the_turn(some):
    polygons = shapely.polygons(some[:, :, :2])
    np.testing.assert_allclose(np.abs(signed_area(some)), shapely.area(polygons))
    turning = signed_area(some) != 0
    rings = shapely.get_exterior_ring(polygons)
    assert (shapely.is_ccw(rings) == (signed_area(some) > 0))[turning].all()


@given(triangles)
@cases(40)
def test_an_outline_covers_what_its_triangles_cover(some):
    lying = some[np.abs(signed_area(some)) > 0]
    union = shapely.union_all(shapely.polygons(lying[:, :, :2]))
    rounding = 1e-3 * shapely.length(shapely.polygons(lying[:, :, :2])).sum()
    assert outline(some).symmetric_difference(union).area <= rounding


def test_gaps_up_to_twice_the_width_are_closed():
    parts = shapely.union_all([shapely.box(0, 0, 4, 4), shapely.box(4.1, 0, 8, 4), shapely.box(8.3, 0, 12, 4)])
    assert shapely.get_num_geometries(closed(parts, 0.06)) == 2


def test_an_area_is_not_lost_where_two_corners_nearly_coincide():
    """Their distance is 2.5 micrometres, in an arm as wide as what is taken away."""
    corners = [
        *((47.816614171937886, 14.396419022058208), (50.79204592757332, 14.216084345448337)),
        *((60.665343409516126, 13.617784498036997), (70.53864340951611, 13.019484498036997)),
        *((70.47815659048388, 12.021315501963004), (50.731556590483876, 13.217915501963004)),
        *((50.73155407978447, 13.217915778271115), (47.7599578699025, 13.398017866333994)),
        *((47.03476235359321, 0.6182592897469114), (-2.398384008639733, 1.639557291456637)),
    ]
    area = shapely.Polygon(corners)
    assert opened(area, 1.0).area == pytest.approx(area.area, rel=0.02)


@given(triangles, st.floats(-50, 50), st.floats(-50, 50))
@cases(40)
def test_the_surface_is_the_highest_plane_over_a_point(some, x, y):
    place = np.array([[x, y]])
    lying = some[np.abs(signed_area(some)) > 0]
    polygons = shapely.polygons(lying[:, :, :2])
    over = lying[shapely.contains_xy(shapely.buffer(polygons, -1e-3), x, y)]
    found = surface_height(place, some)[0]
    if len(over):
        assert found >= plane_height(over, np.repeat(place, len(over), axis=0)).max() - 1e-9
    elif shapely.distance(polygons, shapely.Point(x, y)).min(initial=np.inf) > 1e-2:
        assert np.isnan(found)


ANGLE = st.floats(-np.pi, np.pi) | st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi])


@given(ANGLE, ANGLE, ANGLE)
def test_quaternions_against_scipy(yaw, tilt, roll):
    turn = Rotation.from_euler("ZYX", [yaw, tilt, roll])
    x, y, z, w = turn.as_quat()
    np.testing.assert_allclose(quaternion_rotation(np.array([w, x, y, z])), turn.as_matrix(), rtol=0.0, atol=1e-12)
    quaternion = quaternion_of(turn.as_matrix())
    assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-12)
    assert abs(quaternion @ [w, x, y, z]) == pytest.approx(1.0, abs=1e-9)


FRAME = (100.0, 50.0, 900.0, 650.0)


@pytest.fixture
def points():
    return np.random.default_rng(3).uniform((-700.0, 200.0), (500.0, 900.0), (40, 2))


def test_all_points_are_in_the_frame_of_the_fitted_view_and_nearly_fill_it(points):
    pixels = MapView.fitted(points, FRAME).to_pixels(points)
    left, bottom, right, top = FRAME
    assert np.all((pixels >= (left, bottom)) & (pixels <= (right, top)))
    shares = np.ptp(pixels, axis=0) / (right - left, top - bottom)
    assert shares.max() == pytest.approx(0.92)
    assert (pixels.min(axis=0) + pixels.max(axis=0)) / 2 == pytest.approx(((left + right) / 2, (bottom + top) / 2))


@pytest.mark.parametrize("factor", [1.25, 1e9, 1e-9])
def test_the_place_under_the_mouse_stays_there_as_the_view_is_zoomed(points, factor):
    view, mouse = MapView.fitted(points, FRAME), (321.0, 456.0)
    zoomed = view.zoomed(factor, mouse)
    assert zoomed.to_metres(mouse) == pytest.approx(view.to_metres(mouse))
    expected = {1e9: MAX_SCALE, 1e-9: view.scale / 2}.get(factor, view.scale * factor)
    assert zoomed.scale == pytest.approx(expected)
