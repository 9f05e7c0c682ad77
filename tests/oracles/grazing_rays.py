"""Rays on whose return two ray casters may disagree."""

from __future__ import annotations

from headless.studies.benchmark.scans import SLACK

import numpy as np

from seip_addon.core.base.arrays import Float


def grazes(origin: Float, direction: Float, triangles: Float, distance: float) -> bool:
    """Return whether a ray grazes an edge or a surface, so that two engines may disagree on it.

    It passes an edge, or it hits a surface so edge-on that the single precision of the
    corners moves the full scan's return, while double precision agrees with this one.
    """
    return (
        passes_an_edge(origin, direction, triangles) or abs(exact_hit(origin, direction, triangles) - distance) < SLACK
    )


def exact_hit(origin: Float, direction: Float, triangles: Float) -> float:
    """Return the distance to the first triangle in double precision (Möller and Trumbore 1997), or infinity."""
    start, first, second = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    across = np.cross(direction, second)
    volume = (first * across).sum(axis=1)
    facing = np.flatnonzero(volume)
    away, share = origin - start[facing], 1.0 / volume[facing]
    along = np.cross(away, first[facing])
    u, v = share * (away * across[facing]).sum(axis=1), share * (along @ direction)
    far = share * (second[facing] * along).sum(axis=1)
    return float(far[(u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0)].min(initial=np.inf))


def passes_an_edge(origin: Float, direction: Float, triangles: Float) -> bool:
    """Return whether a ray passes within `SLACK` of a triangle's edge."""
    start = np.concatenate([triangles[:, corner] for corner in range(3)]) - origin
    edge = np.concatenate([triangles[:, (corner + 1) % 3] - triangles[:, corner] for corner in range(3)])
    aside, across = (part - np.outer(part @ direction, direction) for part in (start, edge))
    length = np.maximum((across**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip(-(aside * across).sum(axis=1) / length, 0, 1)
    return bool(np.linalg.norm(aside + share[:, None] * across, axis=1).min() < SLACK)
