"""Clearing of the carriageway: trees of an extract are moved to a set distance from its edge."""

import numpy as np
import pytest
import shapely

from seip_addon.core.site.scene_geometry import FROM_EXTRACT
from seip_addon.core.world.streetscape.clearing import NEAR_EDGE, SETBACK, clear
from seip_addon.core.world.streetscape.description import SiteDescription, Trees

ROAD = shapely.box(-50.0, -3.5, 50.0, 3.5)
MOUTHS = shapely.MultiLineString([[(x, -3.5), (x, 3.5)] for x in (-50.0, 50.0)])


def cleared(*positions):
    trees = Trees(np.array(positions, dtype=float), 8.0, 4.0, FROM_EXTRACT)
    description, _ = clear(SiteDescription(trees=(trees,)), ROAD, MOUTHS)
    return description.trees[0].positions


@pytest.mark.parametrize("depth", [2.0, SETBACK, 0.15, 0.05, 1e-3, 1e-8, 0.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_tree_is_set_back_by_the_same_distance_whatever_its_depth(depth, side):
    ((x, y),) = cleared((7.0, side * (3.5 - depth)))
    assert (x, y) == pytest.approx((7.0, side * (3.5 + SETBACK)), abs=1e-6)


def test_a_tree_at_the_edge_near_the_end_of_the_modelled_road_is_not_moved_beyond_that_end():
    ((x, y),) = cleared((49.7, 3.5 - 1e-9))
    assert (x, y) == pytest.approx((49.7, 3.5 + SETBACK), abs=1e-6)


def test_a_tree_outside_stays_and_one_in_the_middle_is_left_out():
    np.testing.assert_array_equal(cleared((7.0, 3.6), (7.0, 0.2), (7.0, 3.5 - NEAR_EDGE - 0.1)), [[7.0, 3.6]])
