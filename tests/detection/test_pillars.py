"""Pillars against a slow loop, what must not matter to them, and the area of a site: heights above the road."""

import math

from headless.detection.detection_area import area_of
from headless.detection.network import PillarEncoder
from headless.detection.pillars import PillarGrid, fill_pillars

import numpy as np
import shapely
import torch
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry
from tests.builders.street_clouds import cloud_frame

GRID = PillarGrid(west=-3.0, south=-2.0, bottom=-1.0, top=4.0, columns=12, rows=8, pillar=0.5)


def cloud(count, seed, spread=1.0):
    random = np.random.default_rng(seed)
    low, high = np.array([-4.0, -3.0, -2.0, 0.0]) * spread, np.array([4.0, 3.0, 5.0, 1.0]) * spread
    return random.uniform(low, high, (count, 4)).astype(np.float32)


def slow_features(points, grid, most):
    """Features of every point of a cloud whose pillars hold no more than they keep, by the point's bytes."""
    pillars = {}
    for point in points:
        column = math.floor((point[0] - np.float32(grid.west)) / np.float32(grid.pillar))
        row = math.floor((point[1] - np.float32(grid.south)) / np.float32(grid.pillar))
        if 0 <= column < grid.columns and 0 <= row < grid.rows and grid.bottom <= point[2] < grid.top:
            pillars.setdefault((row, column), []).append(point)
    found = {}
    for (row, column), members in pillars.items():
        assert len(members) <= most
        x = grid.west + (column + 0.5) * grid.pillar
        y = grid.south + (row + 0.5) * grid.pillar
        mean = np.mean(np.array(members, dtype=float)[:, :3], axis=0)
        for point in members:
            found[point.tobytes()] = (
                row * grid.columns + column,
                [
                    (point[2] - grid.bottom) / 2,
                    point[3],
                    (point[0] - mean[0]) / 0.25,
                    (point[1] - mean[1]) / 0.25,
                    (point[2] - mean[2]) / 0.5,
                    (point[0] - x) / 0.25,
                    (point[1] - y) / 0.25,
                    math.log(len(members)) / 3,
                ],
            )
    return found


@given(st.integers(0, 300), st.integers(0, 1000))
def test_features_are_those_of_a_slow_loop(count, seed):
    points = cloud(count, seed)
    pillars = fill_pillars(points, GRID, 32)
    expected = slow_features(points, GRID, 32)
    assert len(pillars.features) == len(expected)
    for point, features, pillar in zip(points[pillars.chosen], pillars.features, pillars.pillar, strict=True):
        number, wanted = expected[point.tobytes()]
        assert pillar == number
        np.testing.assert_allclose(features, wanted, atol=2e-5)


@given(st.integers(1, 2000), st.integers(1, 9), st.integers(0, 100))
def test_pillars_keep_the_same_points_in_any_order_and_no_more_than_they_may(count, most, seed):
    points = cloud(count, seed)
    order = np.random.default_rng(seed).permutation(count)
    one, other = fill_pillars(points, GRID, most), fill_pillars(points[order], GRID, most)
    np.testing.assert_array_equal(one.features, other.features)
    np.testing.assert_array_equal(points[one.chosen], points[order][other.chosen])
    assert np.bincount(one.pillar, minlength=1).max() <= most
    everything = fill_pillars(points, GRID, 32 * count)
    met = np.bincount(everything.pillar, minlength=len(GRID))
    np.testing.assert_array_equal(np.bincount(one.pillar, minlength=len(GRID)), np.minimum(met, most))


def encoder(seed=0, width=8):
    torch.manual_seed(seed)
    module = PillarEncoder(width)
    torch.nn.init.normal_(module.normalisation.weight)  # of both signs, and away from where layers begin
    torch.nn.init.normal_(module.normalisation.bias)
    module.normalisation.running_mean.normal_()
    return module.eval()


def encoded(module, pillars, count):
    with torch.no_grad():
        return module(torch.from_numpy(pillars.features), torch.from_numpy(pillars.pillar), count)


def test_the_encoder_takes_the_maximum_of_each_pillar():
    module, pillars = encoder(), fill_pillars(cloud(400, 7), GRID, 8)
    got = encoded(module, pillars, len(GRID))
    normal = module.normalisation
    for number in range(len(GRID)):
        mine = torch.from_numpy(pillars.features[pillars.pillar == number])
        if len(mine) == 0:
            assert (got[number] == 0).all()
            continue
        linear = mine @ module.linear.weight.T
        scaled = (linear - normal.running_mean) / torch.sqrt(normal.running_var + normal.eps)
        expected = (scaled * normal.weight + normal.bias).clamp(min=0).max(dim=0).values
        torch.testing.assert_close(got[number], expected, atol=1e-5, rtol=1e-5)


def hill(slope=0.06, across=0.02, base=100.0, half=24.0):
    """A square road that rises to the east and a little to the north."""
    corners = np.array([[x, y, base + slope * x + across * y] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    corners[:, :2] *= half
    corners[:, 2] = base + slope * corners[:, 0] + across * corners[:, 1]
    road = Mesh("road", corners[[[0, 1, 2], [0, 2, 3]]])
    return SceneGeometry("Hill", np.zeros(3), (road,), (), (), shapely.box(-16, -16, 16, 16))


def test_heights_are_those_above_the_road():
    area = area_of(hill(), 0.4)
    random = np.random.default_rng(1)
    xy = random.uniform(-15.9, 15.9, (500, 2))
    above = random.uniform(-0.9, 4.4, 500)
    z = 100 + 0.06 * xy[:, 0] + 0.02 * xy[:, 1] + above
    cloud = area.cloud(cloud_frame(np.column_stack((xy, z, np.full(500, 0.5))).astype(np.float32)))
    np.testing.assert_allclose(cloud[:, 2], above, atol=1e-4)
    np.testing.assert_array_equal(cloud[:, 3], np.float32(0.5))


def test_boxes_come_back_to_where_they_were():
    area = area_of(hill(), 0.4)
    boxes = np.column_stack([np.random.default_rng(2).uniform(-15, 15, (50, 3)), np.ones((50, 4))])
    np.testing.assert_allclose(area.raised(area.levelled(boxes)), boxes, atol=1e-12)
    assert not np.allclose(area.levelled(boxes), boxes)
