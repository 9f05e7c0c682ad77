"""Buildings as solids: closed, and of the volume that geometry says."""

from collections import Counter

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.world.streetscape.street_furniture import house

BOX = shapely.box(3.0, 5.0, 15.0, 13.0)  # 12 m by 8 m


def volume(solid):
    """Return the volume within faces that are planar or nearly so, by the divergence theorem."""
    total = 0.0
    for face in solid.faces:
        corners = solid.vertices[list(face)]
        for i in range(1, len(corners) - 1):
            total += np.dot(corners[0], np.cross(corners[i], corners[i + 1])) / 6
    return total


def is_closed(solid):
    """Return whether each edge is used once in each direction."""
    places = [tuple(np.round(vertex, 5)) for vertex in solid.vertices]
    edges = Counter(
        (places[a], places[b])
        for face in solid.faces
        for a, b in zip(face, (*face[1:], face[0]), strict=True)
        if places[a] != places[b]
    )
    return all(number == edges[b, a] for (a, b), number in edges.items())


def test_a_courtyard_stays_open():
    outline = shapely.Polygon(BOX.exterior, [shapely.box(6, 7, 10, 11).exterior])
    solid = house(outline, 0.0, 5.0, side="wall")
    assert is_closed(solid)
    assert volume(solid) == pytest.approx((96 - 16) * 5)


coordinates = st.tuples(st.floats(-40, 40), st.floats(-40, 40))


@given(
    points=st.lists(coordinates, min_size=3, max_size=9),
    hole=st.booleans(),
)
def test_every_outline_makes_a_closed_solid(points, hole):
    outline = shapely.MultiPoint(points).convex_hull
    if outline.geom_type != "Polygon" or outline.area < 1.0 or outline.buffer(-0.3).is_empty:
        return
    if hole and not outline.buffer(-2.0).is_empty:
        outline = outline.difference(outline.buffer(-2.0))
    solid = house(outline, 1.0, 6.0, side="wall")
    assert is_closed(solid)
    assert volume(solid) == pytest.approx(5 * outline.area, rel=1e-3)
    assert (solid.vertices[:, 2].min(), solid.vertices[:, 2].max()) == (1.0, 6.0)
    assert len(solid.faces) == len(solid.materials)
