"""IoU of rotated boxes, vectorised over pairs, and non-maximum suppression.

The overlap in plan is found in the second box's own frame, where it is a rectangle about the origin. The first box's
outline, moved point by point to the nearest point of that rectangle, winds around just the points that both boxes hold:
its area is the overlap. That is what polygon clipping after Sutherland and Hodgman (1974) computes, without vertices
that come and go, so it needs no tolerance and parallel or shared edges are nothing special.
"""

import numpy as np
import torch
from torch import Tensor

CORNERS = ((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5))  # of a unit square, counter-clockwise
PAIRS_AT_ONCE = 2000  # pairs that stay in a core's cache; in threads, small steps like these take ten times as long


def paired_iou(a: Tensor, b: Tensor, *, in_space: bool = False) -> Tensor:
    """Return the intersection over union of each pair of upright boxes, in plan or in space.

    Parameters
    ----------
    a, b : (n, 7) Tensor
        x, y, z of the middle, length, width, height (metres), yaw (radians, counter-clockwise).

    Returns
    -------
    (n,) float64 Tensor
        Zero for two boxes without area, or without volume.
    """
    a, b = a.double(), b.double()
    parts = zip(torch.split(a, PAIRS_AT_ONCE), torch.split(b, PAIRS_AT_ONCE), strict=True)
    shared, size = torch.cat([_overlap(*part) for part in parts]), slice(3, 5)
    if in_space:
        top = torch.minimum(a[:, 2] + a[:, 5] / 2, b[:, 2] + b[:, 5] / 2)
        bottom = torch.maximum(a[:, 2] - a[:, 5] / 2, b[:, 2] - b[:, 5] / 2)
        shared, size = shared * (top - bottom).clamp(min=0), slice(3, 6)
    whole = a[:, size].prod(dim=1) + b[:, size].prod(dim=1) - shared
    return torch.where(whole > 0, shared / torch.where(whole > 0, whole, 1.0), 0.0)


def iou_matrix(a: Tensor, b: Tensor, *, in_space: bool = False) -> Tensor:
    """Return the (n, m) intersections over union of (n, 7) and (m, 7) boxes; see `paired_iou`."""
    a, b = a.double(), b.double()
    # only boxes whose circles about the corners meet can overlap
    reach = torch.hypot(a[:, 3], a[:, 4])[:, None] + torch.hypot(b[:, 3], b[:, 4])
    apart = torch.hypot(a[:, None, 0] - b[:, 0], a[:, None, 1] - b[:, 1])
    i, j = torch.nonzero(2 * apart < reach, as_tuple=True)
    matrix = a.new_zeros((len(a), len(b)))
    matrix[i, j] = paired_iou(a[i], b[j], in_space=in_space)
    return matrix


def suppress(boxes: Tensor, scores: Tensor, threshold: float) -> Tensor:
    """Return which boxes stay when each, best first, removes those that overlap it.

    Parameters
    ----------
    boxes : (n, 7) Tensor
        As in `paired_iou`; their overlap in plan counts.
    scores : (n,) Tensor
        Among equal scores the earlier box has priority.
    threshold : float
        Intersection over union above which a box is removed.

    Returns
    -------
    (k,) int64 Tensor
        Indices, best first.
    """
    # All overlaps are computed at once, so the loop only combines rows of a matrix. A box that was removed does not
    # remove others.
    order = torch.sort(scores, descending=True, stable=True).indices
    overlaps = (iou_matrix(boxes[order], boxes[order]) > threshold).cpu().numpy()
    stays = np.ones(len(order), dtype=np.bool_)
    for rank in range(len(order)):
        if stays[rank]:
            stays[rank + 1 :] &= ~overlaps[rank, rank + 1 :]
    return order[torch.from_numpy(stays).to(order.device)]


def _overlap(a: Tensor, b: Tensor) -> Tensor:
    """Return the area in plan that each pair shares."""
    # Clamping x and y moves a point to the nearest point of the rectangle of b. Parts of the outline of a outside of it
    # move onto its border, where they run back and forth or around it, so that the enclosed area is the overlap.
    half_length, half_width = b[:, 3] / 2, b[:, 4] / 2
    x, y = _corners_seen_from(a, b)
    dx, dy = x.roll(-1, dims=0) - x, y.roll(-1, dims=0) - y
    # Along an edge the moved outline changes its y between two cuts alone, and bends in x at two more in between:
    # three straight pieces, on which trapezia are exact.
    first, last = _cuts(y, dy, half_width)
    bends = (cut.clamp(first, last) for cut in _cuts(x, dx, half_length))
    along = torch.stack((first, *bends, last))  # (4 cuts, 4 edges, n)
    # Area by Green's theorem, ∮ x dy: the mean x of each straight piece times its change of y.
    x = torch.clamp(x + along * dx, -half_length, half_length)
    y = torch.clamp(y + along * dy, -half_width, half_width)
    return ((x[1:] + x[:-1]) / 2 * y.diff(dim=0)).sum(dim=(0, 1)).clamp(min=0)


def _cuts(start: Tensor, step: Tensor, half: Tensor) -> tuple[Tensor, Tensor]:
    """Return where edges (4, n) enter and leave the strip between -half and half, as shares of the edge."""
    slope = torch.where(step == 0, 1.0, step)  # an edge along the strip may be cut anywhere: the cut moves nothing
    one, other = (-half - start) / slope, (half - start) / slope
    return torch.minimum(one, other).clamp(0, 1), torch.maximum(one, other).clamp(0, 1)


def _corners_seen_from(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    """Return x and y (4, n) of the corners of `a` in the frames of `b`."""
    east, north = _rotated(a[:, 0] - b[:, 0], a[:, 1] - b[:, 1], -b[:, 6])
    unit = torch.tensor(CORNERS, dtype=a.dtype, device=a.device)
    x, y = _rotated(unit[:, :1] * a[:, 3], unit[:, 1:] * a[:, 4], a[:, 6] - b[:, 6])
    return x + east, y + north


def _rotated(x: Tensor, y: Tensor, angle: Tensor) -> tuple[Tensor, Tensor]:
    """Turn points counter-clockwise about the origin."""
    cosine, sine = torch.cos(angle), torch.sin(angle)
    return cosine * x - sine * y, sine * x + cosine * y
