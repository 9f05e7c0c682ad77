"""Background of a recording: the usual range of each ray.

A roadside sensor does not move, so everything that stands still gives each of its rays the same range in every sweep.
Returns that are clearly nearer are road users.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Boolean, Float
from ...base.counts import counted
from ...base.errors import SeipError
from ...base.progress import Progress
from ..lidar.model import LidarModel
from .ray_grid import RayGrid, recovered_rays
from .recording import SensorRecording

LEAST_SWEEPS = 5
"""Sweeps below which standing and moving things cannot be told apart."""

MARGIN, MARGIN_SHARE, SPREADS = 0.15, 0.003, 2.0
"""Metres, share of the range, and multiple of the spread, whose sum is the margin of a range.

In recordings of a roadside LiDAR the median with this margin left the fewest false boxes.
"""

Ranges = TypeVar("Ranges", NDArray[np.float32], Float)

LEAST_HEIGHT = 0.25
"""Metres above the ground from which a point of a ray without a background is a road user."""

_MOST_SWEEPS = 40  # from which the background is learned, spread over the recording: bounds memory
_RING_SWEEPS = 10  # from which the rays are recovered
_MAX_SPREAD = 0.5  # metres: a larger spread is traffic rather than leaves, and must not hide it
_LEAST_AGREEMENT = 0.15  # share of sweeps that must agree in a ray's range for it to be background
_MOST_ALTERNATIONS = 0.5  # of near and far ranges behind queues, as a share of those of independent ranges
_CERTAIN = 0.6  # share of a ray's returns that agree, from which its background is certain
_FEW_SWEEPS, _SHORT, _MAX_UNCERTAIN = 20, 20.0, 0.1  # sweeps, seconds and share of rays at which confidence is limited


@dataclass(frozen=True, eq=False)
class Background:
    """Static surroundings of one sensor; r rays.

    Parameters
    ----------
    rays : RayGrid
        Rays of the sensor.
    usual : (r,) float32, metres
        Usual range of each ray; NaN if there is none.
    spread : (r,) float32, metres
        Standard deviation of that range (1.48 times the median absolute deviation), at most 0.5 m.
    returned : (r,) float32, 0 to 1
        Share of the sweeps with a return from the usual range or beyond, without those in which a road user stopped the
        ray.
    agreement : (r,) float32, 0 to 1
        Share of all returns of each ray that are at its usual range; NaN without returns.
    sweeps : int
        Sweeps from which it was learned.
    seconds : float
        Time between the first and the last of them.
    """

    rays: RayGrid
    usual: NDArray[np.float32]
    spread: NDArray[np.float32]
    returned: NDArray[np.float32]
    agreement: NDArray[np.float32]
    sweeps: int
    seconds: float

    def foreground(self, points: NDArray[np.float32], height: Float) -> Boolean:
        """Return which points (n, 3) in the sensor's axes are nearer than the background, (n,) bool.

        Points of rays without a background are foreground from `LEAST_HEIGHT` on: most rays without one meet distant
        road, which returns them in few sweeps.

        Parameters
        ----------
        height : (n,) float64, metres
            Height of each point above the ground.
        """
        ray = self.rays.rays(points)
        measured = np.linalg.norm(points, axis=1)
        usual = self.usual[ray]
        unknown = np.isnan(usual) & (height >= LEAST_HEIGHT)
        foreground: Boolean = unknown | (measured < usual - range_margin(usual, self.spread[ray]))
        return foreground

    def points(self) -> Float:
        """Return the background as points (n, 3) float64 in the sensor's axes, for the rays that have one."""
        known = np.flatnonzero(np.isfinite(self.usual))
        found: Float = self.rays.directions()[known] * self.usual[known, None].astype(np.float64)
        return found

    @property
    def uncertain(self) -> float:
        """Share of the rays with returns whose background is not certain."""
        returning = self.agreement[np.isfinite(self.agreement)]
        return float((returning < _CERTAIN).mean()) if len(returning) else 1.0

    def confidence(self, name: str) -> str:
        """Return a sentence on how reliable the background is."""
        return (
            f"{name}: background from {self.sweeps} sweeps over {self.seconds:.0f} s; "
            f"{1 - self.uncertain:.0%} of the rays with returns have a certain range"
        )

    def warnings(self, name: str) -> tuple[str, ...]:
        """Return warnings about a short or busy recording."""
        found = []
        if self.sweeps < _FEW_SWEEPS or self.seconds < _SHORT:
            found.append(
                f"{name}: {self.sweeps} sweeps over {self.seconds:.0f} s are few: vehicles that stand still for half "
                f"of that time count as background; record {_SHORT:.0f} s or more"
            )
        if self.uncertain > _MAX_UNCERTAIN:
            found.append(
                f"{name}: the background of {self.uncertain:.0%} of the rays is uncertain, because of traffic that "
                "stands or of leaves: record for longer, or when there is less traffic"
            )
        return tuple(found)


