"""Gain of a single sensor, from the share of its rays that return."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ...arrays import Boolean, Float, Integer
from ...estimates import student_quantile
from ..lidar.carla_dropoff import CarlaDropoff
from ..lidar.model import LidarModel
from ..lidar.noisy_returns import return_chance
from .azimuth_sectors import sector_of
from .comparison import AGREES, NOTHING, RayComparison
from .figures import Gain, ReturnShare

RANGE_EDGES = (0.0, 10.0, 20.0, 30.0, 40.0, 60.0, 80.0, 120.0, 200.0)
"""Edges of the ranges, in metres, for which shares of returns are given."""

_LEAST, _MOST = 0.02, 50.0  # gains that can be found
_STEPS = 60  # of the bisection
_STEP = 0.05  # of the logarithm of the gain, for derivatives
_SECTORS = 12  # of azimuth
_LEAST_RAYS = 500
_LEAST_IN_BIN = 30


def fitted_gain(one: RayComparison) -> Gain | None:
    """Return the gain at which the law predicts the mean share of returns; None if the recording does not determine it.

    Only rays whose surface is as predicted are used. The interval is that of the jackknife over sectors of azimuth,
    because neighbouring rays return or not together: surfaces deviate from their materials over 16 m and more. Its
    degrees of freedom are those of the effective number of sectors, since few of them have most of the doubtful rays.
    """
    model = one.sensor.model
    rays = _comparable(one)
    if isinstance(model.law, CarlaDropoff) or rays.sum() < _LEAST_RAYS:
        return None
    distance, reflected, returned = one.predicted[rays], one.reflected[rays], one.returned[rays]
    low, high = math.log(_LEAST), math.log(_MOST)
    wanted = float(returned.mean())
    if not _mean_chance(model, low, distance, reflected) < wanted < _mean_chance(model, high, distance, reflected):
        return None
    for _ in range(_STEPS):  # the mean chance grows with the gain
        middle = (low + high) / 2
        if _mean_chance(model, middle, distance, reflected) < wanted:
            low = middle
        else:
            high = middle
    found = (low + high) / 2
    residual = returned - return_chance(model.amplified(math.exp(found)), distance, reflected)
    above, below = (
        return_chance(model.amplified(math.exp(found + step)), distance, reflected) for step in (_STEP, -_STEP)
    )
    sector = sector_of(one.directions[rays], _SECTORS)
    slope = np.bincount(sector, (above - below) / (2 * _STEP), _SECTORS)
    total, others = float(slope.sum()), np.maximum(slope.sum() - slope, 1e-9)
    without = np.bincount(sector, residual, _SECTORS) / others  # by which the logarithm changes without a sector
    effective = total**2 / float(slope @ slope)
    half = student_quantile(max(1, round(effective) - 1)) * math.sqrt((1 - 1 / _SECTORS) * float(without @ without))
    return Gain(math.exp(found), math.exp(found - half), math.exp(found + half))


def return_shares(one: RayComparison, gain: float, surfaces: Sequence[tuple[str, Integer]]) -> list[ReturnShare]:
    """Return the shares of rays that return, by surface and range.

    Parameters
    ----------
    surfaces : sequence of (str, (n,) int64)
        Kind of surface, and its triangles.
    """
    rays = _comparable(one)
    chance = return_chance(one.sensor.model, one.predicted, one.reflected)
    fitted = return_chance(one.sensor.model.amplified(gain), one.predicted, one.reflected)
    found = []
    for name, triangles in surfaces:
        own = rays & np.isin(one.triangle, triangles)
        for low, high in pairwise(RANGE_EDGES):
            some = own & (one.predicted >= low) & (one.predicted < high)
            if some.sum() >= _LEAST_IN_BIN:
                means = (float(values[some].mean()) for values in (chance, fitted, one.returned))
                found.append(ReturnShare(name, low, high, int(some.sum()), *means))
    return found


def _comparable(one: RayComparison) -> Boolean:
    """Return the rays whose surface is as predicted, or that do not return from it."""
    rays: Boolean = np.isin(one.result, (AGREES, NOTHING)) & (one.predicted >= one.sensor.model.min_range)
    return rays


def _mean_chance(model: LidarModel, log_gain: float, distance: Float, reflected: Float) -> float:
    return float(return_chance(model.amplified(math.exp(log_gain)), distance, reflected).mean())
