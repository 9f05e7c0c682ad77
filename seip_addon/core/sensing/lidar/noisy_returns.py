"""Loss and noise of a LiDAR's returns."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from ...arrays import Float, Integer
from .model import LidarModel


def return_chance(model: LidarModel, distance: Float, reflected: Float, deviation: Float | None = None) -> Float:
    """Return how likely each hit returns: nought out of range, else as the model's law says.

    Parameters
    ----------
    distance : (n,) float64, metres
        Infinite on a miss.
    reflected : (n,) float64, 0 to 1
        Reflectivity of the surface times the cosine of the angle of incidence.
    deviation : (n,) float64, optional
        Of the surface; see `surface_deviation`.

    Returns
    -------
    (n,) float64, 0 to 1
    """
    within = (distance >= model.min_range) & (distance <= model.max_range)
    return np.where(within, model.law.chance(distance, reflected, deviation), 0.0)


def measured_returns(
    model: LidarModel, distance: Float, chance: Float | NDArray[np.float32], random: np.random.Generator
) -> tuple[Integer, Float]:
    """Return which rays return to the sensor, and the noisy ranges that it measures of them.

    Parameters
    ----------
    distance : (n,) float64, metres
        True ranges.
    chance : (n,) float32 or float64
        Of each return, as `return_chance` gives it.
    random : numpy.random.Generator
        The same values are drawn for the same rays whatever the ranges are, so that
        one ray's fate does not change another's.

    Returns
    -------
    ray : (k,) int64
        Ascending.
    measured : (k,) float64, metres
    """
    fate, error = random.integers(2**32, size=(2, len(distance)), dtype=np.uint32)
    ray = np.flatnonzero(fate < chance * 2.0**32)
    return ray, np.maximum(distance[ray] + model.range_noise(distance[ray]) * normal(error[ray]), 0.0)


def normal(bits: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Return normally distributed numbers (n,) made of 32 random bits each (Box and Muller 1958), up to 4.9."""
    radius, cosine = _box_muller()
    drawn: NDArray[np.float32] = radius[bits >> 16] * cosine[bits & 0xFFFF]
    return drawn


@functools.cache
def _box_muller() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Radii and cosines for every 16 bits: looked up, they take a fifth of the time of a generator's own numbers."""
    share = (np.arange(2**16) + 0.5) / 2**16
    return np.sqrt(-2 * np.log(share)).astype(np.float32), np.cos(2 * np.pi * share).astype(np.float32)
