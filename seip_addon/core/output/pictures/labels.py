"""Placement of labels without overlaps."""

import math

import numpy as np

from ...base.arrays import Boolean, Float

Bounds = tuple[float, float, float, float]

LABEL_DIRECTIONS = 16
LABEL_DISTANCES = (1.0, 1.6, 2.3, 3.2, 4.4, 6.0)  # how far out a label is tried, in multiples of the nearest
DISTANCE_COSTS = 0.35 * np.repeat(np.array(LABEL_DISTANCES) - 1.0, LABEL_DIRECTIONS)
"""What distance costs, where hiding as much of the subject as any place would costs 1."""


def place_callouts(  # what a label must keep off is of several kinds
    anchors: Float, sizes: Float, bounds: Bounds, clearance: float, subject: Float, taken: Float | None = None
) -> Float:
    """Return the centre of each label's box, (k, 2) float64.

    Labels are set one after the other without leaving the picture or touching an anchor or an earlier label: near their
    anchors, off the subject of the picture, and outwards from the middle of all anchors. Without room near its anchor a
    label goes to the nearest free place of the picture, and if none is free, as near as it can.

    Parameters
    ----------
    anchors, sizes : (k, 2) float64
        Points that the labels belong to, and widths and heights of the labels.
    bounds : (left, bottom, right, top)
        Bounds of the picture, in the unit of the anchors.
    clearance : float
        Distance between a label and everything else.
    subject : (m, 2) float64
        Evenly spread points that labels hide only if there is no other room.
    taken : (n, 4) float64, optional
        Left, bottom, right and top of boxes without labels.
    """
    low, high = np.array(bounds[:2]), np.array(bounds[2:])
    others = np.empty((0, 4)) if taken is None else taken.reshape(-1, 4)
    taken_low = np.vstack((anchors - clearance, others[:, :2]))
    taken_high = np.vstack((anchors + clearance, others[:, 2:]))
    centres = np.empty_like(anchors)
    middle = anchors.mean(axis=0) if len(anchors) else anchors
    for index, (anchor, size) in enumerate(zip(anchors, sizes, strict=True)):
        half = size / 2.0
        tried = _places(anchor, half + 2.0 * clearance, anchor - middle)
        inside = np.all((tried - half >= low) & (tried + half <= high), axis=1)
        free = inside & _is_apart(tried, half + clearance, taken_low, taken_high)
        within = (subject > (tried - half)[:, None]) & (subject < (tried + half)[:, None])
        hidden = np.all(within, axis=2).sum(axis=1)  # points of the subject; the most of all places cost 1
        cost = np.where(free, hidden / max(1, hidden.max()) + DISTANCE_COSTS, np.inf)
        best = int(np.argmin(cost))
        if np.isfinite(cost[best]):
            centre = tried[best]
        else:
            everywhere = _lattice(low + half, high - half, half)
            away = np.linalg.norm(everywhere - anchor, axis=1)
            away[~_is_apart(everywhere, half + clearance, taken_low, taken_high)] = np.inf
            nearest = int(np.argmin(away))
            fallback = np.clip(tried[0], low + half, high - half)
            centre = everywhere[nearest] if np.isfinite(away[nearest]) else fallback
        centres[index] = centre
        taken_low = np.vstack((taken_low, centre - half))
        taken_high = np.vstack((taken_high, centre + half))
    return centres


def stack_upwards(boxes: Float, gap: float, taken: Float | None = None) -> Float:
    """Return how far up each box must move so that none overlaps another, (k,) float64; the lowest stay.

    Boxes (k, 4) are left, bottom, width and height; between two there is a gap. Those in ``taken`` (n, 4) do not move.
    """
    fixed = np.empty((0, 4)) if taken is None else taken
    everything = np.concatenate((fixed, boxes))
    rise = np.zeros(len(everything))
    left, bottom, height = everything[:, 0], everything[:, 1], everything[:, 3]
    right = left + everything[:, 2]
    placed = list(range(len(fixed)))
    for one in (len(fixed) + np.argsort(boxes[:, 1], kind="stable")).tolist():
        beside = [other for other in placed if left[one] < right[other] and left[other] < right[one]]
        for other in sorted(beside, key=lambda other: bottom[other] + rise[other]):
            low, own = bottom[other] + rise[other], bottom[one] + rise[one]
            if low - gap < own + height[one] and own < low + height[other] + gap:
                rise[one] = low + height[other] + gap - bottom[one]
        placed.append(one)
    return rise[len(fixed) :]


def _is_apart(centres: Float, reach: Float, taken_low: Float, taken_high: Float) -> Boolean:
    """Return which boxes about centres (n, 2), of half sizes ``reach``, touch none of those that are there."""
    low, high = (centres - reach)[:, None], (centres + reach)[:, None]
    apart: Boolean = np.any((low >= taken_high) | (high <= taken_low), axis=2).all(axis=1)
    return apart


def _lattice(low: Float, high: Float, step: Float) -> Float:
    """Return points (n, 2) from one corner to another, at most a step apart."""
    x, y = (np.linspace(a, b, max(2, math.ceil((b - a) / s) + 1)) for a, b, s in zip(low, high, step, strict=True))
    points: Float = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return points


def _places(anchor: Float, reach: Float, outwards: Float) -> Float:
    """Return centres round an anchor, nearest first, and at each distance those outwards first."""
    start = np.arctan2(outwards[1], outwards[0])
    turn = np.arange(LABEL_DIRECTIONS)
    angle = start + np.pi * 2.0 / LABEL_DIRECTIONS * ((turn + 1) // 2) * np.where(turn % 2, 1.0, -1.0)
    round_anchor = np.stack((np.cos(angle), np.sin(angle)), axis=1) * reach
    return np.concatenate([anchor + factor * round_anchor for factor in LABEL_DISTANCES])
