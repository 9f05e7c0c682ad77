"""Share of rays that return: prediction by a law of detection, and fit of a law to measured shares."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.sensing.lidar.range_equation import RangeEquation

from .reference import MeasuredSensor, ShareBin

GROUND_REFLECTIVITY, VERTICAL_REFLECTIVITY = 0.17, 0.3
"""Reflectivity of asphalt, and of façades and vehicles, in the near infrared."""

LEAST_RAYS, FARTHEST = 200, 60.0
"""Bins with fewer rays, or with a farther end in metres, are not fitted: surfaces differ too much there."""

_RANGES = (np.arange(32) + 0.5) / 32
"""Ranges over which shares are averaged, as fractions of a bin."""

_THRESHOLDS, _SPREADS = (-20.0, -5.0), (math.log(0.1), math.log(4.0))
"""Limits of m and ln s in the fit."""

_GRID, _ROUNDS = 21, 8
"""Grid values of each parameter, and number of rounds; each round narrows the grid around the best value."""


@dataclass(frozen=True)
class Fits:
    """A law of detection from the catalogue, with fitted gain, and with all parameters fitted, each with its misfit.

    Parameters
    ----------
    bins : int
        Number of fitted bins.
    catalogue, gain, free : RangeEquation
        Law of the catalogue; the same with fitted threshold; law with fitted threshold, spread and ceiling, in clear
        air.
    misfits : tuple of three floats
        Root mean square difference of the law's share and the measured share over the bins, for each law.
    """

    bins: int
    catalogue: RangeEquation
    gain: RangeEquation
    free: RangeEquation
    misfits: tuple[float, float, float]

    @property
    def determined(self) -> bool:
        """Whether the bins determine threshold and spread: the fit is not at the limits of the search."""
        values = (self.free.threshold, math.log(self.free.spread))
        return all(
            low + 0.1 < value < high - 0.1 for value, (low, high) in zip(values, (_THRESHOLDS, _SPREADS), strict=True)
        )


@dataclass(frozen=True, eq=False)
class _Shares:
    """Ranges (b, 32) over bins, ρ · cos θ there, and measured shares (b,)."""

    distance: Float
    reflected: Float
    share: Float

    def of(self, law: RangeEquation) -> Float:
        """Return the share (b,) by a law in each bin."""
        chance = law.chance(self.distance.ravel(), self.reflected.ravel()).reshape(self.distance.shape)
        mean: Float = chance.mean(axis=1)
        return mean

    def misfit(self, law: RangeEquation) -> float:
        """Return the root mean square difference between the law's and the measured shares."""
        return math.sqrt(float(np.mean((self.of(law) - self.share) ** 2)))


def fitted(one: ShareBin) -> bool:
    """Return whether a bin is used in fits."""
    return one.rays >= LEAST_RAYS and one.high <= FARTHEST


def ground_reflected(sensor: MeasuredSensor, distance: Float) -> Float:
    """Return ρ · cos θ of level ground at ranges (n,) in metres."""
    return GROUND_REFLECTIVITY * np.minimum(sensor.height / distance, 1.0)


def fit(sensor: MeasuredSensor, law: RangeEquation) -> Fits | None:
    """Compare a law with the shares of a measured sensor, and fit it; None if no bin can be used."""
    shares = _fitted_shares(sensor)
    if not len(shares.share):
        return None
    gain = _with_gain(shares, law)
    free = _with_three_numbers(shares)
    return Fits(len(shares.share), law, gain, free, (shares.misfit(law), shares.misfit(gain), shares.misfit(free)))


def _fitted_shares(sensor: MeasuredSensor) -> _Shares:
    ground, vertical = (list(filter(fitted, bins)) for bins in (sensor.ground_by_range_m, sensor.vertical_by_range_m))
    on_ground, on_vertical = _ranges(ground), _ranges(vertical)
    cos = np.array([one.mean_cos_incidence for one in vertical])[:, None]
    return _Shares(
        np.concatenate([on_ground, on_vertical]),
        np.concatenate(
            [ground_reflected(sensor, on_ground), VERTICAL_REFLECTIVITY * np.broadcast_to(cos, on_vertical.shape)]
        ),
        np.array([one.share for one in (*ground, *vertical)]),
    )


def _ranges(bins: Iterable[ShareBin]) -> Float:
    return np.array([one.low + (one.high - one.low) * _RANGES for one in bins]).reshape(-1, len(_RANGES))


def _with_gain(shares: _Shares, law: RangeEquation) -> RangeEquation:
    low, high = _THRESHOLDS
    best = law
    for _ in range(_ROUNDS):
        tried = [replace(law, threshold=float(threshold)) for threshold in np.linspace(low, high, _GRID)]
        best = min(tried, key=shares.misfit)
        low, high = _closer(best.threshold, high - low, _THRESHOLDS)
    return best


def _with_three_numbers(shares: _Shares) -> RangeEquation:
    """Return the best law by a search on ever finer grids of m and ln s, each pair with its best ceiling c."""
    thresholds, spreads = _THRESHOLDS, _SPREADS
    best = RangeEquation(0.0)
    for _ in range(_ROUNDS):
        grid = (np.linspace(*ends, _GRID) for ends in (thresholds, spreads))
        tried = [_best_ceiling(shares, float(m), math.exp(log_s)) for m, log_s in itertools.product(*grid)]
        best = min(tried, key=shares.misfit)
        thresholds = _closer(best.threshold, thresholds[1] - thresholds[0], _THRESHOLDS)
        spreads = _closer(math.log(best.spread), spreads[1] - spreads[0], _SPREADS)
    return best


def _closer(best: float, width: float, limits: tuple[float, float]) -> tuple[float, float]:
    """Return an interval around the best value, a quarter as wide as the last, within limits."""
    return max(best - width / 8, limits[0]), min(best + width / 8, limits[1])


def _best_ceiling(shares: _Shares, threshold: float, spread: float) -> RangeEquation:
    """Return the law of a threshold and a spread with the ceiling that fits best."""
    # Shares are proportional to the ceiling, so the least-squares ceiling is a projection and needs no search.
    whole = RangeEquation(threshold, spread, 1.0)
    of = shares.of(whole)
    power = float(of @ of)
    return replace(whole, ceiling=min(max(float(of @ shares.share) / power, 1e-3), 1.0)) if power else whole
