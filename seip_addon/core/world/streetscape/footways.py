"""Removal of footways of an extract that run along a pavement of the street: one pavement, mapped twice."""

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...arrays import Boolean, Float

MAX_BESIDE = 6.0  # metres from a pavement to the middle of a footway that is the same one
MAX_TURN = 0.5  # sine of the angle between the two at most
STEP, MIN_LENGTH = 2.0, 8.0  # metres: sampling along footways, and least length along a pavement that counts


def without_doubles(line: Float, width: float, pavement: BaseGeometry) -> tuple[BaseGeometry, float]:
    """Return the area of a footway without the stretches along a pavement, and the length of these.

    Ends of the rest near the pavement are connected to it. Short pieces at the pavement, such as between two mapped
    pavements or at a crossing, are left out as well.

    Parameters
    ----------
    line : (n, 2) float64, metres
        Centre line of the footway.
    width : float, metres
        Width of the footway.
    pavement : shapely geometry
        Pavements of the street, prepared.

    Returns
    -------
    area : shapely geometry
        Area of the rest.
    length : float, metres
        Length of the stretches that are left out.
    """
    points = shapely.get_coordinates(shapely.segmentize(shapely.LineString(line), STEP))
    steps = np.diff(points, axis=0)
    lengths = np.hypot(*steps.T)
    doubled = _long_runs(_beside(points, steps, pavement), lengths)
    kept = shapely.line_merge(shapely.multilinestrings(np.stack([points[:-1], points[1:]], axis=1)[~doubled]))
    rest = [part for part in shapely.get_parts(kept) if not part.is_empty and not _is_stub(part, pavement)]
    links = [link for part in rest for link in _links(part, pavement)]
    return shapely.union_all(shapely.buffer([*rest, *links], width / 2)), float(lengths[doubled].sum())


def _beside(points: Float, steps: Float, pavement: BaseGeometry) -> Boolean:
    """Return whether each step (n - 1,) between points (n, 2) runs along a pavement nearby."""
    middles = shapely.points((points[:-1] + points[1:]) / 2)
    across = shapely.get_coordinates(shapely.shortest_line(middles, pavement)).reshape(-1, 2, 2)
    across = across[:, 1] - across[:, 0]
    distance = np.hypot(*across.T)
    # The shortest line to the pavement is square to a parallel pavement, so the cosine of its angle with the step is
    # the sine of the angle between step and pavement. On the pavement itself there is no such line, and no test.
    turn = np.abs((across * steps).sum(axis=1)) / np.maximum(distance * np.hypot(*steps.T), 1e-9)
    near: Boolean = (distance <= MAX_BESIDE) & ((turn <= MAX_TURN) | (distance < 1e-6))
    return near


def _long_runs(along: Boolean, lengths: Float) -> Boolean:
    """Return whether each step belongs to a run along the pavement of at least `MIN_LENGTH`."""
    run = np.cumsum(np.concatenate([[0], np.diff(along.astype(np.int64)) != 0]))
    total = np.bincount(run, lengths)
    long: Boolean = along & (total[run] >= MIN_LENGTH)
    return long


def _is_stub(line: BaseGeometry, pavement: BaseGeometry) -> bool:
    """Return whether a line is short and near the pavement throughout."""
    ends = shapely.points(shapely.get_coordinates(line))
    return bool(line.length < MIN_LENGTH and shapely.distance(ends, pavement).max() <= MAX_BESIDE)


def _links(line: BaseGeometry, pavement: BaseGeometry) -> Sequence[BaseGeometry]:
    """Return straight links from the ends of a line to a pavement nearby; none if the line reaches it already."""
    if line.intersects(pavement):
        return []
    ends = shapely.points(shapely.get_coordinates(line)[[0, -1]])
    ways = shapely.shortest_line(ends, pavement)
    return [way for way in ways if 0 < way.length <= MAX_BESIDE]
