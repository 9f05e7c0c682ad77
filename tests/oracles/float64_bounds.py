"""A float64 ray caster with error bounds, as reference for float32 ray casters.

Every ray is tested against every triangle, without a tree, so that nothing can be missed.
A ray of direction d from o passes the line through p and q at the signed distance
d · ((p − o) × (q − o)) / |d × (q − p)|; it hits a triangle if it passes all three edges
on the same side (cf. Möller and Trumbore 1997). The least of the three distances is how
far the triangle's corners would have to move to change that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from seip_addon.core.base.arrays import Boolean, Float

_SEAM = 1e-13
"""Widening of triangles as a share of the distance, so that no ray passes between adjacent ones."""

_PAIRS_AT_ONCE = 1 << 19  # of rays and triangles, bounds the memory


@dataclass(frozen=True, eq=False)
class Meetings:
    """Intersections of r rays with n triangles.

    Parameters
    ----------
    distance : (r, n) float64, metres
        Distance along the ray to the triangle's plane; not finite if the two are parallel.
    margin : (r, n) float64, metres
        Distance of the ray from the nearest edge, positive inside the triangle and negative outside.
    slope : (r, n) float64
        Absolute cosine between the ray and the triangle's normal.
    """

    distance: Float
    margin: Float
    slope: Float

    @property
    def hit(self) -> Boolean:
        """Whether rays hit triangles in front of them, edges included, (r, n) bool."""
        with np.errstate(invalid="ignore"):
            seam = _SEAM * np.abs(self.distance)
            inside = self.margin >= -seam
        return np.isfinite(self.distance) & inside & (self.distance > 0)


def meet(origin: Float, directions: Float, triangles: Float) -> Meetings:
    """Intersect rays with triangles.

    Parameters
    ----------
    origin : (3,) or (r, 3) float64, metres
    directions : (r, 3) float64
        Unit vectors.
    triangles : (n, 3, 3) float64, metres
        Triangles with a positive area.
    """
    start = np.broadcast_to(origin, directions.shape)[:, None]
    rays = directions[:, None]
    corners = [triangles[None, :, side] - start for side in range(3)]
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    towards = directions @ normal.T
    sides = []
    for first, second in ((0, 1), (1, 2), (2, 0)):
        volume = (rays * np.cross(corners[first], corners[second])).sum(axis=2)
        apart = np.linalg.norm(np.cross(rays, triangles[None, :, second] - triangles[None, :, first]), axis=2)
        sides.append(volume / np.maximum(apart, np.finfo(np.float64).tiny))
    turned = np.where(towards < 0, -1.0, 1.0)
    margin = np.min([side * turned for side in sides], axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (corners[0] * normal).sum(axis=2) / towards
    return Meetings(distance, margin, np.abs(towards))


@dataclass(frozen=True, eq=False)
class FirstHits:
    """First hits of r rays, with bounds that hold if no coordinate is off by more than a tolerance.

    Parameters
    ----------
    distance : (r,) float64, metres
        Distance of the hit; infinite for a miss.
    slope : (r,) float64
        Absolute cosine of incidence at the hit; 1 for a miss.
    nearest, farthest : (r,) float64, metres
        Bounds on the distance of the first hit; infinite if the ray may miss everything.
    """

    distance: Float
    slope: Float
    nearest: Float
    farthest: Float

    def allow(self, distance: Float) -> Boolean:
        """Return whether distances (r,) can be those of first hits; misses are infinite."""
        return (self.nearest <= distance) & (distance <= self.farthest)


def first_hits(origin: Float, directions: Float, triangles: Float, tolerance: float) -> FirstHits:
    """Find the first hits of rays.

    A triangle is surely hit if the ray passes inside all its edges by more than the
    tolerance, and possibly hit if it passes outside by less. The hit on a slanted
    triangle moves along the ray by the tolerance over the cosine of incidence.

    Parameters
    ----------
    origin : (3,) or (r, 3) float64, metres
    directions : (r, 3) float64
        Unit vectors.
    triangles : (n, 3, 3) float64, metres
        At least one triangle, all with a positive area.
    tolerance : float, metres
    """
    at_once = max(1, _PAIRS_AT_ONCE // len(triangles))
    parts = []
    for begin in range(0, len(directions), at_once):
        batch = slice(begin, begin + at_once)
        met = meet(origin if origin.ndim == 1 else origin[batch], directions[batch], triangles)
        parts.append(_first(met, tolerance))
    return FirstHits(*(np.concatenate([part[number] for part in parts]) for number in range(4)))


def _first(met: Meetings, tolerance: float) -> tuple[Float, Float, Float, Float]:
    hits = np.where(met.hit, met.distance, np.inf)
    first = hits.argmin(axis=1)[:, None]
    distance = np.take_along_axis(hits, first, axis=1)[:, 0]
    slope = np.where(np.isfinite(distance), np.take_along_axis(met.slope, first, axis=1)[:, 0], 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = tolerance / met.slope
        low, high = met.distance - reach, met.distance + reach
    low, high = np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)
    surely = (met.margin > tolerance) & (low > 0)
    maybe = (met.margin >= -tolerance) & (high > 0)
    nearest = np.where(maybe, np.maximum(low, 0.0), np.inf).min(axis=1)
    farthest = np.where(surely, high, np.inf).min(axis=1)
    return distance, slope, nearest, farthest
