"""Names of streets on a map that a user pans and zooms."""

import math
from itertools import combinations

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate

from seip_addon.core.geometry.map_view import MapView
from seip_addon.core.output.pictures.street_labels import REPEATED, street_labels
from seip_addon.core.world.street_plan import NamePlaces

FRAME = (0.0, 0.0, 1000.0, 800.0)
HEIGHT = 12.0


@pytest.fixture
def places():
    """Two hundred places along thirty streets, in all directions."""
    generator = np.random.default_rng(5)
    street = generator.integers(0, 30, 200)
    return NamePlaces(
        tuple(f"Street {number:02d}" for number in range(30)),
        street,
        generator.uniform(-600.0, 600.0, (200, 2)),
        generator.uniform(-math.pi / 2, math.pi / 2, 200),
        generator.uniform(20.0, 500.0, 200),
        generator.integers(0, 3, 30)[street],
    )


@pytest.fixture
def widths():
    return np.random.default_rng(6).uniform(40.0, 120.0, 30)


def box_of(label, width):
    """Return a label's turned box."""
    x, y = label.middle
    upright = shapely.box(x - width / 2, y - HEIGHT / 2, x + width / 2, y + HEIGHT / 2)
    return rotate(upright, label.angle, origin=label.middle, use_radians=True)


@pytest.mark.parametrize("scale", [0.3, 3.0])
def test_labels_are_in_the_frame_and_neither_overlap_nor_cover_dots(places, widths, scale):
    view = MapView((0.0, 0.0), scale, FRAME, 0.1)
    generator = np.random.default_rng(7)
    dots = np.column_stack((generator.uniform(0, 1000, 40), generator.uniform(0, 800, 40), np.full(40, 6.0)))
    labels = street_labels(places, widths, HEIGHT, view, dots)
    assert labels
    boxes = [box_of(one, widths[places.names.index(one.name)]) for one in labels]
    assert all(shapely.box(*FRAME).covers(box) for box in boxes)
    discs = shapely.buffer(shapely.points(dots[:, :2]), dots[:, 2] * 0.999)
    for (one, box), (other, other_box) in combinations(zip(labels, boxes, strict=True), 2):
        assert not box.intersects(other_box)
        if one.name == other.name:
            assert math.dist(one.middle, other.middle) >= REPEATED
    assert not any(box.intersects(discs).any() for box in boxes)
