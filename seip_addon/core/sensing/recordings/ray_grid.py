"""Rays of a spinning LiDAR, recovered from the angles of recorded points.

Most file formats hold points without the ray that each belongs to. The rays are needed twice: the background is a range
for each ray, and a ray without a return is a measurement too. A spinning LiDAR sends its rays along rings of constant
elevation, at a constant step of azimuth, so both follow from the angles of the points.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float, Integer
from ...base.errors import SeipError
from ..lidar.model import LidarModel

_BIN = math.radians(0.01)  # width of a bin of the histogram of elevations
_BLUR = 2  # bins: standard deviation of its smoothing, for files that round coordinates
_LEAST_GAP = 5  # bins between two rings
_LEAST_PEAK = 0.05  # share of the median peak below which a peak is stray points
_HALF_GAP = math.radians(1.0)  # reach of the outermost rings
_MAX_DEVIATION = 0.4  # of points from their ring, as a share of half the gap; uniform elevations have 0.5
_LEAST_RANGE = 3.0  # metres of points from which rays are recovered
_LEAST_POINTS = 1000  # points from which rings can be recovered
_STEP_RINGS = 20  # from which the azimuth step is recovered
_SAME_RAY = 1e-5  # radians between points of one ray
_STEP_ERROR = 0.1  # share by which jitter changes the usual gap at most
_AZIMUTH_BINS = 1 << 18
_LEAST_POWER = 4.0  # of azimuths that lie on steps; that of random ones is 1
_LEAST_RINGS = 0.5  # share of the model's channels between the outermost rings that must have a ring
_TOLERANCE = math.radians(3.0)  # elevation by which a unit may exceed its model's field of view


@dataclass(frozen=True, eq=False)
class RayGrid:
    """Rays of one revolution: c rings of s azimuth steps, r = c·s rays, ring after ring.

    Parameters
    ----------
    elevation : (c,) float64, radians
        Elevation of each ring, ascending.
    phase : (c,) float64, radians
        Azimuth of step 0 of each ring.
    steps : int
        Azimuth steps in a full circle.
    """

    elevation: Float
    phase: Float
    steps: int

    def __len__(self) -> int:
        return len(self.elevation) * self.steps

    def rays(self, points: NDArray[np.float32]) -> Integer:
        """Return the ray of each point (n, 3) in the sensor's axes, (n,) int64."""
        azimuth, elevation = _angles(points)
        ring = np.searchsorted((self.elevation[1:] + self.elevation[:-1]) / 2, elevation)
        step = np.rint((azimuth - self.phase[ring]) * (self.steps / math.tau)).astype(np.int64) % self.steps
        rays: Integer = ring * self.steps + step
        return rays

    def ranges(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the range of each ray's nearest point, (r,) float32, metres; infinite without a return."""
        found = np.full(len(self), np.inf, dtype=np.float32)
        np.minimum.at(found, self.rays(points), np.linalg.norm(points, axis=1))
        return found

    def directions(self) -> Float:
        """Return the directions of all rays, (r, 3) float64, in the sensor's axes."""
        azimuth = (self.phase[:, None] + np.arange(self.steps) * (math.tau / self.steps)).ravel()
        elevation = np.repeat(self.elevation, self.steps)
        level = np.cos(elevation)
        return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1)


def recovered_rays(sweeps: Sequence[NDArray[np.float32]], model: LidarModel, name: str) -> RayGrid:
    """Recover the rays of a sensor from some of its sweeps.

    Parameters
    ----------
    sweeps : sequence of (n, 3) float32, metres
        Points in the sensor's axes.
    model : LidarModel
        Model of the sensor, against which the rays are checked.
    name : str
        Name of the recording, for messages.

    Raises
    ------
    SeipError
        There are too few points, they lie on no rings, the rings are not those of the model, or their azimuths are of
        more than one revolution.
    """
    # Files round coordinates, which turns the directions of near points most.
    sweeps = [points[np.linalg.norm(points, axis=1) >= _LEAST_RANGE] for points in sweeps]
    azimuth, elevation = _angles(np.concatenate(sweeps))
    if len(elevation) < _LEAST_POINTS:
        raise SeipError(f"{name} has {len(elevation):,} points: its rays cannot be recovered from so few")
    rings = _rings(elevation)
    ring = np.searchsorted((rings[1:] + rings[:-1]) / 2, elevation)
    _check_rings(rings, ring, elevation, name)
    _check_model(rings, model, name)
    sweep = np.repeat(np.arange(len(sweeps)), [len(points) for points in sweeps])
    steps = _azimuth_steps(azimuth, sweep * len(rings) + ring, name)
    # Azimuths of a ring are equal modulo the step: the mean of the angles on the circle of one step is its phase.
    turns = np.exp(1j * azimuth * steps)
    mean = np.bincount(ring, turns.real, len(rings)) + 1j * np.bincount(ring, turns.imag, len(rings))
    return RayGrid(rings, np.angle(mean) / steps, steps)


