"""Windows of channels and azimuths in which an object can be hit."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Float, Integer
from ..lidar.azimuth_steps import steps_in_arcs
from ..lidar.model import LidarModel


class BeamWindows:
    """Finds the rays of a model that pass through the convex hulls of points, and few that do not.

    A ray is ``channel * azimuth_count + step``, as in `BeamPattern`.
    """

    def __init__(self, model: LidarModel) -> None:
        self._steps, self._reach = model.azimuth_count, model.max_range
        self._channel = np.argsort(model.elevations, kind="stable")
        self._slope = np.tan(model.elevations[self._channel])
        self._zero = model.azimuth_offsets + model.first_azimuth
        self._size, self._all_round = model.azimuth_step, model.all_round

    def rays_towards(self, points: Float) -> tuple[Integer, Integer]:
        """Find rays.

        Parameters
        ----------
        points : (k, m, 3) float64, metres
            m points of each of k hulls, in the sensor's axes.

        Returns
        -------
        hull : (p,) int64
            Ascending.
        ray : (p,) int64
            Each once for each hull.
        """
        middle, half, near = _azimuths(points)
        hull, channel = self._channels_at(points, near)
        arc, first, count = steps_in_arcs(
            middle[hull] - self._zero[channel],
            half[hull],
            np.full(len(hull), self._size),
            np.full(len(hull), self._steps),
            np.full(len(hull), self._all_round),
        )
        steps = _counted(first, count) % self._steps
        return np.repeat(hull[arc], count), np.repeat(channel[arc] * self._steps, count) + steps

    def _channels_at(self, points: Float, near: Float) -> tuple[Integer, Integer]:
        """Pairs of hulls and of channels that somewhere over the hull's distances are at its height."""
        bottom, top = points[:, :, 2].min(axis=1), points[:, :, 2].max(axis=1)
        far = np.hypot(points[:, :, 0], points[:, :, 1]).max(axis=1)
        with np.errstate(divide="ignore"):  # nought metres away everything is straight above or below
            least = bottom / np.where(bottom < 0, near, far)
            most = top / np.where(top > 0, near, far)
        low = np.searchsorted(self._slope, least)
        count = np.maximum(np.searchsorted(self._slope, most, side="right") - low, 0)
        count[near > self._reach] = 0
        return np.repeat(np.arange(len(points)), count), self._channel[_counted(low, count)]


def _azimuths(points: Float) -> tuple[Float, Float, Float]:
    """Middle and half of the arc in which each hull is seen, and a bound to its distance in plan, (k,) each.

    Seen from outside, a hull's arc is that of its points, less than half a
    turn. Seen from within, its points lie on all sides, and at least half a turn apart.
    """
    x, y = points[:, :, 0], points[:, :, 1]
    centre = np.arctan2(y.mean(axis=1), x.mean(axis=1))
    turn = (np.arctan2(y, x) - centre[:, None] + math.pi) % (2 * math.pi) - math.pi
    low, high = turn.min(axis=1), turn.max(axis=1)
    middle, half = centre + (low + high) / 2, (high - low) / 2
    along = x * np.cos(middle)[:, None] + y * np.sin(middle)[:, None]
    within = half >= math.pi / 2
    return middle, np.where(within, math.pi, half), np.where(within, 0.0, np.maximum(along.min(axis=1), 0.0))


def _counted(first: Integer, count: Integer) -> Integer:
    """Return first, first + 1, … for each pair of a first number and a count, one after the other."""
    numbers: Integer = np.arange(count.sum()) + np.repeat(first - (np.cumsum(count) - count), count)
    return numbers
