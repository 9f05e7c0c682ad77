"""Placement of labels without overlaps."""

import numpy as np

from ..arrays import Float

Bounds = tuple[float, float, float, float]

LABEL_DIRECTIONS = 16
LABEL_DISTANCES = (1.0, 1.6, 2.3, 3.2, 4.4, 6.0)  # how far out a label is tried, in multiples of the nearest
DISTANCE_COSTS = 0.35 * np.repeat(np.array(LABEL_DISTANCES) - 1.0, LABEL_DIRECTIONS)
"""What distance costs, where hiding as much of the subject as any place would costs 1."""


def place_callouts(anchors: Float, sizes: Float, bounds: Bounds, clearance: float, subject: Float) -> Float:
    """Return the centre of each label's box, (k, 2) float64.

    Labels are set one after the other without leaving the picture or touching an anchor or an earlier label: near their
    anchors, off the subject of the picture, and outwards from the middle of all anchors. A label for which there is no
    room goes to the nearest place inside the picture.

    Parameters
    ----------
    anchors : (k, 2) float64
        The points that the labels belong to.
    sizes : (k, 2) float64
        Widths and heights of the labels.
    bounds : (left, bottom, right, top)
        Of the picture, in the unit of the anchors.
    clearance : float
        To keep between a label and everything else.
    subject : (m, 2) float64
        Evenly spread points of what labels had better not hide.
    """
    low, high = np.array(bounds[:2]), np.array(bounds[2:])
    taken_low = anchors - clearance
    taken_high = anchors + clearance
    centres = np.empty_like(anchors)
    middle = anchors.mean(axis=0) if len(anchors) else anchors
    for index, (anchor, size) in enumerate(zip(anchors, sizes, strict=True)):
        half = size / 2.0
        tried = _places(anchor, half + 2.0 * clearance, anchor - middle)
        tried_low, tried_high = tried - half, tried + half
        inside = np.all((tried_low >= low) & (tried_high <= high), axis=1)
        apart = np.any(
            (tried_low[:, None] - clearance >= taken_high) | (tried_high[:, None] + clearance <= taken_low), axis=2
        ).all(axis=1)
        cost = np.where(inside & apart, _hidden(tried_low, tried_high, subject) + DISTANCE_COSTS, np.inf)
        best = int(np.argmin(cost))
        centre = tried[best] if np.isfinite(cost[best]) else np.clip(tried[0], low + half, high - half)
        centres[index] = centre
        taken_low = np.vstack((taken_low, centre - half))
        taken_high = np.vstack((taken_high, centre + half))
    return centres


def _places(anchor: Float, reach: Float, outwards: Float) -> Float:
    """Return centres round an anchor, nearest first, and at each distance those outwards first."""
    start = np.arctan2(outwards[1], outwards[0])
    turn = np.arange(LABEL_DIRECTIONS)
    angle = start + np.pi * 2.0 / LABEL_DIRECTIONS * ((turn + 1) // 2) * np.where(turn % 2, 1.0, -1.0)
    round_anchor = np.stack((np.cos(angle), np.sin(angle)), axis=1) * reach
    return np.concatenate([anchor + factor * round_anchor for factor in LABEL_DISTANCES])


def _hidden(low: Float, high: Float, subject: Float) -> Float:
    """Return how much of the subject each box hides, the most of them 1."""
    inside = np.all((subject > low[:, None]) & (subject < high[:, None]), axis=2).sum(axis=1)
    share: Float = inside / max(1, inside.max())
    return share
