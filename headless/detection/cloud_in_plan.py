"""Spatial index of a cloud in plan."""

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.arrays import Float, Integer

CELL_SIZE = 1.0  # side of a cell in metres: a few of them make up the surroundings of a road user


class CloudInPlan:
    """A cloud sorted into square cells in plan.

    Parameters
    ----------
    points : (n, 3) float32, metres
    """

    def __init__(self, points: NDArray[np.float32]) -> None:
        cells = np.floor(points[:, :2] / CELL_SIZE).astype(np.int64)
        self._first: Integer = cells.min(axis=0, initial=0)
        self._columns, self._rows = (cells.max(axis=0, initial=0) - self._first + 1).tolist()
        column, row = (cells - self._first).T
        number = row * self._columns + column
        order = np.argsort(number, kind="stable")
        self._points = points[order]
        self._start = np.searchsorted(number[order], np.arange(self._rows * self._columns + 1))

    def about(self, x: float, y: float, reach: float) -> Float:
        """Return the points (m, 3) in a square about a place: all within the reach, and some beyond it."""
        (west, south), (east, north) = (
            np.floor((np.array((x, y)) + side * reach) / CELL_SIZE).astype(np.int64) - self._first for side in (-1, 1)
        )
        west, east = max(west, 0), min(east, self._columns - 1)
        rows = np.arange(max(south, 0), min(north, self._rows - 1) + 1) * self._columns
        if west > east or not len(rows):
            return np.zeros((0, 3))
        runs = [self._points[self._start[row + west] : self._start[row + east + 1]] for row in rows]
        found: Float = np.concatenate(runs).astype(np.float64)
        return found
