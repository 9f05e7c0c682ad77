"""Spatial index of targets within δ of returns."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...base.arrays import Boolean, Float, Integer

_MAX_CELLS_PER_SIDE = 2000


def squared_length(gap: Float) -> Float:
    """Return squared lengths of vectors, (n,) from (n, 3), always summed in the same order, so that bits agree."""
    squared: Float = gap[:, 0] ** 2 + gap[:, 1] ** 2 + gap[:, 2] ** 2
    return squared


def is_within(squared_distance: Float, delta: float) -> Boolean:
    """Return whether returns at squared distances from targets see them: whether they are nearer than δ."""
    near: Boolean = squared_distance < delta**2
    return near


class TargetIndex:
    """Targets in the cells of a square grid in plan, at least δ wide.

    A point within δ of a target lies in the target's cell or in one of the eight around it. Cells are numbered row by
    row, so that three neighbours in a row are one slice of the sorted targets.

    Parameters
    ----------
    xyz : (t, 3) float64, metres
        Positions of the targets.
    delta : float, metres
        δ, the distance within which a return sees a target.
    """

    def __init__(self, xyz: Float, delta: float) -> None:
        self._delta = delta
        low, high = xyz[:, :2].min(axis=0), xyz[:, :2].max(axis=0)
        # a little wider than δ, so that rounding cannot put a near point two cells away
        self._side = max(delta * (1 + 1e-6), float((high - low).max()) / _MAX_CELLS_PER_SIDE)
        self._low = low - 2 * self._side
        self._columns, self._rows = (np.ceil((high - low) / self._side).astype(int) + 5).tolist()
        column, row = self._cells(xyz)
        cell = (row * self._columns + column).astype(np.int64)
        self._order = np.argsort(cell, kind="stable")
        self._xyz = xyz[self._order]
        counts = np.bincount(cell, minlength=self._columns * self._rows)
        self._start = np.concatenate([[0], np.cumsum(counts)])

    def pairs_within_delta(self, points: Float) -> tuple[Integer, Integer]:
        """Return each point with each target that is nearer than δ to it.

        Parameters
        ----------
        points : (n, 3) float64, metres

        Returns
        -------
        point, target : (p,) int64
            Indices of the pairs, points ascending.
        """
        point, slot = (np.concatenate(part) for part in zip(*self._near(points), strict=True))
        order = np.argsort(point, kind="stable")
        return point[order], self._order[slot[order]]

    def _near(self, points: Float) -> Iterator[tuple[Integer, Integer]]:
        """Yield pairs of points and of indices into the sorted targets, for each row of cells around the points."""
        column, row = self._cells(points)
        inside = (column >= 1) & (column < self._columns - 1) & (row >= 1) & (row < self._rows - 1)
        which = np.flatnonzero(inside)
        points, column, row = points[inside], column[inside].astype(np.int64), row[inside].astype(np.int64)
        for neighbour in (-1, 0, 1):
            left = (row + neighbour) * self._columns + column - 1
            begin, end = self._start[left], self._start[left + 3]
            some = np.flatnonzero(end > begin)
            begin, count = begin[some], (end - begin)[some]
            point = np.repeat(some, count)
            slot = np.arange(count.sum()) + np.repeat(begin - (np.cumsum(count) - count), count)
            gap = points[point] - self._xyz[slot]
            near = is_within(squared_length(gap), self._delta)
            yield which[point[near]], slot[near]

    def _cells(self, points: Float) -> tuple[Float, Float]:
        column, row = np.floor((points[:, :2] - self._low) / self._side).T
        return column, row
