"""How alike the fates of rays on level ground are, along a ring and from sweep to sweep."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.sensing.lidar.range_equation import RangeEquation
from seip_addon.core.sensing.lidar.surface_patches import surface_deviation

from .reference import MeasuredSensor, ShareBin
from .share_fit import ground_reflected

NEAREST, FARTHEST = 20.0, 100.0
"""Ranges in metres of the rays whose fates are correlated along rings."""

SWEEPS_FROM = 50.0
"""Range in metres from which on fates are correlated over sweeps: nearer, hardly a ray is lost."""

_SURFACES = 16
_MOST_SHARE = 0.9995
"""Surfaces that are drawn, and the share that stands for all rays: where none is lost, no fates differ."""


@dataclass(frozen=True)
class FateCorrelation:
    """Correlation of fates by lag, and the intraclass correlation over sweeps by bin."""

    along_ring: dict[int, float]
    over_sweeps: dict[str, float]


@dataclass(frozen=True, eq=False)
class _SeenBin:
    """Chances (surfaces, rings, steps) of the rays in a bin, and how many rays were measured there."""

    bin: ShareBin
    chance: Float

    @property
    def variance(self) -> float:
        """Of one fate: P (1 − P) of the mean chance."""
        mean = float(self.chance.mean())
        return mean * (1.0 - mean)

    def covariance(self, lag: int) -> float:
        """Of the fates of rays so many steps apart, the bin's mean removed; with lag 0, of one ray in two sweeps."""
        rest = self.chance - self.chance.mean()
        return float((rest * np.roll(rest, -lag, axis=-1)).mean())


def simulate_fates(sensor: MeasuredSensor, spread: float, lags: Sequence[int]) -> FateCorrelation:
    """Return how alike fates are where surfaces deviate patch by patch (`surface_deviation`).

    The sensor's beams sweep level ground at its height. How alike fates are depends on the share that returns, so in
    each bin the threshold gives the measured share, and no return is lost whatever its power. Luck that is drawn anew
    is independent, hence fates of different rays, or of one ray in different sweeps, have the covariance of their
    chances. Bins count by the rays measured in them.

    Parameters
    ----------
    spread : float
        s of the law.
    lags : sequence of int
        Rays apart.
    """
    seen = list(_bins(sensor, spread))
    variance = math.fsum(one.bin.rays * one.variance for one in seen)
    return FateCorrelation(
        {lag: math.fsum(one.bin.rays * one.covariance(lag) for one in seen) / variance for lag in lags} if seen else {},
        {one.bin.bin: one.covariance(0) / one.variance for one in seen if one.bin.low >= SWEEPS_FROM},
    )


def _bins(sensor: MeasuredSensor, spread: float) -> Iterator[_SeenBin]:
    elevation = sensor.elevations
    down = np.flatnonzero(elevation < 0.0)
    distance = sensor.height / np.sin(-elevation[down])
    steps = max(1, round(360.0 / sensor.beams.azimuth_step_deg))
    for one in sensor.ground_by_range_m:
        rings = np.flatnonzero((distance >= one.low) & (distance < one.high))
        if not (one.low >= NEAREST and one.high <= FARTHEST and len(rings) and one.share > 0.0):
            continue
        reach = distance[rings]
        azimuth = np.radians(sensor.beams.azimuth_offset_deg)[down[rings], None] + 2 * np.pi / steps * np.arange(steps)
        level = np.sqrt(reach**2 - sensor.height**2)[:, None]
        ground = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.zeros(azimuth.shape)], axis=-1)
        reflected = ground_reflected(sensor, reach)
        law = _law_of_share(reach, reflected, spread, min(one.share, _MOST_SHARE))
        chances = [
            law.chance(
                np.repeat(reach, steps),
                np.repeat(reflected, steps),
                surface_deviation(ground.reshape(-1, 3), (surface,)),
            ).reshape(azimuth.shape)
            for surface in range(_SURFACES)
        ]
        yield _SeenBin(one, np.array(chances))


def _law_of_share(distance: Float, reflected: Float, spread: float, share: float) -> RangeEquation:
    """Return the law without a ceiling that detects a share of some rays, by halving."""
    low, high = -60.0, 20.0
    law = RangeEquation(0.0, spread, 1.0)
    for _ in range(60):
        law = replace(law, threshold=(low + high) / 2.0)
        if float(law.chance(distance, reflected).mean()) > share:
            low = law.threshold
        else:
            high = law.threshold
    return law
