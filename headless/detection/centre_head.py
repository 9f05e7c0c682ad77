"""Anchor-free detection head: a heat map of centres for each class, and a box in each cell.

After T. Yin, X. Zhou, P. Krähenbühl: Center-based 3D Object Detection and
Tracking. CVPR 2021, with three changes for few training steps on sparse clouds:

- the target heat is a Gaussian aligned with the box and in proportion to its
  length and width; all cells with enough heat learn the box, weighted by heat;
- yaw is regressed as (sin 2θ, cos 2θ), which is the same for a box rotated by
  180 degrees, so that confusing front and back does not affect the box; a
  heading vector, whose sign alone matters, tells front and back apart;
- a channel predicts the IoU of the box with the true one. It is part of the
  score, so that suppression keeps the best placed boxes.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from .network import OUTPUT_STRIDE, convolution
from .pillars import PillarGrid
from .rotated_boxes import paired_iou
from .settings import CLASSES

# Channels of a box, after those of the heat maps.
OFFSET, SIZE, AXIS, HEADING, OVERLAP = slice(0, 3), slice(3, 6), slice(6, 8), slice(8, 10), 10
BOX_CHANNELS = 11

TYPICAL_SIZE = (4.5, 1.8, 1.6)
"""Length, width and height in metres, to which sizes are predicted as log ratios."""

HEAT_STD = 0.18  # standard deviation of heat along and across a box, as a share of its length and width
MIN_HEAT = 0.2  # least heat of a cell that learns the box
INITIAL_HEAT = 0.01  # predicted heat of every cell before training
MAX_PEAKS = 500  # most peaks of a cloud that go into suppression, those of the highest heat
OVERLAP_POWER = 0.5  # exponent p of the predicted overlap in the score heat^(1 − p) · overlap^p


def heat_map_loss(logits: Tensor, heat: Tensor, counted: Tensor) -> Tensor:
    r"""Return the focal loss of a heat map whose peaks are 1, for each peak (Law and Deng 2018, α = 2, β = 4).

    .. math:: -\frac1N \sum_c \begin{cases} (1 - p_c)^2 \log p_c & h_c = 1 \\
              (1 - h_c)^4 p_c^2 \log(1 - p_c) & \text{otherwise} \end{cases}

    Parameters
    ----------
    logits, heat : Tensor of the same shape
        What was predicted, before the sigmoid, and what is true, 0 to 1.
    counted : bool Tensor that spreads to that shape
        Cells that take part.
    """
    peak = (heat == 1.0) & counted
    share = torch.sigmoid(logits)
    hit = (1 - share).square() * functional.softplus(-logits)
    false = (1 - heat).pow(4) * share.square() * functional.softplus(logits)
    whole = torch.where(peak, hit, false) * counted
    return whole.sum() / peak.sum().clamp(min=1)


def weighted_mean(values: Tensor, weight: Tensor) -> Tensor:
    """Return Σ weight · value / Σ weight; zero where nothing weighs."""
    return (values * weight).sum() / weight.sum().clamp(min=1e-6)


@dataclass(frozen=True, eq=False)
class TrainingTargets:
    """The road users in one cloud; k boxes.

    Parameters
    ----------
    boxes : (k, 7) float32 Tensor
        As in `frame_results.Detections`.
    category : (k,) int64 Tensor
    learnable : (k,) bool Tensor
        Whether it has enough points to learn from; cells near the others are left out of the loss.
    """

    boxes: Tensor
    category: Tensor
    learnable: Tensor


class CentreHead(nn.Module):
    """Heat maps and boxes from a feature map.

    Parameters
    ----------
    channels : int
        Channels of the feature map.
    width : int
        Channels of the hidden layer.
    """

    def __init__(self, channels: int, width: int) -> None:
        super().__init__()
        self.heat = _branch(channels, width, len(CLASSES), math.log(INITIAL_HEAT / (1 - INITIAL_HEAT)))
        self.box = _branch(channels, width, BOX_CHANNELS, 0.0)

    def forward(self, features: Tensor) -> Tensor:
        """Return the logits of heat for each class, and the box channels: (b, classes + 11, rows, columns)."""
        return torch.cat([branch(features) for branch in self.branches], dim=1)

    @property
    def branches(self) -> tuple[nn.Sequential, ...]:
        """Networks side by side whose outputs are those of the head, in order.

        Each is one 3 × 3 convolution with batch normalisation and ReLU, then one of 1 × 1.
        """
        return self.heat, self.box

    @staticmethod
    def target_maps(targets: list[TrainingTargets], grid: PillarGrid, margin: float) -> dict[str, Tensor]:
        """Return heat, cells that count, and cells that learn a box, by name; they depend on no weight.

        Parameters
        ----------
        targets : list of b TrainingTargets
            In the coordinates of the grid.
        margin : float, metres
            Width of a border that the loss ignores: it shows only parts of objects beyond it.

        Returns
        -------
        dict of str to Tensor
            Of each cell (b, …, rows, columns): its heat, and whether it counts in the loss. Of the m that learn a box:
            their indices (dimensions, m), the boxes (m, 7), metres and radians, and their weights (m,).
        """
        device = targets[0].boxes.device
        heat, owner = (
            torch.stack(part) for part in zip(*(_target_maps(wanted, grid, device) for wanted in targets), strict=True)
        )
        # Cells near road users with too few points take no part: a detection there should be neither rewarded nor
        # punished. Cells near the window's border do not either, as they see only parts of road users.
        ignored = torch.stack([heat_of(wanted.boxes[~wanted.learnable], grid, device)[0] for wanted in targets])
        counted = (ignored < MIN_HEAT) & _inner_cells(grid, margin, device)
        cell = torch.stack(torch.nonzero((owner >= 0) & counted, as_tuple=True))
        cloud, row, column = cell
        return {
            "heat": heat,
            "counted": counted,
            "cell": cell,
            "box": _matched_boxes(targets, cloud, owner[cloud, row, column]),
            "weight": heat.amax(dim=1)[cloud, row, column],
        }

    def loss(self, output: Tensor, maps: Mapping[str, Tensor], grid: PillarGrid) -> dict[str, Tensor]:
        """Return the weighted terms of the loss; training minimises their sum.

        Parameters
        ----------
        output : (b, channels, rows, columns) Tensor
            What the head returns.
        maps : mapping of str to Tensor
            Result of `target_maps`, on the device of the output.
        """
        heat_loss = heat_map_loss(output[:, : len(CLASSES)], maps["heat"], maps["counted"][:, None])
        cloud, row, column = maps["cell"]
        predicted = output[:, len(CLASSES) :].permute(0, 2, 3, 1)[cloud, row, column]
        reference = reference_points(grid, row, column)
        return {"heat": heat_loss, **box_losses(predicted, maps["box"], reference, maps["weight"])}

    def candidates(self, output: Tensor, grid: PillarGrid, least_score: float) -> tuple[Tensor, Tensor, Tensor]:
        """Return a box for each peak of heat in one cloud whose heat is not below ``least_score``; they may overlap.

        Parameters
        ----------
        output : (1, channels, rows, columns) Tensor
            What the head returns.

        Returns
        -------
        boxes : (k, 7) float32 Tensor
        score : (k,) float32 Tensor
        category : (k,) int64 Tensor
        """
        heat = torch.sigmoid(output[:, : len(CLASSES)])
        # A cell is a peak if it equals the maximum of its 3 × 3 neighbourhood. This removes most of the many boxes of
        # one road user before suppression, which is quadratic in their number.
        heat = (heat * (heat == functional.max_pool2d(heat, 3, 1, 1)))[0]
        category, row, column = torch.nonzero(heat >= least_score, as_tuple=True)
        best = torch.sort(heat[category, row, column], descending=True, stable=True).indices[:MAX_PEAKS]
        category, row, column = category[best], row[best], column[best]
        predicted = output[0, len(CLASSES) :, row, column].T
        overlap = torch.sigmoid(predicted[:, OVERLAP])
        # Geometric mean: heat tells whether there is a road user, the predicted IoU how well this box fits it.
        score = heat[category, row, column].pow(1 - OVERLAP_POWER) * overlap.pow(OVERLAP_POWER)
        return _boxes(predicted, reference_points(grid, row, column)), score, category


def _branch(channels: int, width: int, outputs: int, bias: float) -> nn.Sequential:
    """Return a hidden layer and an output layer with the initial bias."""
    last = nn.Conv2d(width, outputs, 1)
    last.bias = nn.Parameter(torch.full((outputs,), bias))
    return nn.Sequential(convolution(channels, width), last)


def box_losses(predicted: Tensor, target: Tensor, reference: Tensor, weight: Tensor) -> dict[str, Tensor]:
    """Return the weighted losses of predicted channels (m, 11) at reference points (m, 3) against boxes (m, 7)."""
    yaw = target[:, 6]
    axis = torch.stack((torch.sin(2 * yaw), torch.cos(2 * yaw)), dim=1)
    heading = torch.stack((torch.cos(yaw), torch.sin(yaw)), dim=1)
    size = torch.log(target[:, 3:6] / target.new_tensor(TYPICAL_SIZE))
    # The IoU of the current boxes is the target of the overlap channel. Without no_grad its gradient would flow into
    # the boxes, and they could lower this loss by becoming worse.
    with torch.no_grad():
        true_overlap = paired_iou(_boxes(predicted, reference), target).to(predicted.dtype)
    overlap = functional.binary_cross_entropy_with_logits(predicted[:, OVERLAP], true_overlap, reduction="none")
    return {
        "offset": 2.0 * weighted_mean((predicted[:, OFFSET] - (target[:, :3] - reference)).abs().sum(1), weight),
        "size": 2.0 * weighted_mean((predicted[:, SIZE] - size).abs().sum(1), weight),
        "axis": 2.0 * weighted_mean((predicted[:, AXIS] - axis).abs().sum(1), weight),
        "ahead": 0.2 * weighted_mean(functional.softplus(-(predicted[:, HEADING] * heading).sum(1)), weight),
        "overlap": 0.5 * weighted_mean(overlap, weight),
    }


def _boxes(predicted: Tensor, reference: Tensor) -> Tensor:
    """Return the boxes (m, 7) of predicted channels (m, 11) at reference points (m, 3)."""
    (sine, cosine), (ahead_x, ahead_y) = predicted[:, AXIS].T, predicted[:, HEADING].T
    # Half of the angle of (cos 2θ, sin 2θ) gives the axis of the box, in (−π/2, π/2]. The heading vector chooses
    # between the axis and its opposite; its length does not matter.
    yaw = torch.atan2(sine, cosine) / 2
    yaw = torch.where(ahead_x * torch.cos(yaw) + ahead_y * torch.sin(yaw) < 0, yaw + math.pi, yaw)
    yaw = torch.remainder(yaw + math.pi, 2 * math.pi) - math.pi
    size = torch.exp(predicted[:, SIZE].clamp(-3.0, 3.0)) * predicted.new_tensor(TYPICAL_SIZE)
    return torch.cat((reference + predicted[:, OFFSET], size, yaw[:, None]), dim=1)


def reference_points(grid: PillarGrid, row: Tensor, column: Tensor) -> Tensor:
    """Return the points (m, 3) from which offsets are regressed: the cells' centres, at the bottom of the grid."""
    x, y = _cell_centres(grid, row.device)
    return torch.stack((x[column], y[row], torch.full_like(x[column], grid.bottom)), dim=1)


