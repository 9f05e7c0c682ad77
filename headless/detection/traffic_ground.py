"""Ground that vehicles were seen to move over in a recording.

Detections that stand where nothing ever moves are often false: bushes, barriers, signs. Real vehicles that are parked
there cannot be told from them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from seip_addon.core.base.arrays import Boolean, Float

from .frame_results import EvaluatedBoxes, FrameResult

MOST_SECONDS = 1.0
"""Longest interval between frames in which a vehicle can be followed."""
BESIDE = 1.0
"""Metres beside the ground up to which the middle of a vehicle counts as on it."""

_VEHICLES = ("car", "truck")  # by the first category of their classes
_FASTEST = 45.0  # metres per second
_STEP = 0.5  # metres: least distance between frames, above the noise of a standing vehicle's boxes
_MOVED = 3.0  # metres: least distance over three frames
_UNEVEN = 1.0  # metres by which the middle one of three places may be off, plus the next share of the distance
_UNEVEN_SHARE = 0.1
_SAME_PLACE = 0.7  # metres
_OFTEN = 0.05  # share of the frames with a box at a place from which on it is one where something stands
_SIDEWAYS = np.cos(np.radians(30.0))  # a vehicle moves along its axis


def moved_ground(frames: Sequence[FrameResult], score: float) -> BaseGeometry:
    """Return the ground that vehicles were seen to move over.

    A vehicle moves if boxes of three frames in succession agree with a constant velocity along their axes, and not more
    than one of them is at a place with boxes in many frames: false detections at posts of a barrier can agree as well.

    Parameters
    ----------
    frames : sequence of FrameResult
        Frames in the order of their times.
    score : float
        Least score of the detections that count.

    Returns
    -------
    shapely geometry, metres
        Plan area; empty if no vehicle moved, or if frames are more than `MOST_SECONDS` apart.
    """
    boxes = [_vehicles(one.detected, score) for one in frames]
    standing = _standing(boxes)
    swept = []
    for number in range(len(frames) - 2):
        first, second = np.diff([one.time for one in frames[number : number + 3]]).tolist()
        if max(first, second) <= MOST_SECONDS:
            three = slice(number, number + 3)
            swept += _swept(boxes[three], standing[three], first, second)
    return shapely.union_all(swept)


def apart(found: EvaluatedBoxes, ground: BaseGeometry) -> Boolean:
    """Return for each detection (k,) whether it is a vehicle with its middle beside an area in plan."""
    near = ground.buffer(BESIDE)
    shapely.prepare(near)
    return np.isin(found.category, _VEHICLES) & ~shapely.contains_xy(near, found.boxes[:, 0], found.boxes[:, 1])


def _vehicles(found: EvaluatedBoxes, score: float) -> Float:
    return found.boxes[np.isin(found.category, _VEHICLES) & (found.score >= score)]


def _standing(boxes: Sequence[Float]) -> list[Boolean]:
    """Return for the boxes of each frame (k,) whether many frames have one at the same place."""
    most = max(1, int(_OFTEN * len(boxes)))
    places = shapely.points(np.concatenate([one[:, :2] for one in boxes]))
    frame = np.repeat(np.arange(len(boxes)), [len(one) for one in boxes])
    one, other = shapely.STRtree(places).query(places, predicate="dwithin", distance=_SAME_PLACE)
    pairs = np.unique(np.column_stack([one, frame[other]]), axis=0)  # of a box and a frame, its own among them
    often = np.bincount(pairs[:, 0], minlength=len(places)) - 1 > most
    return [often[frame == number] for number in range(len(boxes))]


def _swept(boxes: Sequence[Float], standing: Sequence[Boolean], first: float, second: float) -> list[BaseGeometry]:
    """Return the areas that vehicles moved over in three frames with intervals of so many seconds."""
    before, now, after = boxes
    one, other = now[None, :, :2] - before[:, None, :2], after[None, :, :2] - now[:, None, :2]
    start, middle = np.nonzero(_moves(one, now[:, 6], first))
    middle_again, end = np.nonzero(_moves(other, now[:, 6, None], second))
    pairs = np.argwhere(middle[:, None] == middle_again)
    start, middle, end = start[pairs[:, 0]], middle[pairs[:, 0]], end[pairs[:, 1]]
    total = after[end, :2] - before[start, :2]
    length = np.linalg.norm(total, axis=1)
    expected = before[start, :2] + total * (first / (first + second))
    off = np.linalg.norm(now[middle, :2] - expected, axis=1)
    chosen = (start, middle, end)
    stand = sum(one[which].astype(int) for one, which in zip(standing, chosen, strict=True))
    even = (length >= _MOVED) & (off <= _UNEVEN + _UNEVEN_SHARE * length) & (stand <= 1)
    corners = np.stack([_corners(one[which[even]]) for one, which in zip(boxes, chosen, strict=True)], axis=1)
    return list(shapely.convex_hull(shapely.multipoints(corners.reshape(len(corners), 12, 2))))


def _moves(step: Float, yaw: Float, seconds: float) -> Boolean:
    """Return which steps (n, m, 2) a vehicle of some yaw can make."""
    length = np.linalg.norm(step, axis=2)
    along = np.abs(step[..., 0] * np.cos(yaw) + step[..., 1] * np.sin(yaw))
    moves: Boolean = (length >= _STEP) & (length <= _FASTEST * seconds) & (along >= _SIDEWAYS * length)
    return moves


def _corners(boxes: Float) -> Float:
    """Return the corners of boxes (n, 7) in plan, (n, 4, 2)."""
    along = np.column_stack([np.cos(boxes[:, 6]), np.sin(boxes[:, 6])]) * boxes[:, 3, None] / 2
    across = np.column_stack([-np.sin(boxes[:, 6]), np.cos(boxes[:, 6])]) * boxes[:, 4, None] / 2
    signs = ((1, 1), (1, -1), (-1, -1), (-1, 1))
    return np.stack([boxes[:, :2] + a * along + b * across for a, b in signs], axis=1)
