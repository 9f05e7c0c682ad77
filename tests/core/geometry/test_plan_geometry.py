import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.geometry.plan import closed, outline, plane_height, signed_area, surface_height
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
