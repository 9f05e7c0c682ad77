"""Detection in one cloud, for which the network is evaluated only at cells near returns.

Without the static background, about one pillar in a hundred has returns. Elsewhere each layer returns its response to
emptiness, a pattern of a few cells that repeats: it is computed once. A convolution is then a product of matrices over
the cells that a return can influence (as in B. Graham, L. van der Maaten: Submanifold Sparse Convolutional Networks,
2017, but with all cells that a dense convolution would change, so that the result is the same up to rounding).

The plane beyond the grid counts as empty. A dense convolution has zeros there instead, to which the network responds
with road users that do not exist.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional
from torch.nn.utils.fusion import fuse_conv_bn_eval

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.scans.frame import Frame

from .detection_area import DetectionArea
from .detector import Detector
from .frame_results import Detections
from .network import OUTPUT_STRIDE
from .pillars import PillarGrid, Pillars, fill_pillars
from .rotated_boxes import suppress
from .settings import GRID_STRIDE

MIN_SCORE = 0.05  # boxes below it are not kept: average precision hardly sees them, and time is spent on each
MAX_OVERLAP = 0.1  # intersection over union in plan beyond which two boxes are one road user

REACH = 9.0
"""Distance from a return up to which road users are detected, metres: half the length of a long vehicle, of which
only one end returns points."""

_UNROLLED = 3  # rows and columns of a convolution
_Layer = tuple[Tensor, Tensor]  # weights (inputs, outputs) and biases, batch normalisation included


@dataclass(frozen=True, eq=False)
class _Plane:
    """Channels of the cells of a plane that are not as in an empty one.

    Parameters
    ----------
    where : (rows, columns) bool Tensor
        The n cells with values of their own.
    values : (n + 1, channels) Tensor
        Their channels, row by row; then those of every other cell.
    """

    where: Tensor
    values: Tensor

    @property
    def index(self) -> Tensor:
        """Row of ``values`` of each cell, (rows, columns) int64 Tensor."""
        own = self.where.flatten().cumsum(0) - 1
        return torch.where(self.where, own.view(self.where.shape), len(self.values) - 1)


def detect(detector: Detector, area: DetectionArea, frame: Frame, *, least_score: float = MIN_SCORE) -> Detections:
    """Return the road users in a frame, in local site axes, best first.

    Parameters
    ----------
    area : DetectionArea
        Detection area of the site; returns outside are ignored.
    least_score : float
        Lowest score of a returned detection.

    Raises
    ------
    SeipError
        The detector was trained with pillars of another size.
    """
    found = detect_on_level(detector, area.grid, area.cloud(frame), least_score=least_score)
    return Detections(area.raised(found.boxes), found.score, found.category)


@torch.inference_mode()
def detect_on_level(
    detector: Detector, grid: PillarGrid, cloud: NDArray[np.float32], *, least_score: float = MIN_SCORE
) -> Detections:
    """Return the road users in foreground returns, best first.

    Parameters
    ----------
    cloud : (n, 4) float32
        x, y, height above the road (metres), intensity, 0 to 1.

    Returns
    -------
    Detections
        With heights above the road.
    """
    if grid.pillar != detector.settings.pillar:
        raise SeipError(
            f"a detector trained with pillars of {detector.settings.pillar:g} m does not work with pillars of "
            f"{grid.pillar:g} m: lay the grid with its own"
        )
    detector.eval()
    pillars = fill_pillars(cloud, grid, detector.settings.most_points)
    boxes, score, category = detector.head.candidates(sparse_output(detector, pillars, grid), grid, least_score)
    stays = suppress(boxes, score, MAX_OVERLAP)
    return Detections(
        boxes=boxes[stays].double().cpu().numpy(),
        score=score[stays].double().cpu().numpy(),
        category=category[stays].cpu().numpy(),
    )


@torch.inference_mode()
def sparse_output(detector: Detector, pillars: Pillars, grid: PillarGrid) -> Tensor:
    """Return the output of a detector's head for one cloud.

    Cells farther from all returns than `REACH`, along rows or columns and in whole cells, have the output of an empty
    cloud.

    Returns
    -------
    (1, channels, rows / 2, columns / 2) float32 Tensor
    """
    plane = _encoded(detector, pillars, grid)
    backbone = detector.feature_map.backbone
    # Returns at the border change cells beyond the grid, which in turn change cells within it.
    border = _border(detector.settings.blocks)
    cells = functional.pad(
        _near(plane.where, OUTPUT_STRIDE, round(REACH / grid.pillar)), (border // OUTPUT_STRIDE,) * 4
    )
    plane = _Plane(functional.pad(plane.where, (border,) * 4), plane.values)
    # The head looks at the neighbours of its cells too.
    around = functional.max_pool2d(functional.pad(cells, (1, 1, 1, 1)).float()[None], _UNROLLED, 1, 1)[0] > 0
    features, empty = [], []
    for down, up in zip(backbone.down, backbone.up, strict=True):
        for block in cast("nn.Sequential", down):
            plane = _convolved(plane, _layer(block), _stride(block))
        values, pattern = _upsampled(plane, around, up)
        features.append(values)
        empty.append(pattern)
    side = max(len(pattern) for pattern in empty)
    patterns = [pattern.repeat(side // len(pattern), side // len(pattern), 1) for pattern in empty]
    known = torch.cat(features, dim=1)
    known = torch.cat((known, known.new_zeros((1, known.shape[1]))))  # a row for all other cells, which is never read
    output = _head_output(detector, _Plane(around, known), cells, torch.cat(patterns, dim=2))
    inner = border // OUTPUT_STRIDE
    return output[:, :, inner:-inner, inner:-inner]


def _border(blocks: tuple[int, ...]) -> int:
    """Return the width, in pillars, of the border outside the grid through which returns in it affect its cells."""
    sees, stride = OUTPUT_STRIDE, 1  # pillars on each side of a cell: first those of the head
    for count in blocks:
        sees += stride + count * 2 * stride
        stride *= 2
    return GRID_STRIDE * -(-sees // (2 * GRID_STRIDE))  # there and back again


def _layer(block: nn.Module) -> _Layer:
    """Return the weights of a convolution and its batch normalisation, if it has one, as those of one product."""
    convolution, *rest = cast("nn.Sequential", block)
    transposed = isinstance(convolution, nn.ConvTranspose2d)
    for normalisation in rest[:1]:
        convolution = fuse_conv_bn_eval(
            cast("nn.Conv2d", convolution), cast("nn.BatchNorm2d", normalisation), transpose=transposed
        )
    weight, bias = cast("Tensor", convolution.weight), cast("Tensor", convolution.bias)
    return (weight.permute(0, 2, 3, 1).flatten(1) if transposed else weight.permute(2, 3, 1, 0).flatten(0, 2)), bias


def _stride(block: nn.Module) -> int:
    return int(cast("nn.Conv2d", cast("nn.Sequential", block)[0]).stride[0])


def _encoded(detector: Detector, pillars: Pillars, grid: PillarGrid) -> _Plane:
    device = detector.device
    pillar = torch.from_numpy(pillars.pillar).to(device)
    filled, own = torch.unique_consecutive(pillar, return_inverse=True)
    where = torch.zeros(len(grid), dtype=torch.bool, device=device)
    where[filled] = True
    encoder = detector.feature_map.encoder
    # An empty pillar is zero, as one more pillar without points is.
    values = encoder(torch.from_numpy(pillars.features).to(device), own, len(filled) + 1)
    return _Plane(where.view(grid.rows, grid.columns), values)


def _near(where: Tensor, stride: int, reach: int) -> Tensor:
    """Return the cells, of ``stride`` cells of a plane a side, with a cell of it within ``reach`` rows and columns."""
    coarse = functional.max_pool2d(where.float()[None], stride)
    cells = reach // stride
    rows = functional.max_pool2d(coarse, (2 * cells + 1, 1), 1, (cells, 0))
    near: Tensor = functional.max_pool2d(rows, (1, 2 * cells + 1), 1, (0, cells))[0] > 0
    return near


def _convolved(plane: _Plane, layer: _Layer, stride: int) -> _Plane:
    """Return the convolution of a plane, with ReLU."""
    where = functional.max_pool2d(plane.where.float()[None], _UNROLLED, stride, 1)[0] > 0
    return _Plane(where, torch.relu(_products(plane, where, layer, stride)))


def _products(plane: _Plane, where: Tensor, layer: _Layer, stride: int = 1) -> Tensor:
    """Return the products of the neighbourhoods of cells, and last of an empty neighbourhood, with the weights."""
    weight, bias = layer
    empty = len(plane.values) - 1
    index = functional.pad(plane.index, (1, 1, 1, 1), value=empty)
    row, column = (at * stride for at in torch.nonzero(where, as_tuple=True))
    step = torch.arange(_UNROLLED, device=index.device)
    window = (step[:, None] * index.shape[1] + step).flatten()
    neighbours = index.flatten()[(row * index.shape[1] + column)[:, None] + window]
    neighbours = torch.cat((neighbours, neighbours.new_full((1, len(window)), empty)))
    gathered = plane.values.index_select(0, neighbours.flatten()).view(len(neighbours), -1)
    products: Tensor = torch.addmm(bias, gathered, weight)
    return products


def _upsampled(plane: _Plane, around: Tensor, block: nn.Module) -> tuple[Tensor, Tensor]:
    """Return the values of cells of the output of an upsampling block, and its pattern on an empty plane.

    Parameters
    ----------
    around : (rows + 2, columns + 2) bool Tensor
        Cells of the output, with those around its border.

    Returns
    -------
    (n, channels) Tensor, (factor, factor, channels) Tensor
    """
    factor = _stride(block)
    weight, bias = _layer(block)
    each = torch.relu((plane.values @ weight).view(len(plane.values), factor**2, -1) + bias)
    row, column = (at - 1 for at in torch.nonzero(around, as_tuple=True))
    index = functional.pad(plane.index, (1, 1, 1, 1), value=len(plane.values) - 1)
    within = row.remainder(factor) * factor + column.remainder(factor)
    values = each[
        index[row.div(factor, rounding_mode="floor") + 1, column.div(factor, rounding_mode="floor") + 1], within
    ]
    return values, each[-1].view(factor, factor, -1)


def _head_output(detector: Detector, plane: _Plane, cells: Tensor, pattern: Tensor) -> Tensor:
    """Return the output of the head at cells, and elsewhere that for a pattern (side, side, channels) without end."""
    side = len(pattern)
    endless = pattern.permute(2, 0, 1).repeat(1, 3, 3)[None]
    empty: Tensor = detector.head(endless)[0, :, side : 2 * side, side : 2 * side]
    rows, columns = cells.shape
    output = empty.repeat(1, -(-rows // side), -(-columns // side))[:, :rows, :columns].clone()
    output[:, cells] = _head_values(detector, plane, cells).T
    return output[None].float()


def _head_values(detector: Detector, plane: _Plane, cells: Tensor) -> Tensor:
    """Return the output of the head at cells, (n, channels) Tensor."""
    branches = [list(branch) for branch in detector.head.branches]
    where = functional.pad(cells, (1, 1, 1, 1))
    # The hidden layers of all branches are one, as gathering their neighbourhoods takes as long as the products.
    weights, biases = zip(*(_layer(hidden) for hidden, _ in branches), strict=True)
    together = _products(plane, where, (torch.cat(weights, dim=1), torch.cat(biases)))[:-1]
    values = torch.relu(together).split([len(bias) for bias in biases], dim=1)
    last = [_layer(nn.Sequential(branch[-1])) for branch in branches]
    return torch.cat([torch.addmm(bias, one, weight) for one, (weight, bias) in zip(values, last, strict=True)], dim=1)
