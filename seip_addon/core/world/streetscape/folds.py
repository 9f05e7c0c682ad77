"""Removal of folds in lane edges: on the inside of a sharp bend the edge of a wide road crosses itself."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import shapely

from ...arrays import Float
from ..opendrive.lanes import LaneSurface

MAX_FOLD_LENGTH = 25.0  # metres of an edge in one fold: a longer loop is the shape of the road


def without_folds(surfaces: Iterable[LaneSurface]) -> tuple[LaneSurface, ...]:
    """Return the lanes with each fold of an edge collapsed to the point where the edge crosses itself."""
    return tuple(replace(lane, left=_unfolded(lane.left), right=_unfolded(lane.right)) for lane in surfaces)


def _unfolded(edge: Float) -> Float:
    """Return an edge (n, 3) with folds collapsed to points; lanes with a common edge keep it."""
    if len(edge) < 4 or shapely.LineString(edge[:, :2]).is_simple:
        return edge
    edge = edge.copy()
    steps = np.hypot(*np.diff(edge[:, :2], axis=0).T)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    pieces = shapely.linestrings(np.stack([edge[:-1, :2], edge[1:, :2]], axis=1))
    # Scan segments in order. A fold begins at the first segment that a later one crosses; the last such segment within
    # `MAX_FOLD_LENGTH` ends it. All points between take the crossing point, so that the number of rows stays the same.
    first = 0
    while first < len(pieces) - 2:
        last = int(np.searchsorted(travelled, travelled[first + 1] + MAX_FOLD_LENGTH))
        crossing = np.flatnonzero(shapely.intersects(pieces[first], pieces[first + 2 : last])) + first + 2
        if not len(crossing):
            first += 1
            continue
        stop = int(crossing[-1])
        meeting = shapely.get_coordinates(shapely.intersection(pieces[first], pieces[stop]))[0]
        edge[first + 1 : stop + 1] = [*meeting, edge[first + 1 : stop + 1, 2].mean()]
        first = stop
    return edge