def learn_background(record: SensorRecording, model: LidarModel) -> Generator[Progress, None, Background]:
    """Learn the background from sweeps spread over a recording.

    Yields
    ------
    Progress
        Number of sweeps read.

    Raises
    ------
    SeipError
        There are too few sweeps, or they do not fit the model (`recovered_rays`).
    """
    if len(record) < LEAST_SWEEPS:
        raise SeipError(
            f"{record.name} has {counted(len(record), 'sweep')}: the background needs {LEAST_SWEEPS} or more"
        )
    chosen = _spread_evenly(len(record), _MOST_SWEEPS)
    total = len(chosen)
    what = f"learning the background of {record.name}"
    some = [record.sweep(int(chosen[place])).points for place in _spread_evenly(total, _RING_SWEEPS)]
    rays = recovered_rays(some, model, record.name)
    ranges = np.empty((total, len(rays)), dtype=np.float32)
    for done, number in enumerate(chosen.tolist()):
        yield Progress(done, total, what)
        ranges[done] = rays.ranges(record.sweep(number).points)
    yield Progress(total, total, what)
    times = record.times[chosen]
    return background_of(rays, ranges, float(times[-1] - times[0]))


def background_of(rays: RayGrid, ranges: NDArray[np.float32], seconds: float) -> Background:
    """Return the background of ranges (sweeps, r), which are infinite without a return."""
    sweeps = len(ranges)
    hit = np.isfinite(ranges)
    returns = hit.sum(axis=0)
    # Ascending along the sweeps, with the missing returns at the end: the median of the returns is in the middle of
    # those that exist, whatever their number.
    ascending = np.sort(ranges, axis=0)
    usual = _median(ascending, returns)
    usual[returns == 0] = np.nan
    behind = _behind_queues(ranges, ascending, returns)
    # Road users in front of a surface pull the median of all returns towards the sensor by millimetres.
    usual = _median_around(ranges, np.where(behind > usual + range_margin(usual, 0.0), behind, usual))
    deviation = np.abs(ranges - usual)
    spread = np.minimum(1.4826 * _median(np.sort(deviation, axis=0), returns), np.float32(_MAX_SPREAD))
    margin = range_margin(usual, spread)
    agreeing = (deviation <= margin).sum(axis=0)
    # A sweep in which a road user stopped the ray says nothing about the surface behind it. Returns beyond the margin
    # count: left out, one in some hundred is missing, as if the sensor received less power.
    near = (hit & (ranges < usual - margin)).sum(axis=0)
    known = agreeing >= max(min(3, sweeps), _LEAST_AGREEMENT * sweeps)
    with np.errstate(invalid="ignore"):
        agreement = np.where(returns > 0, agreeing / np.maximum(returns, 1), np.nan)
    return Background(
        rays=rays,
        usual=np.where(known, usual, np.nan).astype(np.float32),
        spread=np.where(known, spread, 0.0).astype(np.float32),
        returned=((returns - near) / np.maximum(sweeps - near, 1)).astype(np.float32),
        agreement=agreement.astype(np.float32),
        sweeps=sweeps,
        seconds=seconds,
    )


def _behind_queues(
    ranges: NDArray[np.float32], ascending: NDArray[np.float32], returns: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Return the range of the surface behind vehicles that stood for most of the recording, (r,); otherwise -infinity.

    Where vehicles queue, the usual range is that of a vehicle, but some sweeps agree in a farther range. The same holds
    at edges and in leaves, which rays hit or miss at random. A queue is told from these by time: it stops a ray in
    successive sweeps, so that near and far ranges alternate much less often than independent ones would.
    """
    sweeps = len(ranges)
    support = max(3, round(_LEAST_AGREEMENT * sweeps))
    place = np.clip(returns - 1 - support // 2, 0, sweeps - 1)
    far = np.take_along_axis(ascending, place[None], axis=0)[0]
    far[returns < support] = np.nan
    margin = range_margin(far, 0.0)
    agreeing = (np.abs(ranges - far) <= margin).sum(axis=0)
    near = ranges < far - margin
    share = near.mean(axis=0)
    alternations = (near[1:] != near[:-1]).sum(axis=0)
    steady = alternations < _MOST_ALTERNATIONS * 2 * share * (1 - share) * (sweeps - 1)
    return np.where((agreeing >= support) & steady, far, -np.inf).astype(np.float32)


def _median_around(ranges: NDArray[np.float32], middle: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the median of each column's ranges near a given one; NaN if that is."""
    near = np.where(np.abs(ranges - middle) <= range_margin(middle, 0.0), ranges, np.float32(np.inf))
    found = _median(np.sort(near, axis=0), np.isfinite(near).sum(axis=0))
    found[np.isnan(middle)] = np.nan
    return found


def range_margin(usual: Ranges, spread: NDArray[np.float32] | float) -> Ranges:
    """Return the difference from which a range (r,) is not that of the surface, metres.

    Parameters
    ----------
    usual : (r,) float, metres
        Range of the surface.
    spread : (r,) float or float, metres
        Standard deviation of the measured ranges.
    """
    margin: Ranges = MARGIN + MARGIN_SHARE * usual + SPREADS * spread
    return margin


def _median(ascending: NDArray[np.float32], count: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return the median of the first ``count`` values of each column; infinite without any.

    Between two middle values that are far apart there is no surface: the nearer one counts.
    """
    last = len(ascending) - 1
    upper = np.take_along_axis(ascending, np.minimum(count // 2, last)[None], axis=0)[0]
    lower = np.take_along_axis(ascending, np.clip((count - 1) // 2, 0, last)[None], axis=0)[0]
    with np.errstate(invalid="ignore"):
        found: NDArray[np.float32] = np.where(upper - lower > MARGIN, lower, (lower + upper) / 2)
    return found


def _spread_evenly(count: int, most: int) -> NDArray[np.int64]:
    """Return at most so many of the numbers from 0 on, from the first to the last."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))
