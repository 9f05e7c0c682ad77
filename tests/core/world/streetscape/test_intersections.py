import numpy as np
import pytest
import shapely

from seip_addon.core.world.opendrive.lanes import LaneSurface
from seip_addon.core.world.streetscape.intersections import with_other_carriageways


def one_way(road: str, begin: float, end: float, inner: float, outer: float) -> LaneSurface:
    """Return a lane of a one-way road along x, on the right of its inner edge."""
    s = np.linspace(0.0, abs(end - begin), 11)
    left, right = (np.column_stack([np.linspace(begin, end, 11), np.full(11, y), np.zeros(11)]) for y in (inner, outer))
    return LaneSurface(road, None, 0, -1, "driving", False, s, left, right)


@pytest.mark.parametrize("median", [0.0, 6.0])
def test_the_opposite_direction_of_a_street_is_part_of_it_with_and_without_a_median(median):
    """It ends where the given lanes end."""
    given = one_way("east", -100.0, 0.0, 0.0, -3.5)
    opposite = one_way("west", -20.0, -80.0, median, median + 3.5)
    beyond = one_way("beyond", 60.0, 10.0, median, median + 3.5)
    names = dict.fromkeys(("east", "west", "beyond"), "Avenue")
    area = with_other_carriageways([given], [given, opposite, beyond], names)
    assert area.symmetric_difference(shapely.union(given.polygon, opposite.polygon)).area == pytest.approx(
        0.0, abs=1e-6
    )


def test_another_two_way_street_beside_a_street_is_not_part_of_it():
    """Both have the same name: service roads often have that of their avenue."""
    given = one_way("east", -100.0, 0.0, 0.0, -3.5)
    others = [one_way("service west", 0.0, -100.0, 9.0, 12.5), one_way("service east", -100.0, 0.0, 9.0, 5.5)]
    names = dict.fromkeys(("east", "service west", "service east"), "Avenue")
    assert with_other_carriageways([given], [given, *others], names).equals(given.polygon)
