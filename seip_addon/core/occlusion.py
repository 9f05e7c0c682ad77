"""Bundles of rays that one triangle stops, proven without casting them.

A bundle is a row of neighbouring azimuth steps of one channel, its rays
u(a) = (cos a, sin a, σ) for azimuths a within w of a₀. With a half-space n·x > 0,

    n·u(a₀ + t) = P cos t + Q sin t + n_z σ,   P = n·(cos a₀, sin a₀, 0),   Q = n·(−sin a₀, cos a₀, 0)

is at least min(P, P cos w) − |Q| sin w + n_z σ for |t| ≤ w ≤ π/2. A triangle stops
the whole bundle if that is positive for the three half-spaces between the sensor
and its edges.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .beam_culling import Beams, NearRays

Float = NDArray[np.float64]
Boolean = NDArray[np.bool_]


def stopped_by(origin: Float, triangles: Float, beams: Beams, rays: NearRays, tolerance: float) -> Boolean:
    """Tell which bundles are stopped, each by its triangle, before they come near their targets.

    Parameters
    ----------
    origin : (3,) float64, metres
        Where the sensor is.
    triangles : (k, 3, 3) float64, metres
    beams : Beams
    rays : NearRays
        k bundles of them.
    tolerance : float, metres
        How far a ray caster's returns may lie off the triangles.

    Returns
    -------
    (k,) bool
        True only where the triangle stops all rays of the bundle by more than the tolerance.
    """
    step = 2 * math.pi / beams.steps[rays.channel]
    slope = np.tan(beams.elevation)[rays.channel]
    half_width = (rays.width - 1) / 2 * step
    azimuth = beams.zero[rays.channel] + (rays.first + (rays.width - 1) / 2) * step
    cos, sin = np.cos(azimuth), np.sin(azimuth)
    cos_width, sin_width = np.cos(half_width), np.sin(half_width)

    def least(normal: Float) -> Float:
        """Least n·u over the bundle; normals are (3, k)."""
        ahead, aside = normal[0] * cos + normal[1] * sin, normal[1] * cos - normal[0] * sin
        return np.minimum(ahead, ahead * cos_width) - np.abs(aside) * sin_width + normal[2] * slope

    first, second, third = np.moveaxis(triangles - origin, 0, 2)
    edges = _cross(first, second), _cross(second, third), _cross(third, first)
    normal = edges[0] + edges[1] + edges[2]
    away = (first * normal).sum(axis=0)
    side = np.where(away < 0, -1.0, 1.0)
    length = np.sqrt((normal**2).sum(axis=0))
    plane = np.abs(away) / length  # no point of the triangle is nearer to the sensor
    stopped = (half_width <= math.pi / 2) & (rays.begin * least(side * normal) - np.abs(away) > tolerance * length)
    ray_length = np.hypot(1.0, slope)
    for edge in edges:
        margin = tolerance * ray_length * np.sqrt((edge**2).sum(axis=0))
        stopped &= plane * least(side * edge) > margin
    return stopped


def _cross(one: Float, other: Float) -> Float:
    """Cross products of vectors in columns, (3, k); much quicker than `numpy.cross`."""
    return np.stack(
        [
            one[1] * other[2] - one[2] * other[1],
            one[2] * other[0] - one[0] * other[2],
            one[0] * other[1] - one[1] * other[0],
        ]
    )
