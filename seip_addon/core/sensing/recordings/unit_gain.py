"""Gain of a single sensor, from the share of its rays that return."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ...base.arrays import Float
from ...base.estimates import student_quantile
from ..lidar.carla_dropoff import CarlaDropoff
from ..lidar.noisy_returns import return_chance
from .comparison import AGREES, NOTHING, RayComparison
from .registration import sector_of
from .verification import Gain

_LEAST, _MOST = 0.02, 50.0  # gains that can be found
_STEPS = 60  # of the bisection
_STEP = 0.05  # of the logarithm of the gain, for derivatives
_SECTORS = 12  # of azimuth
_LEAST_RAYS = 500


def fitted_gain(one: RayComparison) -> Gain | None:
    """Return the gain at which the law predicts the share of returns; None if the recording does not determine it.

    Only rays whose surface is as predicted are used. The weight of each is the derivative of its chance to return,
    since rays that return at any gain would turn the few returns that are not matched with them into a loss of power.
    The interval is that of the jackknife over sectors of azimuth, because neighbouring rays return or not together:
    real surfaces deviate from their materials over 16 m and more. Its degrees of freedom are those of the effective
    number of sectors, since few of them have most of the doubtful rays.
    """
    model = one.sensor.model
    rays = np.isin(one.result, (AGREES, NOTHING)) & (one.predicted >= model.min_range)
    if isinstance(model.law, CarlaDropoff) or rays.sum() < _LEAST_RAYS:
        return None
    distance, reflected, returned = one.predicted[rays], one.reflected[rays], one.returned[rays]

    def chance(log_gain: float) -> Float:
        return return_chance(model.amplified(math.exp(log_gain)), distance, reflected)

    def slope(log_gain: float) -> Float:
        return (chance(log_gain + _STEP) - chance(log_gain - _STEP)) / (2 * _STEP)

    found = _root(chance, returned, np.ones(len(returned)))
    if found is None:
        return None
    weight = slope(found)
    found = _root(chance, returned, weight)
    if found is None:
        return None
    sector = sector_of(one.directions[rays], _SECTORS)
    slopes = np.bincount(sector, weight * slope(found), _SECTORS)
    total, others = float(slopes.sum()), np.maximum(slopes.sum() - slopes, 1e-9)
    residual = weight * (returned - chance(found))
    without = np.bincount(sector, residual, _SECTORS) / others  # by which the logarithm changes without a sector
    effective = total**2 / float(slopes @ slopes)
    half = student_quantile(max(1, round(effective) - 1)) * math.sqrt((1 - 1 / _SECTORS) * float(without @ without))
    return Gain(math.exp(found), math.exp(found - half), math.exp(found + half))


def _root(chance: Callable[[float], Float], returned: Float, weight: Float) -> float | None:
    """Return the logarithm of the gain at which the weighted mean chance is that of the returns; None outside."""
    low, high = math.log(_LEAST), math.log(_MOST)
    wanted = float(weight @ returned)
    if not float(weight @ chance(low)) < wanted < float(weight @ chance(high)):
        return None
    for _ in range(_STEPS):  # the mean chance grows with the gain
        middle = (low + high) / 2
        if float(weight @ chance(middle)) < wanted:
            low = middle
        else:
            high = middle
    return (low + high) / 2
