"""Anchor-based detection head as published: anchors at 0 and 90 degrees in each cell, and their targets.

After A. H. Lang et al.: PointPillars. CVPR 2019, and Y. Yan, Y. Mao, B. Li:
SECOND: Sparsely Embedded Convolutional Detection. Sensors 18 (2018).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from .heads import BoxProposals, TrainingTargets, cell_centres, inner_cells, matched_boxes
from .losses import focal_loss
from .network import OUTPUT_STRIDE
from .pillars import PillarGrid
from .settings import CLASSES

ANCHOR_CHANNELS = 10  # of an anchor: score, seven of its box, two of its direction
DIRECTION_FROM = math.pi / 4  # yaw at which the first of the two directions begins: no street along the axes runs there
SMOOTH_L1_BETA = 1 / 9  # where the smooth L1 loss turns from a square into a line
INITIAL_SCORE = 0.01  # score of every anchor before training
MAX_BOXES = 500  # boxes of a cloud before suppression, the best first


@dataclass(frozen=True)
class AnchorSize:
    """Anchor box, placed in every cell at 0 and at 90 degrees.

    Parameters
    ----------
    category : str
        One of `settings.CLASSES`.
    length, width, height : float, metres
    positive, negative : float
        Overlap from which an anchor must find a road user, and below which it must find none.
    """

    category: str
    length: float
    width: float
    height: float
    positive: float = 0.6
    negative: float = 0.45


ANCHOR_SIZES = (
    AnchorSize("car", 4.5, 1.8, 1.6),
    AnchorSize("car", 5.8, 2.0, 2.4),
    AnchorSize("truck", 8.0, 2.5, 3.3),
    AnchorSize("truck", 12.0, 2.55, 3.2),
    AnchorSize("cycle", 1.9, 0.7, 1.7, positive=0.5, negative=0.35),
    AnchorSize("pedestrian", 0.6, 0.6, 1.75, positive=0.5, negative=0.35),
)
ANCHOR_YAWS = (0.0, math.pi / 2)


class AnchorHead(nn.Module):
    """Scores, boxes and directions of all anchors from a feature map.

    Parameters
    ----------
    channels : int
        Channels of the feature map.
    """

    def __init__(self, channels: int) -> None:
        super().__init__()
        anchors = len(ANCHOR_SIZES) * len(ANCHOR_YAWS)
        self.final = nn.Conv2d(channels, anchors * ANCHOR_CHANNELS, 1)
        start = torch.zeros(anchors, ANCHOR_CHANNELS)
        start[:, 0] = math.log(INITIAL_SCORE / (1 - INITIAL_SCORE))
        nn.init.normal_(self.final.weight, std=0.01)
        self.final.bias = nn.Parameter(start.flatten())

    def forward(self, features: Tensor) -> Tensor:
        """Return (b, anchors · 10, rows, columns): anchor after anchor its score, box and direction."""
        output: Tensor = self.final(features)
        return output

    @property
    def branches(self) -> tuple[nn.Sequential, ...]:
        """Networks side by side that make the output; see `heads.DetectionHead`."""
        return (nn.Sequential(self.final),)

    @staticmethod
    def target_maps(targets: list[TrainingTargets], grid: PillarGrid, margin: float) -> dict[str, Tensor]:
        """Return the anchors that count, and those that must find a box; see `heads.DetectionHead`."""
        assigned = torch.stack([assignment(wanted, grid) for wanted in targets])
        counted = (assigned != IGNORED) & inner_cells(grid, OUTPUT_STRIDE, margin, assigned.device)
        positive = (assigned >= 0) & counted
        place = torch.stack(torch.nonzero(positive, as_tuple=True))
        cloud, anchor, row, column = place
        box = matched_boxes(targets, cloud, assigned[cloud, anchor, row, column])
        return {"positive": positive, "counted": counted, "place": place, "box": box}

    def loss(self, output: Tensor, maps: Mapping[str, Tensor], grid: PillarGrid) -> dict[str, Tensor]:
        """Return the parts of the loss; see `heads.DetectionHead`."""
        predicted = _by_anchor(output)
        score = focal_loss(predicted[..., 0], maps["positive"], maps["counted"])
        cloud, anchor, row, column = maps["place"]
        target = maps["box"]
        found = predicted[cloud, anchor, row, column]
        count = max(1, len(found))
        wanted = encoded(target, anchor_boxes(grid, anchor, row, column))
        # The sine of the difference of the angles is zero for a box rotated by 180 degrees, too (SECOND): the box loss
        # does not depend on front and back, which the direction classifier learns.
        turn = torch.sin(found[:, 7] - wanted[:, 6])
        error = torch.cat((found[:, 1:7] - wanted[:, :6], turn[:, None]), dim=1)
        box = functional.smooth_l1_loss(error, torch.zeros_like(error), beta=SMOOTH_L1_BETA, reduction="sum") / count
        direction = functional.cross_entropy(found[:, 8:], direction_of(target[:, 6]), reduction="sum") / count
        return {"score": score, "box": 2.0 * box, "direction": 0.2 * direction}

    def candidates(self, output: Tensor, grid: PillarGrid, least_score: float) -> list[BoxProposals]:
        """Return the boxes that anchors have become; see `heads.DetectionHead`."""
        found = []
        for cloud in _by_anchor(output):
            scores = torch.sigmoid(cloud[..., 0])
            anchor, row, column = torch.nonzero(scores >= least_score, as_tuple=True)
            score = scores[anchor, row, column]
            best = torch.sort(score, descending=True, stable=True).indices[:MAX_BOXES]
            anchor, row, column = anchor[best], row[best], column[best]
            predicted = cloud[anchor, row, column]
            boxes = decoded(predicted[:, 1:], anchor_boxes(grid, anchor, row, column))
            category = _categories(output.device)[anchor]
            found.append(BoxProposals(boxes, score[best], category))
        return found


BACKGROUND, IGNORED = -1, -2  # of an anchor that must find no road user, and of one left out of the loss


def assignment(wanted: TrainingTargets, grid: PillarGrid) -> Tensor:
    """Return which box each anchor must find: (anchors, rows, columns) int64, or `BACKGROUND` or `IGNORED`.

    An anchor belongs to the road user of its class that overlaps it most, both set along the nearer axis, if that is
    its ``positive`` share or more. The anchor that overlaps a road user most belongs to it in any case.
    """
    device = wanted.boxes.device
    overlap = _overlaps(wanted, grid)  # (boxes, anchors, rows, columns)
    positive, negative = (
        torch.tensor([getattr(size, name) for size in ANCHOR_SIZES for _ in ANCHOR_YAWS], device=device)[:, None, None]
        for name in ("positive", "negative")
    )
    shape = overlap.shape[1:]
    if len(overlap) == 0:
        return torch.full(shape, BACKGROUND, device=device)
    learnable = torch.nonzero(wanted.learnable)[:, 0]
    # Anchors between the two thresholds are left out of the loss. The test includes road users with too few points:
    # anchors on these are left out, too, instead of being trained as background.
    unclear = (overlap >= negative).any(dim=0)
    assigned = torch.where(unclear, IGNORED, BACKGROUND)
    if len(learnable) == 0:
        return assigned
    most, owner = overlap[learnable].max(dim=0)
    assigned = torch.where(most >= positive, learnable[owner], assigned)
    # A road user that no anchor overlaps by `positive` (small, or between cells) would have no anchor: its best one is
    # assigned in any case.
    peak, place = overlap[learnable].flatten(1).max(dim=1)
    flat = assigned.flatten()
    # Where one anchor is the best of two road users the later keeps it, on every machine.
    for box, index, value in zip(learnable.tolist(), place.tolist(), peak.tolist(), strict=True):
        if value > 0:
            flat[index] = box
    return flat.view(shape)


def anchor_boxes(grid: PillarGrid, anchor: Tensor, row: Tensor, column: Tensor) -> Tensor:
    """Return the boxes (m, 7) of anchors given by number, row and column."""
    x, y = cell_centres(grid, OUTPUT_STRIDE, anchor.device)
    sizes = torch.tensor([(s.length, s.width, s.height) for s in ANCHOR_SIZES], device=anchor.device)
    size = sizes[anchor // len(ANCHOR_YAWS)]
    yaw = torch.tensor(ANCHOR_YAWS, device=anchor.device)[anchor % len(ANCHOR_YAWS)]
    z = size[:, 2] / 2
    return torch.cat((torch.stack((x[column], y[row], z), dim=1), size, yaw[:, None]), dim=1)


def encoded(boxes: Tensor, anchors: Tensor) -> Tensor:
    """Return what anchors must predict to become boxes, all (m, 7)."""
    # Offsets in units of the anchor's diagonal and height, and logarithms of the ratios of sizes: errors of large and
    # small road users have the same magnitude in the loss (SECOND).
    diagonal = torch.hypot(anchors[:, 3], anchors[:, 4])[:, None]
    return torch.cat(
        (
            (boxes[:, :2] - anchors[:, :2]) / diagonal,
            (boxes[:, 2:3] - anchors[:, 2:3]) / anchors[:, 5:6],
            torch.log(boxes[:, 3:6] / anchors[:, 3:6]),
            (boxes[:, 6] - anchors[:, 6])[:, None],
        ),
        dim=1,
    )


def decoded(predicted: Tensor, anchors: Tensor) -> Tensor:
    """Return the boxes (m, 7) that anchors have become by what they predict, (m, 9) with two for the direction."""
    diagonal = torch.hypot(anchors[:, 3], anchors[:, 4])[:, None]
    direction = predicted[:, 7:].argmax(dim=1)
    # The predicted yaw is known modulo 180 degrees: it is brought into the half circle from `DIRECTION_FROM` on, and
    # the direction class adds the other half. Then it is wrapped to [−π, π).
    yaw = torch.remainder(predicted[:, 6] + anchors[:, 6] - DIRECTION_FROM, math.pi)
    yaw = yaw + DIRECTION_FROM + math.pi * direction
    yaw = torch.remainder(yaw + math.pi, 2 * math.pi) - math.pi
    return torch.cat(
        (
            predicted[:, :2] * diagonal + anchors[:, :2],
            predicted[:, 2:3] * anchors[:, 5:6] + anchors[:, 2:3],
            torch.exp(predicted[:, 3:6].clamp(-3.0, 3.0)) * anchors[:, 3:6],
            yaw[:, None],
        ),
        dim=1,
    )


def direction_of(yaw: Tensor) -> Tensor:
    """Return which half of the circle yaws (m,) are in: 0 from `DIRECTION_FROM` on, 1 after half a turn."""
    return (torch.remainder(yaw - DIRECTION_FROM, 2 * math.pi) >= math.pi).long()


def _overlaps(wanted: TrainingTargets, grid: PillarGrid) -> Tensor:
    """Return the overlaps (boxes, anchors, rows, columns) of anchors set along the axes; 0 across classes."""
    boxes = wanted.boxes
    x, y = cell_centres(grid, OUTPUT_STRIDE, boxes.device)
    # With boxes aligned to the nearer axis, the shared area is a product of a length in x and one in y. It takes
    # (boxes × columns) and (boxes × rows) values instead of rotated IoUs of all boxes with all anchors.
    across = torch.sin(boxes[:, 6]).abs() > math.sqrt(0.5)
    wide = torch.where(across, boxes[:, 4], boxes[:, 3])
    deep = torch.where(across, boxes[:, 3], boxes[:, 4])
    category = _categories(boxes.device)
    layers = []
    for number, size in enumerate(ANCHOR_SIZES):
        for turn in range(len(ANCHOR_YAWS)):
            sides = (size.length, size.width) if turn == 0 else (size.width, size.length)
            shared_x = _shared(x, sides[0], boxes[:, 0], wide)
            shared_y = _shared(y, sides[1], boxes[:, 1], deep)
            shared = shared_x[:, None, :] * shared_y[:, :, None]
            whole = (wide * deep + size.length * size.width)[:, None, None] - shared
            same = (wanted.category == category[len(ANCHOR_YAWS) * number + turn])[:, None, None]
            layers.append(shared / whole * same)
    return torch.stack(layers, dim=1)


def _shared(middles: Tensor, side: float, centre: Tensor, extent: Tensor) -> Tensor:
    """Return the lengths (boxes, cells) that intervals about the cells' middles share with the boxes'."""
    low = torch.maximum(middles - side / 2, (centre - extent / 2)[:, None])
    high = torch.minimum(middles + side / 2, (centre + extent / 2)[:, None])
    return (high - low).clamp(min=0)


def _categories(device: torch.device) -> Tensor:
    return torch.tensor([CLASSES.index(size.category) for size in ANCHOR_SIZES for _ in ANCHOR_YAWS], device=device)


def _by_anchor(output: Tensor) -> Tensor:
    """Return the output as (b, anchors, rows, columns, 10)."""
    clouds, _, rows, columns = output.shape
    return output.view(clouds, -1, ANCHOR_CHANNELS, rows, columns).permute(0, 1, 3, 4, 2)
