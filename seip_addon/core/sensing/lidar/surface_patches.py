"""Deviation of surfaces from the reflectivity of their material, patch by patch.

Whether a ray returns is not independent between sweeps: a point on a road or a car that gives no return once mostly
gives none in the next sweep either, and neither do its neighbours. So each point has a standard normal deviation that
depends only on a seed and on the point: the sum of one number for its cube in each of several cubic lattices.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...arrays import Float
from .noisy_returns import normal

PATCH_SIZES = (1.0, 16.0)
PATCH_VARIANCES = (0.65, 0.35)
"""Edges of the lattices' cubes in metres, and their shares of the variance.

They are fitted to real sweeps: to the correlation of neighbouring rays on roads at 20 to 100 m, and to the differences
between sectors of 10° there.
"""

PHASE = (3.0 - math.sqrt(5.0)) / 2.0
"""Offset of the lattices, in edges.

It is not a round number: otherwise rounding would distribute the hits on a level road at height 0, or on a wall, over
the cubes on both sides.
"""

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


def surface_deviation(xyz: Float, seed: tuple[int, ...]) -> Float:
    """Return the deviation of a surface at points, in standard deviations.

    Parameters
    ----------
    xyz : (n, 3) float64, metres
        Points in axes in which the surface does not move.
    seed : tuple of int
        Seed of the surface.

    Returns
    -------
    (n,) float64
        Normally distributed deviations, the same for all points of a patch.
    """
    total = np.zeros(len(xyz))
    for number, (size, variance) in enumerate(zip(PATCH_SIZES, PATCH_VARIANCES, strict=True)):
        cell = np.floor(xyz / size + PHASE).astype(np.int64).view(np.uint64)
        bits = np.zeros(len(xyz), dtype=np.uint64)
        for one in (*seed, number):
            bits = _mixed(bits ^ np.uint64(one % 2**64))
        for axis in range(3):
            bits = _mixed(bits ^ cell[:, axis])
        total += np.sqrt(variance) * normal((bits >> np.uint64(32)).astype(np.uint32))
    return total


def _mixed(bits: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return 64 bits, each of which depends on all given ones (splitmix64; Steele, Lea and Flood 2014)."""
    with np.errstate(over="ignore"):
        bits = bits + _GOLDEN
        bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return bits ^ (bits >> np.uint64(31))
