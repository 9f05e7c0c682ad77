import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

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
