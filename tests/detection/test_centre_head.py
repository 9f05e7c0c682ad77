"""What heads ask of a feature map, what they make of it, and what they learn from."""

import math

from headless.detection import centre_head
from headless.detection.centre_head import CentreHead, TrainingTargets
from headless.detection.pillars import PillarGrid
from headless.detection.settings import CLASSES

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st

GRID = PillarGrid(west=-8.0, south=-6.4, bottom=-1.0, top=4.0, columns=40, rows=32, pillar=0.4)
SIZES = ((4.5, 1.8, 1.6), (8.0, 2.5, 3.3), (1.9, 0.7, 1.7), (0.6, 0.6, 1.75))  # of each class, metres


def targets(*rows, trained=None):
    """TrainingTargets from rows of class and box."""
    boxes = torch.tensor([row[1:] for row in rows], dtype=torch.float32).reshape(-1, 7)
    category = torch.tensor([row[0] for row in rows], dtype=torch.int64)
    kept = torch.ones(len(rows), dtype=torch.bool) if trained is None else torch.tensor(trained)
    return TrainingTargets(boxes, category, kept)


def random_targets(seed, count=4):
    random = np.random.default_rng(seed)
    rows = []
    for _ in range(count):
        category = int(random.integers(4))
        shape = np.array(SIZES[category]) * random.uniform(0.8, 1.25, 3)
        place = random.uniform([-7.5, -6.0], [7.5, 6.0])
        rows.append((category, *place, shape[2] / 2, *shape, random.uniform(-math.pi, math.pi)))
    return targets(*rows)


def perfect_output(wanted, grid):
    """The output of a centre head that knows the road users."""
    rows, columns = grid.rows // 2, grid.columns // 2
    output = torch.zeros(1, len(CLASSES) + centre_head.BOX_CHANNELS, rows, columns)
    output[:, : len(CLASSES)] = -10.0
    for category, box in zip(wanted.category.tolist(), wanted.boxes, strict=True):
        column, row = int((box[0] - grid.west) / 0.8), int((box[1] - grid.south) / 0.8)
        middle = torch.tensor([grid.west + 0.8 * (column + 0.5), grid.south + 0.8 * (row + 0.5), grid.bottom])
        output[0, category, row, column] = 10.0
        size = torch.log(box[3:6] / torch.tensor(centre_head.TYPICAL_SIZE))
        axis = torch.stack((torch.sin(2 * box[6]), torch.cos(2 * box[6])))
        ahead = torch.stack((torch.cos(box[6]), torch.sin(box[6])))
        told = torch.cat((box[:3] - middle, size, axis, ahead, torch.tensor([10.0])))
        output[0, len(CLASSES) :, row, column] = told
    return output


@given(st.integers(0, 10_000))
def test_a_centre_head_that_knows_the_boxes_says_them(seed):
    wanted = random_targets(seed, count=1)
    boxes, score, category = CentreHead(4, 8).candidates(perfect_output(wanted, GRID), GRID, 0.1)
    assert category.tolist() == wanted.category.tolist()
    torch.testing.assert_close(boxes, wanted.boxes, atol=1e-4, rtol=1e-4)
    assert score[0] > 0.99
