"""Sampling of smooth curves with a tolerance on chords."""

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float
from ...base.errors import SeipError

Curves = Callable[[Float], Float]

_MIN_LENGTH = 1e-6  # metres; shorter intervals are slivers
_KNOT_OFFSET = 1e-9  # metres before a knot at which the records before it are still in force
_MAX_STEP = 25.0  # metres in which no road turns so often that sampling its quarters misses it
_MIN_STEP = 1e-3  # metres
_MAX_SPLITS = 10_000  # at once; a winding mountain road of 100 km in one piece needs fewer
_QUARTERS = np.linspace(0.0, 1.0, 5)
# The greatest deviation of a cubic from its chord is at most 1.03 times the greatest one at the quarters.
_MARGIN = 0.9


def sample(curves: Curves, knots: Iterable[float], tolerance: float, place: str) -> tuple[Float, Float]:
    """Return points along curves such that straight lines between them are within a tolerance of the curves.

    Between two knots the curves are smooth. At a knot they may jump: then the points before and after the jump are both
    returned.

    Parameters
    ----------
    curves : callable
        Function from (k,) metres along the road to (k, m, 3) points of m curves.
    knots : iterable of float, metres
        Ends of the range, and stations where the curves may jump.
    tolerance : float, metres
        Greatest distance between a curve and its chord.
    place : str
        Description of the sampled object, for messages.

    Returns
    -------
    s : (n,) float64, metres
        Stations along the road.
    points : (n, m, 3) float64, metres
        Points of the curves; s and points are empty if the range is shorter than a micrometre.
    """
    bounds = np.unique(np.fromiter(knots, dtype=np.float64))
    begin, end = bounds[:-1], bounds[1:]
    long_enough = end - begin > _MIN_LENGTH
    begin, end = begin[long_enough], end[long_enough] - _KNOT_OFFSET
    if not begin.size:
        return begin, curves(begin)
    s = np.unique(np.concatenate([_refined(curves, begin, end, tolerance, place), end]))
    points = curves(s)
    kept = _distinct(s, points)
    return s[kept], points[kept]


def _refined(curves: Curves, begin: Float, end: Float, tolerance: float, place: str) -> Float:
    """Return the starts of the steps into which intervals are divided."""
    begin, end = _in_steps(begin, end)
    finished = [np.empty(0)]
    # Halve all intervals at once whose points at the quarters are too far from the chord, until none is left.
    while begin.size:
        s = begin[:, None] + (end - begin)[:, None] * _QUARTERS
        points = curves(s.ravel()).reshape(*s.shape, -1, 3)
        chord = points[:, :1] + (points[:, -1:] - points[:, :1]) * _QUARTERS[:, None, None]
        deviation = np.linalg.norm(points - chord, axis=-1).reshape(len(s), -1).max(axis=1, initial=0.0)
        split = (deviation > _MARGIN * tolerance) & (end - begin > _MIN_STEP)
        finished.append(begin[~split])
        begin, middle, end = begin[split], s[split, 2], end[split]
        begin, end = np.concatenate([begin, middle]), np.concatenate([middle, end])
        if begin.size > _MAX_SPLITS:
            raise SeipError(f"{place} winds too tightly to be followed; correct its geometry and profiles in the map")
    return np.concatenate(finished)


def _in_steps(begin: Float, end: Float) -> tuple[Float, Float]:
    """Cut intervals into steps that are not too long."""
    count = np.maximum(np.ceil((end - begin) / _MAX_STEP), 1.0).astype(np.int64)
    first = np.repeat(np.cumsum(count) - count, count)
    place_in_row = np.arange(count.sum()) - first
    step = np.repeat((end - begin) / count, count)
    start = np.repeat(begin, count)
    return start + place_in_row * step, start + (place_in_row + 1) * step


def _distinct(s: Float, points: Float) -> NDArray[np.bool_]:
    """Return which samples to keep: the sample before a knot only if the curves jump there."""
    keep = np.ones(len(s), dtype=np.bool_)
    moved = np.abs(np.diff(points, axis=0)).reshape(max(len(s) - 1, 0), -1).max(axis=1, initial=0.0)
    keep[:-1] = (np.diff(s) > _MIN_LENGTH) | (moved > _MIN_LENGTH)
    return keep
