"""Deviation of surfaces from what their material promises, patch by patch.

Whether a ray returns is not drawn anew each time: a place on a road or a car that fails a LiDAR once mostly fails it in
the next sweep too, and so do its neighbours. Each place deviates by a standard normal number that follows from a seed
and the place alone: the sum of a number for each of some cubic lattices that the place lies in.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...arrays import Float
from .noisy_returns import normal

PATCH_SIZES = (1.0, 16.0)
PATCH_VARIANCES = (0.65, 0.35)
"""Edges of the lattices' cubes in metres, and their shares of the variance: fitted to how alike the fates of
neighbouring rays on roads are, at 20 to 100 m, and to how far sectors of 10° differ there."""

PHASE = (3.0 - math.sqrt(5.0)) / 2.0
"""Where the lattices begin, in edges: at no round coordinate, lest rounding share the hits on a level road at height 0,
or on a wall, out to the cubes on either side."""

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


def surface_deviation(xyz: Float, seed: tuple[int, ...]) -> Float:
    """Return by how many standard deviations the surface deviates at points.

    Parameters
    ----------
    xyz : (n, 3) float64, metres
        In axes that the surface rests in.
    seed : tuple of int
        Other ones make other surfaces.

    Returns
    -------
    (n,) float64
        Of normal distribution; the same for all points of a patch.
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
    """Return 64 bits each of which depends on all given ones (splitmix64; Steele, Lea and Flood 2014)."""
    with np.errstate(over="ignore"):
        bits = bits + _GOLDEN
        bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return bits ^ (bits >> np.uint64(31))
