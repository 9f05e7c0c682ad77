"""Intensity, loss and noise of a LiDAR's returns."""

from __future__ import annotations

import numpy as np

from ..arrays import Float
from .model import LidarModel


def return_intensity(
    model: LidarModel, distance: Float, cos_incidence: Float, reflectivity: Float | float = 1.0
) -> Float:
    """Return I = ρ · |cos θ| · exp(−a · r), the Lambertian law with attenuation in air.

    Parameters
    ----------
    model : LidarModel
        Its ``attenuation`` is a.
    distance : (n,) float64, metres
        Range r of each return; infinite on a miss, which has intensity 0.
    cos_incidence : (n,) float64
        Cosine of the angle between ray and surface normal.
    reflectivity : (n,) float64 or float
        Reflectivity ρ of each surface, 0 to 1.

    Returns
    -------
    (n,) float64, 0 to 1
    """
    hit = np.isfinite(distance)
    intensity: Float = np.abs(cos_incidence) * reflectivity * np.exp(-model.attenuation * np.where(hit, distance, 0.0))
    return np.where(hit, intensity, 0.0)


def measured_returns(model: LidarModel, distance: Float, intensity: Float, random: np.random.Generator) -> Float:
    """Return ranges as the sensor measures them: without the lost returns, and with noise.

    Parameters
    ----------
    model : LidarModel
    distance : (n,) float64, metres
        True ranges, infinite on a miss.
    intensity : (n,) float64
        Of each return, as `return_intensity` gives it.
    random : numpy.random.Generator
        The same number of values is drawn whatever the ranges are, so that one
        ray's fate does not change another's.

    Returns
    -------
    (n,) float64, metres
        Infinite where there is no return.
    """
    general, by_intensity = random.random((2, len(distance)))
    noise = random.normal(0.0, model.range_noise_std, len(distance))
    slope = model.dropoff_zero_intensity / model.dropoff_intensity_limit
    keep = np.minimum(1.0, slope * intensity + 1.0 - model.dropoff_zero_intensity)
    kept = (general >= model.dropoff_general) & (by_intensity < keep)
    within = (distance >= model.min_range) & (distance <= model.max_range)
    return np.where(kept & within, np.maximum(distance + noise, 0.0), np.inf)
