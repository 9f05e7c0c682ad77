"""Anchor-free detection head: a heat map of centres for each class, and a box in each cell.

After T. Yin, X. Zhou, P. Krähenbühl: Center-based 3D Object Detection and
Tracking. CVPR 2021, with three changes for few training steps on sparse clouds:

- heat follows the box: a Gaussian as long and as wide as the road user in
  proportion, turned with it, and every cell of it learns the box, by its heat;
- the axis is regressed as (sin 2θ, cos 2θ), which is the same for a box and the
  box turned by 180 degrees, so boxes do not suffer while front and back are
  still confused; a vector that need only point ahead tells those apart;
- a channel predicts the overlap of the box with the true one. It counts in the
  score, so that well placed boxes go first.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn import functional

from .heads import BoxProposals, TrainingTargets, cell_middles, inner_cells
from .losses import heat_map_loss, weighted_mean
from .network import OUTPUT_STRIDE, convolution
from .pillars import PillarGrid
from .rotated_boxes import in_plan, paired_iou
from .settings import CLASSES

# Channels after the heat maps.
OFFSET, SIZE, AXIS, HEADING, OVERLAP = slice(0, 3), slice(3, 6), slice(6, 8), slice(8, 10), 10
BOX_CHANNELS = 11

TYPICAL_SIZE = (4.5, 1.8, 1.6)
"""Metres, of which sizes are the exponentials: predictions begin there."""

HEAT_STD = 0.18
"""Standard deviation of heat along and across, in lengths and widths of the road user."""

MIN_HEAT = 0.2
"""Cells with less heat of a road user do not learn its box."""

INITIAL_HEAT = 0.01  # heat that every cell begins with

MAX_PEAKS = 500
"""Peaks of a cloud before suppression, the highest first."""

OVERLAP_POWER = 0.5
"""Part of the predicted overlap in a score: heat^(1 − part) · overlap^part."""


class CentreHead(nn.Module):
    """Heat maps and boxes from a feature map.

    Parameters
    ----------
    channels : int
        Of the feature map.
    width : int
        Channels of the layer between.
    """

    def __init__(self, channels: int, width: int) -> None:
        super().__init__()
        self.heat = _branch(channels, width, len(CLASSES), math.log(INITIAL_HEAT / (1 - INITIAL_HEAT)))
        self.box = _branch(channels, width, BOX_CHANNELS, 0.0)

    def forward(self, features: Tensor) -> Tensor:
        """Return the channels of heat, one for each class, and of boxes: (b, classes + 11, rows, columns)."""
        return torch.cat((self.heat(features), self.box(features)), dim=1)

    def loss(
        self, output: Tensor, targets: list[TrainingTargets], grid: PillarGrid, margin: float
    ) -> dict[str, Tensor]:
        """Return the parts of the loss; see `heads.DetectionHead`."""
        maps = [_target(wanted, grid, output.device) for wanted in targets]
        heat, owner = (torch.stack([pair[part] for pair in maps]) for part in (0, 1))
        unclear = torch.stack([heat_of(wanted.boxes[~wanted.learnt], grid, output.device)[0] for wanted in targets])
        counted = (unclear < MIN_HEAT) & inner_cells(grid, OUTPUT_STRIDE, margin, output.device)
        score = heat_map_loss(output[:, : len(CLASSES)], heat, counted[:, None])

        cloud, row, column = torch.nonzero((owner >= 0) & counted, as_tuple=True)
        first = torch.tensor([0, *(len(wanted.boxes) for wanted in targets)]).cumsum(0)[:-1].to(output.device)
        target = torch.cat([wanted.boxes for wanted in targets])[first[cloud] + owner[cloud, row, column]]
        weight = heat.amax(dim=1)[cloud, row, column]
        predicted = output[:, len(CLASSES) :].permute(0, 2, 3, 1)[cloud, row, column]
        middle = cell_bottoms(grid, row, column)
        return {"heat": score, **box_losses(predicted, target, middle, weight)}

    def candidates(self, output: Tensor, grid: PillarGrid, least_score: float) -> list[BoxProposals]:
        """Return a box for each peak of heat; see `heads.DetectionHead`."""
        heat = torch.sigmoid(output[:, : len(CLASSES)])
        heat = heat * (heat == functional.max_pool2d(heat, 3, 1, 1))
        found = []
        for cloud, values in enumerate(heat):
            category, row, column = torch.nonzero(values >= least_score, as_tuple=True)
            best = torch.sort(values[category, row, column], descending=True, stable=True).indices[:MAX_PEAKS]
            category, row, column = category[best], row[best], column[best]
            predicted = output[cloud, len(CLASSES) :, row, column].T
            boxes = _boxes(predicted, cell_bottoms(grid, row, column))
            overlap = torch.sigmoid(predicted[:, OVERLAP])
            score = values[category, row, column].pow(1 - OVERLAP_POWER) * overlap.pow(OVERLAP_POWER)
            found.append(BoxProposals(boxes, score, category))
        return found


def _branch(channels: int, width: int, outputs: int, start: float) -> nn.Sequential:
    """Return a hidden layer and one that begins near ``start``."""
    last = nn.Conv2d(width, outputs, 1)
    last.bias = nn.Parameter(torch.full((outputs,), start))
    return nn.Sequential(convolution(channels, width), last)


def box_losses(predicted: Tensor, target: Tensor, middle: Tensor, weight: Tensor) -> dict[str, Tensor]:
    """Return the losses of boxes (m, 11 channels) against those they should be (m, 7)."""
    yaw = target[:, 6]
    axis = torch.stack((torch.sin(2 * yaw), torch.cos(2 * yaw)), dim=1)
    ahead = torch.stack((torch.cos(yaw), torch.sin(yaw)), dim=1)
    size = torch.log(target[:, 3:6] / target.new_tensor(TYPICAL_SIZE))
    with torch.no_grad():
        true_overlap = paired_iou(in_plan(_boxes(predicted, middle)), in_plan(target)).to(predicted.dtype)
    overlap = functional.binary_cross_entropy_with_logits(predicted[:, OVERLAP], true_overlap, reduction="none")
    return {
        "offset": 2.0 * weighted_mean((predicted[:, OFFSET] - (target[:, :3] - middle)).abs().sum(1), weight),
        "size": 2.0 * weighted_mean((predicted[:, SIZE] - size).abs().sum(1), weight),
        "axis": 2.0 * weighted_mean((predicted[:, AXIS] - axis).abs().sum(1), weight),
        "ahead": 0.2 * weighted_mean(functional.softplus(-(predicted[:, HEADING] * ahead).sum(1)), weight),
        "overlap": 0.5 * weighted_mean(overlap, weight),
    }


def _boxes(predicted: Tensor, middle: Tensor) -> Tensor:
    """Return boxes (m, 7) from the channels (m, 11) of cells with their middles (m, 3)."""
    yaw = torch.atan2(predicted[:, 6], predicted[:, 7]) / 2
    ahead = predicted[:, 8] * torch.cos(yaw) + predicted[:, 9] * torch.sin(yaw)
    yaw = torch.where(ahead < 0, yaw + math.pi, yaw)
    yaw = torch.remainder(yaw + math.pi, 2 * math.pi) - math.pi
    size = torch.exp(predicted[:, SIZE].clamp(-3.0, 3.0)) * predicted.new_tensor(TYPICAL_SIZE)
    return torch.cat((middle + predicted[:, OFFSET], size, yaw[:, None]), dim=1)


def cell_bottoms(grid: PillarGrid, row: Tensor, column: Tensor) -> Tensor:
    """Return the middles (m, 3) of cells, at the bottom of the grid."""
    x, y = cell_middles(grid, OUTPUT_STRIDE, row.device)
    return torch.stack((x[column], y[row], torch.full_like(x[column], grid.bottom)), dim=1)


def _target(wanted: TrainingTargets, grid: PillarGrid, device: torch.device) -> tuple[Tensor, Tensor]:
    """Return the heat (classes, rows, columns) of a cloud and whose box each cell learns (rows, columns), or -1."""
    learnt = torch.nonzero(wanted.learnt)[:, 0]
    category = wanted.category[learnt]
    heat = torch.stack(
        [heat_of(wanted.boxes[learnt[category == number]], grid, device)[0] for number in range(len(CLASSES))]
    )
    most, owner = heat_of(wanted.boxes[learnt], grid, device)
    if len(learnt) == 0:
        return heat, torch.full_like(owner, -1)
    return heat, torch.where(most >= MIN_HEAT, learnt[owner], -1)


def heat_of(boxes: Tensor, grid: PillarGrid, device: torch.device) -> tuple[Tensor, Tensor]:
    """Return the most heat of any box in each cell (rows, columns), 1 in cells that hold a centre, and of which box."""
    x, y = cell_middles(grid, OUTPUT_STRIDE, device)
    if len(boxes) == 0:
        nothing = torch.zeros((len(y), len(x)), device=device)
        return nothing, nothing.long()
    side = grid.pillar * OUTPUT_STRIDE
    dx, dy = x - boxes[:, 0, None], y - boxes[:, 1, None]  # (k, columns), (k, rows)
    cosine, sine = torch.cos(boxes[:, 6])[:, None, None], torch.sin(boxes[:, 6])[:, None, None]
    along = cosine * dx[:, None, :] + sine * dy[:, :, None]
    across = cosine * dy[:, :, None] - sine * dx[:, None, :]
    # No narrower than lets the cells about a pedestrian's have some.
    spread = (HEAT_STD * boxes[:, 3:5]).clamp(min=0.6 * side)[:, :, None, None]
    heat = torch.exp(-0.5 * ((along / spread[:, 0]).square() + (across / spread[:, 1]).square()))
    centre = (dx.abs() <= side / 2)[:, None, :] & (dy.abs() <= side / 2)[:, :, None]
    heat = torch.where(centre, torch.ones_like(heat), heat)
    most, owner = heat.max(dim=0)
    return most, owner