def _target_maps(wanted: TrainingTargets, grid: PillarGrid, device: torch.device) -> tuple[Tensor, Tensor]:
    """Return the target heat (classes, rows, columns) and the index of the box that each cell learns, -1 for none."""
    learnable = torch.nonzero(wanted.learnable)[:, 0]
    category = wanted.category[learnable]
    heat = torch.stack(
        [heat_of(wanted.boxes[learnable[category == number]], grid, device)[0] for number in range(len(CLASSES))]
    )
    # Heat is separate for each class, but a cell learns one box: that with the most heat there, of any class.
    most, owner = heat_of(wanted.boxes[learnable], grid, device)
    if len(learnable) == 0:
        return heat, torch.full_like(owner, -1)
    return heat, torch.where(most >= MIN_HEAT, learnable[owner], -1)


def heat_of(boxes: Tensor, grid: PillarGrid, device: torch.device) -> tuple[Tensor, Tensor]:
    """Return the greatest heat in each cell (rows, columns), 1 where a box has its centre, and that box's index."""
    x, y = _cell_centres(grid, device)
    if len(boxes) == 0:
        nothing = torch.zeros((len(y), len(x)), device=device)
        return nothing, nothing.long()
    side = grid.pillar * OUTPUT_STRIDE
    dx, dy = x - boxes[:, 0, None], y - boxes[:, 1, None]  # (k, columns), (k, rows)
    cosine, sine = torch.cos(boxes[:, 6])[:, None, None], torch.sin(boxes[:, 6])[:, None, None]
    along = cosine * dx[:, None, :] + sine * dy[:, :, None]
    across = cosine * dy[:, :, None] - sine * dx[:, None, :]
    # At least 0.6 cells, so that the cells around a pedestrian's get heat as well.
    spread = (HEAT_STD * boxes[:, 3:5]).clamp(min=0.6 * side)[:, :, None, None]
    heat = torch.exp(-0.5 * ((along / spread[:, 0]).square() + (across / spread[:, 1]).square()))
    # The cell that contains a centre gets heat 1 exactly: the heat map loss counts only cells of heat 1 as positive,
    # and a Gaussian sampled at cell centres would hardly ever reach it.
    centre = (dx.abs() <= side / 2)[:, None, :] & (dy.abs() <= side / 2)[:, :, None]
    heat = torch.where(centre, torch.ones_like(heat), heat)
    most, owner = heat.max(dim=0)
    return most, owner


