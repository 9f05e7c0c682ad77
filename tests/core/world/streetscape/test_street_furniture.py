from collections import Counter

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.geometry import solids
from seip_addon.core.world.streetscape import street_furniture as furniture
from seip_addon.core.world.streetscape.street_furniture import house
from tests.oracles.random_cases import cases

SIZES = st.floats(0.5, 40)


def volume(solid):
    """Return the volume that the faces enclose, by the divergence theorem."""
    total = 0.0
    for face in solid.faces:
        corners = solid.vertices[list(face)]
        for i in range(1, len(face) - 1):
            total += np.dot(corners[0], np.cross(corners[i], corners[i + 1])) / 6
    return total


@given(SIZES, SIZES, SIZES, st.booleans())
@cases(25)
def test_a_block_is_closed_and_faces_outwards(length, width, height, clockwise):
    base = np.array([[0, 0, 2], [length, 0, 2], [length, width, 2], [0, width, 2]])
    block = solids.block(base[::-1] if clockwise else base, np.full(4, height), side="wall")
    assert volume(block) == pytest.approx(length * width * height)


def test_a_fence_has_the_volume_of_its_panels():
    path = np.array([[0, 0, 0], [10, 0, 0], [10, 0, 0], [10, 5, 0]], dtype=float)
    assert volume(solids.fence(path, np.full(4, 2.0), 0.2, side="wall")) == pytest.approx(15 * 2 * 0.2)


@given(st.floats(3, 20), st.floats(1, 12), st.integers(0, 5))
@cases(25)
def test_a_tree_is_as_high_and_wide_as_asked_for(height, crown, variant):
    tree = furniture.tree(height, crown, variant)
    assert tree.vertices[:, 2].max() == pytest.approx(height)
    assert tree.vertices[:, 2].min() == 0.0
    assert np.abs(tree.vertices[:, :2]).max() == pytest.approx(crown / 2)
    assert len(tree.faces) < 100
    assert volume(tree) > 0


@pytest.mark.parametrize("shape", [furniture.street_light(8, 1.5), furniture.signal_pole(6, 5), furniture.post(4, 0.1)])
def test_posts_stand_on_their_foot(shape):
    assert shape.vertices[:, 2].min() == pytest.approx(0.0)
    assert volume(shape) > 0


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
