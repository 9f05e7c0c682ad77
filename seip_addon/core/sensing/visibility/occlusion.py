"""Bundles of rays that a single triangle blocks, found without casting them.

A bundle is a row of neighbouring azimuth steps of one channel. Its rays are u(a) = (cos a, sin a, σ) for azimuths a
within w of a₀. For a half-space n·x > 0

    n·u(a₀ + t) = P cos t + Q sin t + n_z σ,   P = n·(cos a₀, sin a₀, 0),   Q = n·(−sin a₀, cos a₀, 0)

is at least min(P, P cos w) − |Q| sin w + n_z σ for |t| ≤ w ≤ π/2. A triangle stops the whole bundle if that is positive
for the three half-spaces bounded by the planes through the sensor and the triangle's edges.
"""

from __future__ import annotations

import math

import numpy as np

from ...base.arrays import Boolean, Float
from .beam_culling import Beams, NearRays, Planes


def stopped_by(origin: Float, triangles: Float, beams: Beams, rays: NearRays, planes: Planes) -> Boolean:
    """Return which bundles are blocked, each by a given triangle, before they come near their targets.

    Parameters
    ----------
    origin : (3,) float64, metres
        Position of the sensor.
    triangles : (k, 3, 3) float64, metres
        Corners of the triangle for each bundle.
    rays : NearRays
        The k bundles.
    planes : Planes
        Planes in which the rays would return, by patch.

    Returns
    -------
    (k,) bool
        True only where the triangle stops all rays of the bundle by more than the tolerance of a ray caster.
    """
    step = beams.size[rays.channel]
    slope = np.tan(beams.elevation)[rays.channel]
    half_width = (rays.width - 1) / 2 * step
    azimuth = beams.zero[rays.channel] + (rays.first + (rays.width - 1) / 2) * step
    cos, sin = np.cos(azimuth), np.sin(azimuth)
    cos_width, sin_width = np.cos(half_width), np.sin(half_width)

    def least(normal: Float) -> Float:
        """Return the least n·u over each bundle for normals (3, k)."""
        ahead, aside = normal[0] * cos + normal[1] * sin, normal[1] * cos - normal[0] * sin
        value: Float = np.minimum(ahead, ahead * cos_width) - np.abs(aside) * sin_width + normal[2] * slope
        return value

    # Each cross product of two corners, as seen from the sensor, is the normal of the plane through the sensor and an
    # edge. The sum of the three is the normal of the triangle itself. With the triangle's orientation as `side`, all
    # three half-spaces contain the triangle.
    first, second, third = np.ascontiguousarray(np.moveaxis(triangles - origin, 0, 2))
    edges = _cross(first, second), _cross(second, third), _cross(third, first)
    normal = edges[0] + edges[1] + edges[2]
    normal /= np.sqrt((normal**2).sum(axis=0))
    away = (first * normal).sum(axis=0)
    side = np.where(away < 0, -1.0, 1.0)
    distance = np.abs(away)  # distance of the triangle's plane from the sensor: no point of it is nearer
    margin = planes.tolerance * np.hypot(1.0, slope)
    # A ray u meets the triangle's plane at distance / (n·u) and the plane of its target at k / (m·u), in units of u.
    # The first is nearer if k n·u - distance m·u > 0, which is linear in u again, so that `least` bounds it over the
    # bundle. A margin for each of the two planes keeps the caster's errors from changing the order.
    before = planes.distance[rays.patch] * side * normal - distance * planes.normal[rays.patch].T
    stopped = (half_width <= math.pi / 2) & (least(before) > 2 * margin) & (least(side * normal) > 0)
    # The rays must pass inside each edge by the tolerance at the distance of the triangle: near an edge the caster may
    # let a ray pass. A bundle wider than half a turn has no such bound and is never proven stopped.
    for edge in edges:
        stopped &= distance * least(side * edge) > margin * np.sqrt((edge**2).sum(axis=0))
    return stopped


def _cross(one: Float, other: Float) -> Float:
    """Return the cross products of vectors in columns, (3, k); much faster than `numpy.cross`."""
    return np.stack(
        [
            one[1] * other[2] - one[2] * other[1],
            one[2] * other[0] - one[0] * other[2],
            one[0] * other[1] - one[1] * other[0],
        ]
    )
