"""Sparse evaluation of the network against torch's dense convolutions on a grid with a wide empty border."""

from dataclasses import replace

from headless.detection import detector as detector_module
from headless.detection.detector import Detector
from headless.detection.inference import REACH, sparse_output
from headless.detection.network import OUTPUT_STRIDE
from headless.detection.pillars import PillarGrid, fill_pillars
from headless.detection.settings import NetworkSettings

import numpy as np
import pytest
import torch
from scipy import ndimage

BORDER = 64  # pillars, more than any output sees
GRID = PillarGrid(west=-12.8, south=-8.0, bottom=-1.0, top=4.0, columns=80, rows=48, pillar=0.32)


@pytest.fixture(autouse=True)
def _full_precision(monkeypatch):
    """Some processors round dense convolutions to 16 bits."""
    monkeypatch.setattr(detector_module, "has_bfloat16", lambda _device: False)


def random_detector(seed, **settings) -> Detector:
    """Return a detector whose normalisation has statistics as after training."""
    detector = Detector(NetworkSettings(width=8, **settings), seed)
    random = torch.Generator().manual_seed(seed)
    for module in detector.modules():
        if isinstance(module, torch.nn.BatchNorm1d | torch.nn.BatchNorm2d):
            for values, low, high in (
                (module.running_mean, -0.5, 0.5),
                (module.running_var, 0.2, 2.0),
                (module.weight.data, 0.5, 1.5),
                (module.bias.data, -0.5, 0.5),
            ):
                values.copy_(torch.rand(values.shape, generator=random) * (high - low) + low)
    return detector.eval()


def cloud(seed, points) -> np.ndarray:
    """Return clusters of returns anywhere in the grid, its corners included."""
    random = np.random.default_rng(seed)
    centres = np.array([(-12.7, -7.9), (12.7, 7.2), *random.uniform((-12, -7), (12, 7), (2, 2))])
    xy = centres[random.integers(len(centres), size=points)] + random.normal(0, 0.4, (points, 2))
    return np.column_stack([xy, random.uniform(0, 2, points), random.random(points)]).astype(np.float32)


def pillars_of(detector, points):
    return fill_pillars(points, GRID, detector.settings.most_points)


@torch.inference_mode()
def dense_output(detector, pillars) -> torch.Tensor:
    rows, columns = GRID.rows + 2 * BORDER, GRID.columns + 2 * BORDER
    row, column = np.divmod(pillars.pillar, GRID.columns)
    moved = replace(pillars, pillar=(row + BORDER) * columns + column + BORDER)
    output = detector(moved, (1, rows, columns))
    inner = BORDER // OUTPUT_STRIDE
    return output[:, :, inner:-inner, inner:-inner]


@pytest.mark.parametrize(
    "settings",
    [
        {"blocks": (2, 3, 3)},
        {"blocks": (0, 1, 2), "padded": True},
    ],
)
def test_near_returns_the_output_is_that_of_dense_convolutions_and_elsewhere_that_of_an_empty_cloud(settings):
    detector = random_detector(0, **settings)
    empty = dense_output(detector, pillars_of(detector, cloud(0, 0)))
    for points in (0, 1, 2, 30, 2000):
        returns = cloud(0, points)
        within = returns[GRID.holds(returns)]
        pillars = pillars_of(detector, within)
        found = sparse_output(detector, pillars, GRID)
        dense = dense_output(detector, pillars)
        assert found.shape == dense.shape
        # What a cloud of one return gives is no object: the encoder leaves it out.
        near = cells_near(within) if len(within) > 1 else np.zeros(found.shape[2:], dtype=bool)
        scale = float(dense.abs().max())
        assert torch.allclose(found[:, :, near], dense[:, :, near], rtol=0, atol=1e-5 * scale)
        assert torch.allclose(found[:, :, ~near], empty[:, :, ~near], rtol=0, atol=1e-5 * scale)


def cells_near(points) -> np.ndarray:
    """Return the cells of the output within reach of a return, along rows and columns, by an image filter of SciPy."""
    side = GRID.pillar * OUTPUT_STRIDE
    filled = np.zeros((GRID.rows // OUTPUT_STRIDE, GRID.columns // OUTPUT_STRIDE), dtype=bool)
    column, row = ((points[:, axis] - start) / side for axis, start in ((0, GRID.west), (1, GRID.south)))
    filled[row.astype(int), column.astype(int)] = True
    cells = round(REACH / GRID.pillar) // OUTPUT_STRIDE
    return ndimage.maximum_filter(filled, size=2 * cells + 1, mode="constant")