def _matched_boxes(targets: list[TrainingTargets], cloud: Tensor, index: Tensor) -> Tensor:
    """Return the boxes (m, 7) at indices (m,) of clouds (m,)."""
    first = torch.tensor([0, *(len(part.boxes) for part in targets)]).cumsum(0)[:-1].to(cloud.device)
    return torch.cat([part.boxes for part in targets])[first[cloud] + index]


def _cell_centres(grid: PillarGrid, device: torch.device) -> tuple[Tensor, Tensor]:
    """Return x (columns,) and y (rows,) of the centres of the cells of a feature map, metres."""
    side = grid.pillar * OUTPUT_STRIDE
    x = grid.west + side * (torch.arange(grid.columns // OUTPUT_STRIDE, device=device) + 0.5)
    y = grid.south + side * (torch.arange(grid.rows // OUTPUT_STRIDE, device=device) + 0.5)
    return x, y


def _inner_cells(grid: PillarGrid, margin: float, device: torch.device) -> Tensor:
    """Return which cells (rows, columns) of a feature map are ``margin`` or more from the border."""
    x, y = _cell_centres(grid, device)
    wide, deep = grid.columns * grid.pillar, grid.rows * grid.pillar
    across = (x - grid.west >= margin) & (x - grid.west <= wide - margin)
    along = (y - grid.south >= margin) & (y - grid.south <= deep - margin)
    return along[:, None] & across
