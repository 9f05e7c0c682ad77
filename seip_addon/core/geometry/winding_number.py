"""Point-in-mesh test by generalised winding number."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Boolean, Float, Integer

_COORDINATE_BITS = 16  # bits of each coordinate, for the order of triangles in space
_MIN_BLOCK_TRIANGLES = 16  # least number of triangles in a block
_TOLERANCES = (0.1, 0.01, 0.001, 0.0)
"""Limits on the total error of all far blocks; a point undecided with one of them is computed with the next."""


def enclosed(points: Float, triangles: Float) -> Boolean:
    """Return whether each point lies inside a triangle soup: the absolute value of its winding number exceeds 0.5.

    Parameters
    ----------
    points : (n, 3) float64, metres
    triangles : (m, 3, 3) float64, metres

    Returns
    -------
    (n,) bool
        Same result as computing the winding number from all triangles.

    Notes
    -----
    The winding number is 1 (or −1) inside and 0 outside, in between if the soup is open; introduced for open and
    inconsistent meshes by Jacobson et al. (2013). If shells of opposite orientation lie within each other, or faces are
    oriented at random, their contributions cancel and a point inside counts as outside. That does no harm here: a
    sensor enclosed by faces sees nothing.

    Triangles are grouped into blocks, and a far block is approximated by its moments, as in the fast winding numbers of
    Barill et al. (2018), here with a bound on the error of each block. A point whose winding number is nearer to 0.5
    than the total error is computed again with smaller errors, and finally without any.
    """
    if not len(triangles):
        return np.zeros(len(points), dtype=bool)
    blocks = Blocks.of(triangles)
    return np.array([_encloses(blocks, point) for point in points], dtype=bool)


def _encloses(blocks: Blocks, point: Float) -> bool:
    number = 0.0
    # Most points are far from the threshold and decided by the coarsest tolerance. With the last one, zero, no block is
    # approximated, the error is zero, and the loop ends.
    for tolerance in _TOLERANCES:
        number, error = blocks.winding_number(point, tolerance)
        if abs(abs(number) - 0.5) > error:
            break
    return abs(number) > 0.5


def _shares(triangles: Float) -> Float:
    """Return the signed share (...) of the sphere around the origin that triangles (..., 3, 3) cover.

    The solid angle of a triangle follows van Oosterom and Strackee (1983).
    """
    a, b, c = np.moveaxis(triangles, -2, 0)
    la, lb, lc = (np.linalg.norm(side, axis=-1) for side in (a, b, c))
    # tan(Ω/2) = a·(b × c) / (|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|). The two-argument arctangent keeps the sign of
    # solid angles beyond a hemisphere; Ω/4π = atan2/2π.
    volume = (a * np.cross(b, c)).sum(axis=-1)
    dots = (a * b).sum(axis=-1) * lc + (b * c).sum(axis=-1) * la + (c * a).sum(axis=-1) * lb
    share: Float = np.arctan2(volume, la * lb * lc + dots) / (2 * np.pi)
    return share


@dataclass(frozen=True, eq=False)
class Blocks:
    """Triangles in b blocks of k neighbours each, with moments of the surface s of each block about its centroid.

    Parameters
    ----------
    triangles : (b, k, 3, 3) float64, metres
    centre : (b, 3) float64, metres
        Centroid of each block.
    reach : (b,) float64, metres
        Distance from the centroid to the farthest corner.
    area : (b, 3) float64, square metres
        ∫ n ds, with the unit normal n.
    moment : (b, 3, 3) float64, cubic metres
        ∫ n uᵀ ds, with the position u relative to the centroid.
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
        """Group triangles (m, 3, 3) into blocks of √m / 8 triangles, at least `_MIN_BLOCK_TRIANGLES`."""
        size = max(_MIN_BLOCK_TRIANGLES, math.isqrt(len(triangles)) // 8)
        # Triangles without area fill the last block.
        filling = np.broadcast_to(triangles[-1:, :1], (-len(triangles) % size, 3, 3))
        # Neighbours along a space-filling curve form compact blocks; the smaller a block, the nearer it may be to a
        # point and still count as far.
        ordered = triangles[_order(triangles.sum(axis=1))]
        blocks = np.concatenate([ordered, filling]).reshape(-1, size, 3, 3)
        a, b, c = np.moveaxis(blocks, 2, 0)
        normal = np.cross(b - a, c - a) / 2
        weight = np.linalg.norm(normal, axis=2)
        middle = blocks.mean(axis=2)
        safe = weight + np.finfo(np.float64).tiny  # blocks without area have a middle too
        centre = (middle * safe[:, :, None]).sum(axis=1) / safe.sum(axis=1)[:, None]
        corners, middle = blocks - centre[:, None, None], middle - centre[:, None]
        # Exact integrals over each triangle of area A with corners p and middle m, relative to the block's centroid: ∫
        # u ds = A·m, because u is linear, and ∫ |u|² ds = A/12·(Σ|p|² + 9|m|²).
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
        """Return the winding number of a point (3,) and a bound on its error.

        Blocks with an error bound below their part of the tolerance are approximated by their moments; the triangles of
        other blocks are computed one by one. The contribution of a small surface is ∫ n·v / |v|³ ds / 4π, with v its
        position relative to the point: the first two terms of the Taylor series about the centroid are used. Third
        derivatives of 1 / |v| along any unit vectors are at most 6 / |v|⁴.
        """
        away = self.centre - point
        distance = np.linalg.norm(away, axis=1)
        # Remainder of the Taylor series: |u|²/2 times a third derivative of 1/|v| at some point of the block, none of
        # which is nearer than `nearest`; hence the bound ∫ |u|²/2 · 6/nearest⁴ ds / 4π. A point within reach has no
        # bound.
        nearest = distance - self.reach
        error = np.full(len(away), np.inf)
        np.divide(3 / (4 * np.pi) * self.spread, nearest**4, out=error, where=nearest > 0)
        far = error * len(away) <= tolerance
        away, distance, moment = away[far], distance[far], self.moment[far]
        # Gradient of v/|v|³ is (1 - 3 v vᵀ/|v|²)/|v|³; applied to n and u and integrated it gives the linear term.
        linear = np.trace(moment, axis1=1, axis2=2) - 3 * np.einsum("ki,kij,kj->k", away, moment, away) / distance**2
        share = ((self.area[far] * away).sum(axis=1) + linear) / distance**3 / (4 * np.pi)
        number = share.sum() + _shares(self.triangles[~far] - point).sum()
        return float(number), float(error[far].sum())


def _order(places: Float) -> Integer:
    """Return the indices that sort points (n, 3) along Morton's (1966) curve, on which successors are neighbours."""
    low = places.min(axis=0)
    step = max(float((places - low).max()), np.finfo(np.float64).tiny) / (2**_COORDINATE_BITS - 1)
    steps = ((places - low) / step).astype(np.int64)
    # Interleave the bits of the three integer coordinates to one number of 3 × 16 bits.
    bits = [((steps >> bit) & 1) @ (1, 2, 4) << 3 * bit for bit in range(_COORDINATE_BITS)]
    return np.argsort(sum(bits), kind="stable")
