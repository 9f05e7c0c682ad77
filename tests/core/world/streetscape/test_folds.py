"""Folds of lane edges at bends that are tighter than the road is wide."""

import numpy as np
import pytest
import shapely

from seip_addon.core.world.opendrive.lanes import LaneSurface
from seip_addon.core.world.streetscape.model import without_folds


def bent_lane(inner=3.2, outer=5.7):
    """Return a lane to the right of a street with a right angle in it: 3.2 m to 5.7 m beside the middle line."""
    middle = np.array([(-20, 0), (0, 0), (4, 0), (4, -0.01), (4, -4), (4, -8), (4, -24)], dtype=float)
    along = np.gradient(middle, axis=0)
    along[2:4] = [(1, 0), (0, -1)]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    aside = np.column_stack([along[:, 1], -along[:, 0]])
    edges = [np.column_stack([middle + by * aside, np.arange(7.0)]) for by in (inner, outer)]
    return LaneSurface(
        road_id="1", section=0, lane_id=-2, lane_type="sidewalk", s=np.arange(7.0), left=edges[0], right=edges[1],
        junction_id=None, keeps_left=False,
    )  # fmt: skip


def test_a_fold_shrinks_to_the_point_where_the_edge_crosses_itself():
    lane = bent_lane()
    assert not shapely.LineString(lane.right[:, :2]).is_simple
    (found,) = without_folds([lane])
    for edge, before in ((found.left, lane.left), (found.right, lane.right)):
        line = shapely.LineString(edge[:, :2])
        assert shapely.remove_repeated_points(line).is_simple
        assert len(edge) == len(before)
    crossing = (4 - 5.7, -5.7)
    assert np.hypot(*(found.right[:, :2] - crossing).T).min() == pytest.approx(0.0, abs=0.05)


def test_an_edge_without_folds_stays_as_it_is():
    lane = bent_lane(-3.2, -5.7)
    (found,) = without_folds([lane])
    assert np.array_equal(found.left, lane.left)
    assert np.array_equal(found.right, lane.right)
