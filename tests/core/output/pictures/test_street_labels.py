"""Names of streets on a map that a user pans and zooms."""

import math

import numpy as np
import pytest

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


def corners(label, width):
    """Corners of a label's turned box, (4, 2)."""
    turn = np.array([(math.cos(label.angle), math.sin(label.angle)), (-math.sin(label.angle), math.cos(label.angle))])
    box = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (width / 2, HEIGHT / 2)
    return np.array(label.middle) + box @ turn


def overlap(one, other):
    """Return whether two turned boxes overlap: no side of either separates them."""
    for box in (one, other):
        for axis in np.diff(box[:3], axis=0):
            a, b = one @ axis, other @ axis
            if a.max() <= b.min() or b.max() <= a.min():
                return False
    return True


@pytest.mark.parametrize("scale", [0.3, 3.0])
def test_labels_are_in_the_frame_and_neither_overlap_nor_cover_dots(places, widths, scale):
    view = MapView((0.0, 0.0), scale, FRAME, 0.1)
    generator = np.random.default_rng(7)
    dots = np.column_stack((generator.uniform(0, 1000, 40), generator.uniform(0, 800, 40), np.full(40, 6.0)))
    labels = street_labels(places, widths, HEIGHT, view, dots)
    assert labels
    numbers = [places.names.index(one.name) for one in labels]
    boxes = [corners(one, widths[number]) for one, number in zip(labels, numbers, strict=True)]
    assert np.all((np.array(boxes) >= 0) & (np.array(boxes) <= FRAME[2:]))
    for number, (one, box) in enumerate(zip(labels, boxes, strict=True)):
        for other, other_box in zip(labels[:number], boxes[:number], strict=True):
            assert not overlap(box, other_box)
            if one.name == other.name:
                assert math.dist(one.middle, other.middle) >= REPEATED
        for x, y, radius in dots.tolist():
            square = np.array([(x, y)]) + np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * radius / 1.5
            assert not overlap(box, square)
