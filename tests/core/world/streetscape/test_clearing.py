"""Clearing of the carriageway: trees of an extract are moved to a set distance from its edge."""

import numpy as np
import pytest
import shapely

from seip_addon.core.site.scene_geometry import FROM_EXTRACT
from seip_addon.core.world.streetscape.clearing import SETBACK, clear
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
