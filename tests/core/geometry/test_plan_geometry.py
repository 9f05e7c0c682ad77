import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.geometry.plan import closed, outline, plane_height, signed_area, surface_height, without
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


def test_what_stands_on_edge_covers_nothing():
    wall = np.array([[[0, 0, 0], [5, 0, 0], [5, 0, 3]]], dtype=float)
    assert outline(wall).is_empty
    assert np.isnan(surface_height(np.array([[2.0, 0.0]]), wall)).all()


def test_corners_that_differ_by_rounding_are_one():
    """A union of lanes left them, at which a mitre of no length divided by zero."""
    corners = [(4.9043, -129.6512), (4.7935, -134.6487), (1.5943, -134.5778), (7.466, 130.2934), (13.8645, 130.1516)]
    twins = [
        (7.466000000000001, 130.2934),
        (13.864500000000001, 130.1516),
        (8.103500000000002, -129.7221),
        (8.1035, -129.7221),
    ]
    area = shapely.Polygon([*corners, *twins])
    assert area.is_valid
    assert closed(area, 0.05).area == pytest.approx(area.area, abs=1e-6)


def test_gaps_up_to_twice_the_width_are_closed():
    parts = shapely.union_all([shapely.box(0, 0, 4, 4), shapely.box(4.1, 0, 8, 4), shapely.box(8.3, 0, 12, 4)])
    assert shapely.get_num_geometries(closed(parts, 0.06)) == 2


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


def test_the_shared_edge_of_two_triangles_has_a_height():
    square = np.array([[[0, 0, 1], [3, 0, 1], [3, 1, 1]], [[0, 0, 1], [3, 1, 1], [0, 1, 1]]], dtype=float)
    along = np.linspace(0, 3, 1001)
    assert surface_height(np.column_stack([along, along / 3]), square) == pytest.approx(1.0)


def test_an_outline_that_crosses_itself_can_be_taken_away():
    """Buffers with mitred corners now and then return one."""
    bow_tie = shapely.Polygon([(0, 0), (4, 4), (4, 0), (0, 4)])
    with pytest.raises(shapely.errors.GEOSException):
        shapely.box(-1, 1, 5, 3).difference(bow_tie)
    rest = without(shapely.box(-1, 1, 5, 3), bow_tie)
    assert rest.is_valid
    assert 0 < rest.area < 12
    assert without(shapely.box(0, 0, 4, 4), shapely.box(0, 0, 1, 4)).area == 12
