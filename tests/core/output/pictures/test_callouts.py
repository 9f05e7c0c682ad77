import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.output.pictures.labels import place_callouts, stack_upwards
from tests.oracles.random_cases import cases

BOUNDS = (0.0, 0.0, 1000.0, 800.0)
CLEARANCE = 8.0
NOWHERE = np.empty((0, 2))


def overlap(low_a, high_a, low_b, high_b):
    return bool(np.all((low_a < high_b) & (low_b < high_a)))


@cases(60)
@given(st.integers(0, 10_000), st.integers(1, 12))
def test_with_room_no_label_hides_an_anchor_or_another_label_or_leaves_the_picture(seed, count):
    random = np.random.default_rng(seed)
    anchors = random.uniform((100, 100), (900, 700), (count, 2))
    sizes = random.uniform((60, 15), (100, 25), (count, 2))
    centres = place_callouts(anchors, sizes, BOUNDS, CLEARANCE, NOWHERE)
    low, high = centres - sizes / 2, centres + sizes / 2
    assert np.all((low >= (0, 0)) & (high <= (1000, 800)))
    for i in range(count):
        for anchor in anchors:
            assert not overlap(low[i], high[i], anchor, anchor)
        for j in range(i):
            assert not overlap(low[i], high[i], low[j], high[j])


@cases(100)
@given(st.integers(0, 10_000), st.integers(0, 12))
def test_boxes_are_stacked_upwards_without_overlap_and_no_farther_than_needed(seed, count):
    random = np.random.default_rng(seed)
    boxes = np.column_stack([random.uniform(0, 60, (count, 2)), random.uniform(20, 40, count), np.full(count, 18.0)])
    rise = stack_upwards(boxes, 2.0)
    low = boxes[:, :2] + np.column_stack([np.zeros(count), rise])
    high = low + boxes[:, 2:]
    assert (rise >= 0.0).all()
    for i in range(count):
        assert not any(overlap(low[i], high[i], low[j], high[j] + (0.0, 1.99)) for j in range(count) if j != i)
        if rise[i] > 0.0:  # it stands on another
            assert any(abs(low[i, 1] - high[j, 1] - 2.0) < 1e-9 for j in range(count))
