"""Legend, labels and the status of a section in the room that they have."""

import pytest

from seip_addon.overlay import Block, Entry
from seip_addon.viewport.legend import LEAST_SCALE, placed_legend

BLACK = (0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def blocks(add_on):
    words = ("seen by two or more  71.2%", "seen by one sensor  20.4%", "not seen  8.4%")
    return [Block("Coverage of the road by sensors", tuple(Entry(one, (BLACK,)) for one in words))]


def boxes_apart(one, other):
    return one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]


@pytest.mark.parametrize("size", [(2000.0, 1400.0), (2000.0, 520.0), (460.0, 300.0)])
def test_a_legend_keeps_off_the_gizmos_of_navigation(blocks, size):
    frame = (0.0, 0.0, *size)
    gizmos = [(size[0] - 208.0, size[1] - 208.0, *size), (size[0] - 92.0, size[1] - 468.0, *size)]
    box, scale = placed_legend(blocks, frame, 2.0, gizmos)
    assert all(boxes_apart(box, gizmo) for gizmo in gizmos)
    assert scale >= LEAST_SCALE
    assert box[0] >= 0.0
    free, without = placed_legend(blocks, frame, 2.0)
    if size[0] == 2000.0 and size[1] > 300.0:
        assert scale == without == 2.0
    if size[1] == 1400.0:
        assert box == free
