"""Correlation of the fates of rays on level ground (returned or lost), along a ring and from sweep to sweep."""

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
"""Range in metres beyond which fates are correlated over sweeps; at shorter ranges hardly any ray is lost."""

_SURFACES = 16
_MOST_SHARE = 0.9995
"""Number of drawn surfaces, and the largest share used: if no ray is lost, fates do not vary."""


@dataclass(frozen=True)
class FateCorrelation:
    """Correlation of fates by lag, and the intraclass correlation over sweeps by bin."""

    along_ring: dict[int, float]
    over_sweeps: dict[str, float]


@dataclass(frozen=True, eq=False)
class _SeenBin:
    """A measured bin with the simulated chances (surfaces, rings, steps) that its rays return."""

    bin: ShareBin
    chance: Float

    @property
    def variance(self) -> float:
        """Variance of one fate: P (1 − P) of the mean chance P."""
        mean = float(self.chance.mean())
        return mean * (1.0 - mean)

    def covariance(self, lag: int) -> float:
        """Return the covariance of the fates of rays `lag` steps apart; with lag 0, of one ray in two sweeps."""
        rest = self.chance - self.chance.mean()
        return float((rest * np.roll(rest, -lag, axis=-1)).mean())


def simulate_fates(sensor: MeasuredSensor, spread: float, lags: Sequence[int]) -> FateCorrelation:
    """Return the correlation of fates if surfaces deviate patch by patch (`surface_deviation`).

    The sensor's beams sweep level ground at its height. The correlation depends on the share of rays that return, so
    in each bin the threshold is set to reproduce the measured share, without losses that do not depend on power. Each
    ray of each sweep is drawn independently, given its chance. The covariance of two fates is therefore the covariance
    of their chances. Bins are weighted by the number of rays measured in them.

    Parameters
    ----------
    spread : float
        Spread s of the law.
    lags : sequence of int
        Distances along the ring, in rays.
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
    """Return the law without a ceiling that detects a given share of the rays, by bisection of the threshold."""
    low, high = -60.0, 20.0
    law = RangeEquation(0.0, spread, 1.0)
    for _ in range(60):
        law = replace(law, threshold=(low + high) / 2.0)
        if float(law.chance(distance, reflected).mean()) > share:
            low = law.threshold
        else:
            high = law.threshold
    return law
