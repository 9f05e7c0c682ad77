"""Locations of sensors in words."""

import numpy as np
import pytest
import shapely

from seip_addon.core.site.locations import locations
from seip_addon.core.site.scene_geometry import Mesh, NamedArea, SceneGeometry


def road(left, bottom, right, top):
    corners = np.array([(left, bottom, 0.0), (right, bottom, 0.0), (right, top, 0.0), (left, top, 0.0)])
    return Mesh("Road", corners[[[0, 1, 2], [0, 2, 3]]])


PLACES = (
    NamedArea("Rope Lane", shapely.box(10, -4, 100, 4)),
    NamedArea("Mill Street", shapely.box(-4, 10, 4, 100)),
    NamedArea("Tram track", shapely.box(10, 4, 100, 5), track=True),
    NamedArea("Crossing of Rope Lane", shapely.box(12, -4, 16, 4), crossing=True),
)


def scene(places=PLACES):
    """Two streets that meet at the origin: Rope Lane to the east, Mill Street to the north."""
    roads = (road(-4, -4, 100, 4), road(-4, -4, 4, 100))
    return SceneGeometry("Corner", np.zeros(3), roads, (), (), shapely.box(-50, -50, 100, 100), places=places)


@pytest.mark.parametrize(
    ("foot", "words"),
    [
        ((30.0, 5.2), "north kerb of Rope Lane, 1.2 m behind the kerb, 14 m east of the crossing of Rope Lane"),
        ((14.0, -4.5), "south kerb of Rope Lane, 0.5 m behind the kerb, beside the crossing of Rope Lane"),
        (
            (-5.0, -5.0),
            (
                "south-west corner of Mill Street and Rope Lane, 1.4 m behind the kerb, 17 m west of the crossing of "
                "Rope Lane"
            ),
        ),
        (
            (60.0, 3.0),
            "north kerb of Rope Lane, 1.0 m into the road from the kerb, 44 m east of the crossing of Rope Lane",
        ),
    ],
)
def test_street_side_and_distances_are_those_of_a_plan_drawn_by_hand(foot, words):
    assert locations(scene(), np.array([foot])) == [words]
