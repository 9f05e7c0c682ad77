"""Point-in-mesh test by generalised winding number."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arrays import Boolean, Float, Integer

_COORDINATE_BITS = 16  # of each coordinate, for the order of triangles in space
_MIN_BLOCK_TRIANGLES = 16  # triangles of a block at least
_TOLERANCES = (0.1, 0.01, 0.001, 0.0)
"""Of the errors of all far blocks together; a point that is undecided by the first is computed with the next."""


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
    Triangles are put into blocks, and a far block counts by its moments, as in the fast winding numbers of Barill et
    al. (2018), here with a bound on the error of each. A point whose winding number is nearer to a half than all its
    errors together is looked at with smaller ones, and in the end with none.
    """
    if not len(triangles):
        return np.zeros(len(points), dtype=bool)
    blocks = Blocks.of(triangles)
    return np.array([_encloses(blocks, point) for point in points], dtype=bool)


def _encloses(blocks: Blocks, point: Float) -> bool:
    number = 0.0
    for tolerance in _TOLERANCES:
        number, error = blocks.winding_number(point, tolerance)
        if abs(abs(number) - 0.5) > error:
            break
    return abs(number) > 0.5


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
    Where shells of opposite sense lie within each other, or faces are turned at random, their parts cancel and a point
    inside counts as outside. That does no harm here: a sensor that closed faces surround sees nothing.

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
class Blocks:
    """Triangles in b blocks of k neighbours each, and the moments of the surface s in each about its centroid.

    Parameters
    ----------
    triangles : (b, k, 3, 3) float64, metres
    centre : (b, 3) float64, metres
        The centroid.
    reach : (b,) float64, metres
        From there to the farthest corner.
    area : (b, 3) float64, square metres
        ∫ n ds, n the unit normal.
    moment : (b, 3, 3) float64, cubic metres
        ∫ n uᵀ ds, u the place from the centroid.
    spread : (b,) float64, metres to the fourth
        ∫ |u|² ds.
    """

    triangles: Float
    centre: Float
    reach: Float
    area: Float
    moment: Float
    spread: Float

    @classmethod
    def of(cls, triangles: Float) -> Blocks:
        """Put triangles (m, 3, 3) into blocks, some √m of them: more take longer to go through, fewer hold more."""
        size = max(_MIN_BLOCK_TRIANGLES, math.isqrt(len(triangles)) // 8)
        # Triangles without area fill the last block.
        filling = np.broadcast_to(triangles[-1:, :1], (-len(triangles) % size, 3, 3))
        ordered = triangles[_order(triangles.sum(axis=1))]
        blocks = np.concatenate([ordered, filling]).reshape(-1, size, 3, 3)
        a, b, c = np.moveaxis(blocks, 2, 0)
        normal = np.cross(b - a, c - a) / 2
        weight = np.linalg.norm(normal, axis=2)
        middle = blocks.mean(axis=2)
        safe = weight + np.finfo(np.float64).tiny  # blocks without area have a middle too
        centre = (middle * safe[:, :, None]).sum(axis=1) / safe.sum(axis=1)[:, None]
        corners, middle = blocks - centre[:, None, None], middle - centre[:, None]
        squares = (corners**2).sum(axis=(2, 3)) + 9 * (middle**2).sum(axis=2)
        return cls(
            triangles=blocks,
            centre=centre,
            reach=np.linalg.norm(corners, axis=3).max(axis=(1, 2)),
            area=normal.sum(axis=1),
            moment=np.einsum("bki,bkj->bij", normal, middle),
            spread=(weight * squares).sum(axis=1) / 12,
        )

    def winding_number(self, point: Float, tolerance: float) -> tuple[float, float]:
        """Return the winding number of a point (3,) and a bound of its error.

        Blocks whose error is bounded by their part of the tolerance count by their moments, the triangles of the others
        one by one. The share of a small surface is ∫ n·v / |v|³ ds / 4π, v its place from the point: of its Taylor
        series about the centroid the first two terms are taken. No third derivative of 1 / |v|, along whatever unit
        vectors, is above 6 / |v|⁴.
        """
        away = self.centre - point
        distance = np.linalg.norm(away, axis=1)
        nearest = distance - self.reach
        error = np.full(len(away), np.inf)
        np.divide(3 / (4 * np.pi) * self.spread, nearest**4, out=error, where=nearest > 0)
        far = error * len(away) <= tolerance
        away, distance, moment = away[far], distance[far], self.moment[far]
        linear = np.trace(moment, axis1=1, axis2=2) - 3 * np.einsum("ki,kij,kj->k", away, moment, away) / distance**2
        share = ((self.area[far] * away).sum(axis=1) + linear) / distance**3 / (4 * np.pi)
        number = share.sum() + _shares(self.triangles[~far] - point).sum()
        return float(number), float(error[far].sum())


def _order(places: Float) -> Integer:
    """Return an order of places (n, 3) in which those that follow each other are neighbours: Morton's (1966)."""
    low = places.min(axis=0)
    step = max(float((places - low).max()), np.finfo(np.float64).tiny) / (2**_COORDINATE_BITS - 1)
    steps = ((places - low) / step).astype(np.int64)
    bits = [((steps >> bit) & 1) @ (1, 2, 4) << 3 * bit for bit in range(_COORDINATE_BITS)]
    return np.argsort(sum(bits), kind="stable")
