"""What a centre head makes of a feature map."""

import math

from headless.detection import centre_head
from headless.detection.centre_head import CentreHead
from headless.detection.pillars import PillarGrid
from headless.detection.settings import CLASSES

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st

GRID = PillarGrid(west=-8.0, south=-6.4, bottom=-1.0, top=4.0, columns=40, rows=32, pillar=0.4)
SIZES = ((4.5, 1.8, 1.6), (8.0, 2.5, 3.3), (1.9, 0.7, 1.7), (0.6, 0.6, 1.75))  # of each class, metres


def random_box(category, seed):
    random = np.random.default_rng(seed)
    shape = np.array(SIZES[category]) * random.uniform(0.8, 1.25, 3)
    place = random.uniform([-7.5, -6.0], [7.5, 6.0])
    return torch.tensor([*place, shape[2] / 2, *shape, random.uniform(-math.pi, math.pi)], dtype=torch.float32)


def perfect_output(category, box):
    """The output of a centre head that knows the road user."""
    output = torch.zeros(1, len(CLASSES) + centre_head.BOX_CHANNELS, GRID.rows // 2, GRID.columns // 2)
    output[:, : len(CLASSES)] = -10.0
    column, row = int((box[0] - GRID.west) / 0.8), int((box[1] - GRID.south) / 0.8)
    middle = torch.tensor([GRID.west + 0.8 * (column + 0.5), GRID.south + 0.8 * (row + 0.5), GRID.bottom])
    output[0, category, row, column] = 10.0
    size = torch.log(box[3:6] / torch.tensor(centre_head.TYPICAL_SIZE))
    axis = torch.stack((torch.sin(2 * box[6]), torch.cos(2 * box[6])))
    ahead = torch.stack((torch.cos(box[6]), torch.sin(box[6])))
    output[0, len(CLASSES) :, row, column] = torch.cat((box[:3] - middle, size, axis, ahead, torch.tensor([10.0])))
    return output


@given(st.integers(0, 3), st.integers(0, 10_000))
def test_a_centre_head_that_knows_the_boxes_says_them(category, seed):
    box = random_box(category, seed)
    found, score, classes = CentreHead(4, 8).candidates(perfect_output(category, box), GRID, 0.1)
    assert classes.tolist() == [category]
    torch.testing.assert_close(found[0], box, atol=1e-4, rtol=1e-4)
    assert score[0] > 0.99
