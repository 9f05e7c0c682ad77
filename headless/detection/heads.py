"""Interface of detection heads: training targets, decoded boxes and the feature map's cells."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor, nn

from .pillars import PillarGrid


@dataclass(frozen=True, eq=False)
class TrainingTargets:
    """The road users in one cloud; k boxes.

    Parameters
    ----------
    boxes : (k, 7) float32 Tensor
        As in `frame_results.Detections`.
    category : (k,) int64 Tensor
    learnable : (k,) bool Tensor
        Whether it has enough points to learn from; cells and anchors near the others are left out of the loss.
    """

    boxes: Tensor
    category: Tensor
    learnable: Tensor


@dataclass(frozen=True, eq=False)
class BoxProposals:
    """Boxes of one cloud before those that overlap better ones are removed; k boxes.

    Parameters
    ----------
    boxes : (k, 7) float32 Tensor
    score : (k,) float32 Tensor
    category : (k,) int64 Tensor
    """

    boxes: Tensor
    score: Tensor
    category: Tensor


class DetectionHead(Protocol):
    """Interface of detection heads, in addition to that of a torch module."""

    @property
    def branches(self) -> tuple[nn.Sequential, ...]:
        """Networks side by side whose outputs are those of the head, in order.

        Each is at most one 3 × 3 convolution with batch normalisation and ReLU, then one of 1 × 1.
        """

    @staticmethod
    def target_maps(targets: list[TrainingTargets], grid: PillarGrid, margin: float) -> dict[str, Tensor]:
        """Return the training targets of each cell, by name; they depend on no weight.

        Parameters
        ----------
        targets : list of b TrainingTargets
            In the coordinates of the grid.
        margin : float, metres
            Width of a border that the loss ignores: it shows only parts of objects beyond it.

        Returns
        -------
        dict of str to Tensor
            Of each cell or anchor (b, …, rows, columns): its target, and whether it counts in the loss. Of the m that
            learn a box: their indices (dimensions, m) and the boxes (m, 7), metres and radians.
        """

    def loss(self, output: Tensor, maps: Mapping[str, Tensor], grid: PillarGrid) -> dict[str, Tensor]:
        """Return the weighted terms of the loss; training minimises their sum.

        Parameters
        ----------
        output : (b, channels, rows, columns) Tensor
            What the head returns.
        maps : mapping of str to Tensor
            Result of `target_maps`, on the device of the output.
        """

    def candidates(self, output: Tensor, grid: PillarGrid, least_score: float) -> list[BoxProposals]:
        """Return the boxes of each cloud whose score is not below ``least_score``."""


def matched_boxes(targets: list[TrainingTargets], cloud: Tensor, index: Tensor) -> Tensor:
    """Return the boxes (m, 7) at indices (m,) of clouds (m,)."""
    first = torch.tensor([0, *(len(part.boxes) for part in targets)]).cumsum(0)[:-1].to(cloud.device)
    return torch.cat([part.boxes for part in targets])[first[cloud] + index]


def cell_centres(grid: PillarGrid, stride: int, device: torch.device) -> tuple[Tensor, Tensor]:
    """Return x (columns,) and y (rows,) of the centres of the cells of a feature map, metres."""
    side = grid.pillar * stride
    x = grid.west + side * (torch.arange(grid.columns // stride, device=device) + 0.5)
    y = grid.south + side * (torch.arange(grid.rows // stride, device=device) + 0.5)
    return x, y


def inner_cells(grid: PillarGrid, stride: int, margin: float, device: torch.device) -> Tensor:
    """Return which cells (rows, columns) of a feature map are ``margin`` or more from the border."""
    x, y = cell_centres(grid, stride, device)
    wide, deep = grid.columns * grid.pillar, grid.rows * grid.pillar
    across = (x - grid.west >= margin) & (x - grid.west <= wide - margin)
    along = (y - grid.south >= margin) & (y - grid.south <= deep - margin)
    return along[:, None] & across
