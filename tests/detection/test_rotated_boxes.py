"""Overlap of rotated boxes against shapely, by hand, and by what must hold whatever the boxes are."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

torch = pytest.importorskip("torch", reason="the detector's torch is optional")

from headless.detection.rotated_boxes import iou_matrix, paired_iou, suppress  # noqa: E402

EXACT = 1e-9
GRID = 1e-13  # lengths of the first box


def outlines(boxes):
    x, y, length, width, yaw = boxes.T
    corners = np.stack([np.stack([sx * length, sy * width], -1) for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1))], 1)
    cosine, sine = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    turned = np.stack(
        [cosine * corners[..., 0] - sine * corners[..., 1], sine * corners[..., 0] + cosine * corners[..., 1]], -1
    )
    return shapely.polygons(turned / 2 + np.stack([x, y], -1)[:, None])


def by_shapely(a, b):
    """The overlap by another's polygons, seen from the first box and in its lengths.

    They are laid on a fine grid: on plain floats GEOS 3.14 finds no intersection for some boxes that are π-turned.
    """
    scale = np.maximum(a[:, 2:3], a[:, 3:4])
    here, there = a.copy(), b.copy()
    there[:, :2] -= a[:, :2]
    here[:, :2] = 0
    here[:, :4] /= scale
    there[:, :4] /= scale
    shared = shapely.area(shapely.intersection(outlines(here), outlines(there), grid_size=GRID))
    return shared / (here[:, 2] * here[:, 3] + there[:, 2] * there[:, 3] - shared)


def upright(plan, z=0.0, height=1.0):
    """Boxes (n, 7) that stand over boxes in plan (n, 5)."""
    count = len(plan)
    return torch.from_numpy(
        np.column_stack([plan[:, :2], np.full(count, z), plan[:, 2:4], np.full(count, height), plan[:, 4]])
    )


def random_boxes(rng, count, *, reach=6.0):
    return np.column_stack(
        [
            rng.uniform(-reach, reach, (count, 2)),
            rng.uniform(0.3, 12, count),
            rng.uniform(0.3, 3, count),
            rng.uniform(-7, 7, count),
        ]
    )


def varied_pairs(count):
    """Random pairs, and beside them every kind of pair that trips up polygon clipping."""
    rng = np.random.default_rng(1)
    a = random_boxes(rng, count)
    b = random_boxes(rng, count)
    kinds = np.arange(count) % 12
    b[kinds == 1] = a[kinds == 1]  # identical
    b[kinds == 2] = a[kinds == 2] + [0, 0, 0, 0, math.pi]
    b[kinds == 3] = a[kinds == 3] + [0, 0, 0, 0, math.pi / 2]
    b[kinds == 4] = a[kinds == 4] * [1, 1, 0.5, 0.5, 1]  # one within the other, sides parallel
    touching = kinds == 5  # bumper on bumper
    b[touching] = a[touching]
    b[touching, 0] += a[touching, 2] * np.cos(a[touching, 4])
    b[touching, 1] += a[touching, 2] * np.sin(a[touching, 4])
    aside = kinds == 6  # side by side, half a length on
    b[aside] = a[aside]
    b[aside, 0] += a[aside, 2] / 2 * np.cos(a[aside, 4]) - a[aside, 3] / 3 * np.sin(a[aside, 4])
    b[aside, 1] += a[aside, 2] / 2 * np.sin(a[aside, 4]) + a[aside, 3] / 3 * np.cos(a[aside, 4])
    b[kinds == 7] = a[kinds == 7] + rng.normal(0, 1e-9, (np.sum(kinds == 7), 5)) * [1, 1, 0, 0, 1]
    near = kinds == 8  # a good detection
    b[near] = a[near] + rng.normal(0, 0.1, (np.sum(near), 5)) * [1, 1, 1, 1, 1]
    b[near, 2:4] = np.abs(b[near, 2:4])
    tiny = kinds == 9
    a[tiny, :4] *= 1e-4
    b[tiny, :4] *= 1e-4
    corner = kinds == 10  # square to the axes, corner on corner or edge through corner
    a[corner], b[corner] = [0, 0, 4, 2, 0], [2, 1, 4, 2, 0]
    a[corner, 0] = rng.integers(-2, 3, np.sum(corner))
    b[corner, 4] = rng.integers(0, 4, np.sum(corner)) * math.pi / 2
    far = kinds == 11  # map coordinates
    a[far, :2] += [4e5, 5.6e6]
    b[far, :2] = a[far, :2] + rng.uniform(-4, 4, (np.sum(far), 2))
    return a, b, kinds


def test_pairs_agree_with_shapely():
    a, b, kinds = varied_pairs(3_000)
    ours = paired_iou(upright(a), upright(b)).numpy()
    wrong = np.abs(ours - by_shapely(a, b))
    assert wrong.max() < EXACT, f"{wrong.max()} in pairs of kind {kinds[wrong.argmax()]}"
    assert np.all(ours[kinds == 1] == pytest.approx(1, abs=EXACT))
    assert np.mean(ours > 0) > 0.6  # the comparison would mean little among boxes that miss each other


def test_overlap_in_space_by_hand():
    box = torch.tensor([[0, 0, 1, 4, 2, 2, 0]], dtype=torch.float64)  # from z 0 to 2
    raised = torch.tensor([[1, 0, 2, 4, 2, 2, math.pi]], dtype=torch.float64)  # shares 6 × 1 of 16 + 16 − 6
    above = torch.tensor([[0, 0, 3, 4, 2, 2, 0]], dtype=torch.float64)  # stands on it
    found = [paired_iou(box, other, in_space=True).item() for other in (raised, above, box)]
    assert found == pytest.approx([6 / 26, 0, 1], abs=1e-15)


@pytest.mark.parametrize("in_space", [False, True])
def test_matrices_hold_every_pair(in_space):
    rng = np.random.default_rng(2)
    boxes = upright(random_boxes(rng, 70, reach=25), rng.uniform(0, 2, 70), rng.uniform(1, 3, 70))
    a, b = boxes[:40], boxes[40:]
    i, j = (at.ravel() for at in torch.meshgrid(torch.arange(40), torch.arange(30), indexing="ij"))
    found = iou_matrix(a, b, in_space=in_space)
    assert torch.allclose(found.ravel(), paired_iou(a[i], b[j], in_space=in_space), rtol=0, atol=1e-15)
    assert 0.01 < (found > 0).double().mean() < 0.5


@given(st.lists(st.tuples(st.floats(0, 30), st.floats(0, 30), st.integers(0, 3)), max_size=25), st.floats(0.05, 0.9))
def test_suppression_is_the_plain_loop(rows, threshold):
    table = upright(np.array([(x, y, 5, 2, x + y) for x, y, _ in rows]).reshape(-1, 5))
    scores = np.array([score for *_, score in rows], dtype=float)
    overlap = iou_matrix(table, table).numpy()
    kept = []
    for row in sorted(range(len(rows)), key=lambda row: (-scores[row], row)):
        if all(overlap[best, row] <= threshold for best in kept):
            kept.append(row)
    assert suppress(table, torch.from_numpy(scores), threshold).tolist() == kept
