import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.world.streetscape.terrain import MAX_ROADSIDE, Embankments, Terrain, cut
from tests.oracles.random_cases import cases

SQUARE = np.array([[[0, 0, 1], [4, 0, 1], [4, 4, 3]], [[0, 0, 1], [4, 4, 3], [0, 4, 3]]], dtype=float)
"""The plane z = 1 + y / 2 over a square of side 4."""

L_SHAPE = shapely.Polygon([(0, 0), (9, 0), (9, 3), (3, 3), (3, 9), (0, 9)])


def plan_area(triangles):
    edges = triangles[:, 1:, :2] - triangles[:, :1, :2]
    return (edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]) / 2


@given(st.floats(0, 4), st.floats(0, 4))
def test_height_on_a_plane_is_the_planes(x, y):
    assert Terrain(SQUARE).height(np.array([[x, y]]))[0] == pytest.approx(1 + y / 2)


@given(st.floats(0.7, 20), st.floats(-50, 50), st.floats(-50, 50))
@cases(25)
def test_draping_keeps_the_area_wherever_the_grid_falls(spacing, x, y):
    area = shapely.affinity.translate(L_SHAPE.difference(shapely.box(1, 1, 2, 2)), x, y)
    ground = SQUARE * [100, 100, 1] - [200, 200, 0]
    triangles = Terrain(ground).drape(area, spacing=spacing, above=0.25)
    assert (plan_area(triangles) > 0).all()
    assert plan_area(triangles).sum() == pytest.approx(area.area, abs=1e-3)
    expected = 1 + (triangles[..., 1] + 200) / 200 + 0.25
    np.testing.assert_allclose(triangles[..., 2], expected, atol=1e-9)


@given(st.floats(-1, 5), st.floats(0.1, 3))
@cases(25)
def test_cutting_leaves_the_rest_on_its_plane(x, size):
    hole = shapely.box(x, 1, x + size, 1 + size)
    rest = cut(SQUARE, hole)
    assert plan_area(rest).sum() == pytest.approx(16 - hole.intersection(shapely.box(0, 0, 4, 4)).area, abs=1e-4)
    np.testing.assert_allclose(rest[..., 2], 1 + rest[..., 1] / 2, atol=1e-9)


def strip(x, width, z, length=60.0):
    """Return a road along y at a height."""
    low = np.array([[x, -length, z], [x + width, -length, z], [x + width, length, z], [x, length, z]], dtype=float)
    return low[[[0, 1, 2], [0, 2, 3]]]


def level_land(xy):
    return np.zeros(len(xy))


def test_an_embankment_leads_from_the_road_to_the_land():
    ground = Embankments(strip(0, 8, 5.0), level_land)
    along = np.column_stack([np.linspace(8.0, 30.0, 221), np.zeros(221)])
    height = ground.height(along)
    assert height[0] == pytest.approx(5.0, abs=1e-3)
    assert (np.diff(height) <= 1e-9).all()
    assert np.abs(np.diff(height)).max() < 0.1 * 1.2
    np.testing.assert_array_equal(height[along[:, 0] > 8 + MAX_ROADSIDE], 0.0)


def test_steep_ground_has_a_finer_grid_without_cracks():
    """Each edge of a triangle within the area belongs to two triangles, corners and heights alike."""
    ground = Embankments(strip(0, 8, 5.0), level_land)
    area = shapely.box(8, -36, 60, 36)
    triangles = Terrain(strip(0, 8, 5.0), ground.height, ground.steep).drape(area, spacing=12.0)
    assert plan_area(triangles).sum() == pytest.approx(area.area)
    assert len(triangles) < 1000
    edges = {}
    for corners in np.round(triangles, 6):
        for start, stop in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            edges[tuple(start), tuple(stop)] = edges.get((tuple(start), tuple(stop)), 0) + 1
    open_edges = [(start, stop) for start, stop in edges if (stop, start) not in edges]
    assert sum(np.hypot(*np.subtract(stop, start)[:2]) for start, stop in open_edges) == pytest.approx(area.length)
