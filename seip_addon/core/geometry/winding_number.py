"""Point-in-mesh test by generalised winding number, with a hierarchy of cells."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import Boolean, Float, Integer

_BITS = 16
"""Of each coordinate, for the order of triangles in space."""
_FAN = 8
"""Children of a cell."""
_SMALLEST = 16
"""Triangles at most in the smallest cells."""
_AT_ONCE = 128
"""Points looked at together: their pairs with cells fit into memory."""
_TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6)
"""Of the error of one far cell; points that the first leaves in doubt go on to the next."""


def enclosed(points: Float, triangles: Float) -> Boolean:
    """Whether each point lies inside a triangle soup: its winding number is more than a half, or less than minus that.

    Parameters
    ----------
    points : (n, 3) float64, metres
    triangles : (m, 3, 3) float64, metres

    Returns
    -------
    (n,) bool
        As `winding_number` has it.

    Notes
    -----
    Triangles are put into cells within cells, and what lies in a far cell counts
    by its moments, as in the fast winding numbers of Barill et al. (2018), here
    with a bound on the error of each. A point whose winding number is nearer to a
    half than all its errors together is looked at with smaller ones, and in the end
    with none.
    """
    inside = np.zeros(len(points), dtype=bool)
    doubtful = np.arange(len(points))
    if not len(points) or not len(triangles):
        return inside
    cells = Cells.of(triangles)
    for tolerance in _TOLERANCES:
        number, error = cells.winding_number(points[doubtful], tolerance)
        inside[doubtful] = np.abs(number) > 0.5
        doubtful = doubtful[np.abs(np.abs(number) - 0.5) <= error]
    inside[doubtful] = np.abs(winding_number(points[doubtful], triangles)) > 0.5
    return inside


def winding_number(points: Float, triangles: Float) -> Float:
    """Generalised winding number of a triangle soup: 1 (or −1) inside, 0 outside, between where it is open.

    Parameters
    ----------
    points : (n, 3) float64, metres
    triangles : (m, 3, 3) float64, metres

    Returns
    -------
    (n,) float64

    Notes
    -----
    Where shells of opposite sense lie within each other, or faces are turned at
    random, their parts cancel and a point inside counts as outside. That does no
    harm here: a sensor that closed faces surround sees nothing.

    As a test for open and messy meshes Jacobson et al. (2013).
    """
    numbers = [_shares(triangles - point).sum() for point in points]
    return np.array(numbers, dtype=np.float64)


def _shares(triangles: Float) -> Float:
    """Return the share (...) of the sphere about the origin that triangles (..., 3, 3) take, signed.

    Solid angle of a triangle after van Oosterom and Strackee (1983).
    """
    a, b, c = np.moveaxis(triangles, -2, 0)
    la, lb, lc = (np.linalg.norm(side, axis=-1) for side in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=-1)
    dots = (a * b).sum(axis=-1) * lc + (b * c).sum(axis=-1) * la + (c * a).sum(axis=-1) * lb
    share: Float = np.arctan2(volume, la * lb * lc + dots) / (2 * np.pi)
    return share


@dataclass(frozen=True, eq=False)
class Level:
    """The cells of one size, c of them, and the moments of the surface s in each about its centroid.

    Parameters
    ----------
    centre : (c, 3) float64, metres
        The centroid.
    reach : (c,) float64, metres
        From there to the farthest corner at most.
    size : (c,) float64, square metres
        ∫ ds.
    area : (c, 3) float64, square metres
        ∫ n ds, n the unit normal.
    moment : (c, 3, 3) float64, cubic metres
        ∫ n uᵀ ds, u the place from the centroid.
    spread : (c,) float64, metres to the fourth
        ∫ |u|² ds.
    """

    centre: Float
    reach: Float
    size: Float
    area: Float
    moment: Float
    spread: Float

    @classmethod
    def of(cls, triangles: Float) -> Level:
        """Take each triangle (c, 3, 3) for a cell."""
        centre = triangles.sum(axis=1) / 3
        a, b, c = np.moveaxis(triangles - centre[:, None], 1, 0)
        area = np.cross(b - a, c - a) / 2
        size = np.sqrt(_square(area))
        squares = np.stack([_square(corner) for corner in (a, b, c)])
        return cls(
            centre=centre,
            reach=np.sqrt(squares.max(axis=0)),
            size=size,
            area=area,
            moment=np.zeros((len(triangles), 3, 3)),
            spread=size * squares.sum(axis=0) / 12,
        )

    def joined(self, count: int) -> Level:
        """Make one cell of each ``count`` that follow each other, by the parallel axis theorem."""

        def total(values: Float) -> Float:
            summed: Float = values.reshape(-1, count, *values.shape[1:]).sum(axis=1)
            return summed

        weight = self.size + np.finfo(np.float64).tiny  # cells without area have a middle too
        centre = total(self.centre * weight[:, None]) / total(weight)[:, None]
        offset = self.centre - np.repeat(centre, count, axis=0)
        reach = np.sqrt(_square(offset)) + self.reach
        return Level(
            centre=centre,
            reach=reach.reshape(-1, count).max(axis=1),
            size=total(self.size),
            area=total(self.area),
            moment=total(self.moment + self.area[:, :, None] * offset[:, None, :]),
            spread=total(self.spread + self.size * _square(offset)),
        )


def _square(vectors: Float) -> Float:
    """Return the squared lengths (n,) of vectors (n, 3)."""
    squares: Float = np.einsum("ni,ni->n", vectors, vectors)
    return squares


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells within cells.

    Parameters
    ----------
    levels : tuple of Level
        From the one cell about everything to the smallest; those in cell i are the `_FAN` from i * `_FAN` on.
    triangles : (c, k, 3, 3) float64, metres
        Of the smallest cells.
    """

    levels: tuple[Level, ...]
    triangles: Float

    @classmethod
    def of(cls, triangles: Float) -> Cells:
        """Sort triangles (n, 3, 3) into cells."""
        depth = max(0, math.ceil(math.log(len(triangles) / _SMALLEST, _FAN)))
        missing = -len(triangles) % _FAN**depth
        # Triangles without area fill the last cells.
        filled = np.concatenate([triangles, np.broadcast_to(triangles[-1:, :1], (missing, 3, 3))])
        ordered = filled[_order(filled.sum(axis=1))]
        levels = [Level.of(ordered).joined(len(ordered) // _FAN**depth)]
        for _ in range(depth):
            levels.append(levels[-1].joined(_FAN))
        return cls(tuple(reversed(levels)), ordered.reshape(_FAN**depth, -1, 3, 3))

    def winding_number(self, points: Float, tolerance: float) -> tuple[Float, Float]:
        """Return the winding numbers (n,) of points (n, 3) and bounds (n,) of their errors."""
        blocks = range(0, len(points), _AT_ONCE)
        found = [self._sums(points[start : start + _AT_ONCE], tolerance) for start in blocks]
        number, error = np.concatenate([np.empty((2, 0)), *found], axis=1)
        return number, error

    def _sums(self, points: Float, tolerance: float) -> Float:
        sums = np.zeros((2, len(points)))
        for point, terms in self._terms(points, tolerance):
            sums += [np.bincount(point, term, len(points)) for term in terms]
        return sums

    def _terms(self, points: Float, tolerance: float) -> Iterator[tuple[Integer, tuple[Float, Float]]]:
        """Yield points and what cells add to their winding numbers and errors.

        First the largest cells that are far enough, then the triangles of the smallest that are not.
        """
        point, cell = np.arange(len(points)), np.zeros(len(points), dtype=np.int64)
        for depth, level in enumerate(self.levels):
            if depth:
                point, cell = np.repeat(point, _FAN), (cell[:, None] * _FAN + np.arange(_FAN)).ravel()
            error = _error(level, cell, points[point])
            far = error <= tolerance
            yield point[far], (_far_share(level, cell[far], points[point[far]]), error[far])
            point, cell = point[~far], cell[~far]
        share = _shares(self.triangles[cell] - points[point][:, None, None]).sum(axis=1)
        yield point, (share, np.zeros(len(point)))


def _order(places: Float) -> Integer:
    """Return an order of places (n, 3) in which those that follow each other are neighbours: Morton's (1966)."""
    low = places.min(axis=0)
    step = max(float((places - low).max()), np.finfo(np.float64).tiny) / (2**_BITS - 1)
    steps = ((places - low) / step).astype(np.int64)
    bits = [((steps >> bit) & 1) @ (1, 2, 4) << 3 * bit for bit in range(_BITS)]
    return np.argsort(sum(bits), kind="stable")


def _far_share(level: Level, cell: Integer, points: Float) -> Float:
    """Return what cells (k,) add to the winding numbers of points (k, 3), one each, by their moments.

    The share of a small surface is ∫ n·v / |v|³ ds / 4π, v its place from the point; this has the first two terms of
    its Taylor series about the cell's centre.
    """
    away = level.centre[cell] - points
    distance = np.linalg.norm(away, axis=1)
    moment = level.moment[cell]
    linear = np.trace(moment, axis1=1, axis2=2) - 3 * np.einsum("ki,kij,kj->k", away, moment, away) / distance**2
    share: Float = ((level.area[cell] * away).sum(axis=1) + linear) / distance**3 / (4 * np.pi)
    return share


def _error(level: Level, cell: Integer, points: Float) -> Float:
    """Return bounds (k,) of the error of `_far_share`; infinite where the point may be within the cell.

    No third derivative of 1 / |v|, along whatever unit vectors, is above 6 / |v|⁴.
    """
    nearest = np.linalg.norm(level.centre[cell] - points, axis=1) - level.reach[cell]
    bound = np.full(len(cell), np.inf)
    np.divide(3 / (4 * np.pi) * level.spread[cell], nearest**4, out=bound, where=nearest > 0)
    return bound