def _angles(points: NDArray[np.float32]) -> tuple[Float, Float]:
    x, y, z = points.astype(np.float64).T
    return np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))


def _rings(elevation: Float) -> Float:
    """Return the elevations at which points accumulate, ascending."""
    first = elevation.min() - _LEAST_GAP * _BIN
    place = (elevation - first) / _BIN
    count = np.bincount(place.astype(np.int64))
    reach = 3 * _BLUR
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / _BLUR) ** 2)
    smooth = np.convolve(np.pad(count.astype(np.float64), reach), kernel, mode="valid")
    # A peak is the highest bin within the least gap to both sides.
    padded = np.pad(smooth, _LEAST_GAP)
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * _LEAST_GAP + 1)
    peak = np.flatnonzero((smooth > 0) & (np.argmax(around, axis=1) == _LEAST_GAP))
    peak = peak[smooth[peak] > _LEAST_PEAK * np.median(smooth[peak])]
    # The mean of the points next to a peak is more exact than the middle of its bin.
    nearest = np.searchsorted((peak[1:] + peak[:-1]) / 2 + 0.5, place)
    close = np.abs(place - peak[nearest] - 0.5) <= _LEAST_GAP
    rings: Float = np.bincount(nearest[close], elevation[close], len(peak)) / np.bincount(nearest[close])
    return rings


def _check_rings(rings: Float, ring: Integer, elevation: Float, name: str) -> None:
    gap = np.minimum(np.diff(rings, prepend=-np.inf), np.diff(rings, append=np.inf))
    half = np.minimum(gap / 2, _HALF_GAP)
    deviation = np.minimum(np.abs(elevation - rings[ring]) / half[ring], 1.0)
    if len(rings) < 2 or deviation.mean() > _MAX_DEVIATION:
        raise SeipError(
            f"the points of {name} do not lie on rings around the sensor: give the cloud of each sensor on its own, "
            "in the sensor's axes"
        )


def _check_model(rings: Float, model: LidarModel, name: str) -> None:
    low, high = model.elevations.min() - _TOLERANCE, model.elevations.max() + _TOLERANCE
    # Rings without any return are missing, as those towards the sky, but hardly any between others.
    within = int(((model.elevations >= rings[0] - _BIN) & (model.elevations <= rings[-1] + _BIN)).sum())
    few = len(rings) < _LEAST_RINGS * within
    if few or len(rings) > model.channels or rings[0] < low or rings[-1] > high:
        raise SeipError(
            f"{name} has {len(rings)} rings between {math.degrees(rings[0]):.1f} and {math.degrees(rings[-1]):.1f} "
            f"degrees, but {model.name} has {model.channels} channels between "
            f"{math.degrees(model.elevations.min()):.1f} and {math.degrees(model.elevations.max()):.1f}: name the "
            "sensor that made the recording"
        )


def _azimuth_steps(azimuth: Float, group: Integer, name: str) -> int:
    """Return the azimuth steps in a full circle, from the fullest groups of points of one ring and one sweep."""
    count = np.bincount(group)
    rings = [np.sort(azimuth[group == one]) for one in np.argsort(-count, kind="stable")[:_STEP_RINGS].tolist()]
    # Second returns share a ray with first ones.
    gaps = [np.median(found) for found in (gap[gap > _SAME_RAY] for gap in map(np.diff, rings)) if len(found)]
    if not gaps:
        return 1
    # Jitter and rounding change the usual gap by some per cent. At the true number of steps n the angles n times the
    # azimuth of a ring agree, and the sum of their unit vectors is longest: it is a term of the Fourier series of the
    # histogram of azimuths.
    rough = math.tau / float(np.median(gaps))
    if math.ceil(rough * (1 + _STEP_ERROR)) > _AZIMUTH_BINS // 2:
        raise SeipError(
            f"{name} has about {rough:,.0f} azimuths in a revolution, as many revolutions in one sweep have: give each "
            "revolution on its own"
        )
    power = np.zeros(_AZIMUTH_BINS // 2 + 1)
    for ring in rings:
        place = np.floor(ring * (_AZIMUTH_BINS / math.tau)).astype(np.int64) % _AZIMUTH_BINS
        power += np.abs(np.fft.rfft(np.bincount(place, minlength=_AZIMUTH_BINS))) ** 2 / len(ring)
    tried = np.arange(max(1, math.floor(rough * (1 - _STEP_ERROR))), math.ceil(rough * (1 + _STEP_ERROR)) + 1)
    best = int(tried[np.argmax(power[tried])])
    return best if power[best] > _LEAST_POWER * len(rings) else round(rough)
