r"""Which rays of a scan can matter to which targets.

A return within δ of a target lies on a ray that passes within δ of it. From the
sensor the ball of radius δ about a target at distance d is the cap of half-angle
α = arcsin(δ/d), so a ray needs casting only if its angle to the target is at
most α. In a channel of elevation φ that is one interval of azimuths about the
target's; its half-width Δ follows from the spherical law of haversines, with e
the target's elevation:

.. math::

    \sin^2\frac{Δ}{2} = \frac{\sin^2\frac{α}{2} - \sin^2\frac{φ - e}{2}}{\cos φ \cos e}
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .lidar import LidarModel

Float = NDArray[np.float64]
Integer = NDArray[np.int64]
Boolean = NDArray[np.bool_]

# How much too wide intervals are, against rounding. A ray too many costs a cast, a ray too few a wrong grid.
_RELATIVE_MARGIN = 1e-6
_MARGIN = 1e-9  # radians


@dataclass(frozen=True, eq=False)
class NearRays:
    """The rays that pass within δ of targets, as azimuth intervals of channels.

    Parameters
    ----------
    shape : tuple of int
        Channels and azimuth steps of the scan; ray = channel * steps + step.
    target : (k,) int64
        Target of each interval, ascending.
    channel : (k,) int64
    first : (k,) int64
        First azimuth step, at least 0 and less than the number of steps.
    width : (k,) int64
        Number of steps, which may run on past the end of the revolution.
    likeliest : (k,) int64
        The ray of the interval that would end nearest the target if the road went on level from there.
    miss : (k,) float64, metres
        Distance from the target at which it would end; infinite if it does not come down.
    """

    shape: tuple[int, int]
    target: Integer
    channel: Integer
    first: Integer
    width: Integer
    likeliest: Integer
    miss: Float

    def rays(self, wanted: Boolean) -> Boolean:
        """Mark the rays that pass near wanted targets.

        Parameters
        ----------
        wanted : (t,) bool

        Returns
        -------
        (channels * steps,) bool
        """
        channels, steps = self.shape
        pick = wanted[self.target]
        channel, first = self.channel[pick], self.first[pick]
        end = first + self.width[pick]
        over = end > steps  # the part past the seam starts again at step 0
        row = channel * (steps + 1)
        opened = np.concatenate([row + first, row[over]])
        closed = np.concatenate([row + np.minimum(end, steps), row[over] + end[over] - steps])
        size = channels * (steps + 1)
        depth = np.cumsum(np.bincount(opened, minlength=size) - np.bincount(closed, minlength=size))
        marked: Boolean = depth.reshape(channels, steps + 1)[:, :steps].ravel() > 0
        return marked

    def likeliest_rays(self, within: float) -> Integer:
        """Return for each target the ray that should end nearest to it, if nearer than ``within`` metres.

        Returns
        -------
        (r,) int64
            Ascending, each ray once.
        """
        if len(self.target) == 0:
            return np.zeros(0, dtype=np.int64)
        starts = np.flatnonzero(np.diff(self.target, prepend=-1))
        least = np.minimum.reduceat(self.miss, starts)
        best = self.miss == np.repeat(least, np.diff(starts, append=len(self.target)))
        rays: Integer = np.unique(self.likeliest[best & (self.miss < within)])
        return rays


def near_rays(model: LidarModel, yaw: float, offsets: Float, delta: float) -> NearRays:
    """Find the rays of a scan that pass within ``delta`` of targets.

    Parameters
    ----------
    model : LidarModel
    yaw : float, radians
        Direction of azimuth zero.
    offsets : (t, 3) float64, metres
        Targets less the sensor's position.
    delta : float, metres

    Returns
    -------
    NearRays
        All that pass, and those that miss by up to a millionth of ``delta``.
    """
    level = np.hypot(offsets[:, 0], offsets[:, 1])
    distance = np.hypot(level, offsets[:, 2])
    elevation = np.arctan2(offsets[:, 2], level)
    cap = _cap_half_angle(distance, delta)
    reachable = (distance - delta <= model.max_range * (1 + _RELATIVE_MARGIN)) & (
        distance + delta >= model.min_range * (1 - _RELATIVE_MARGIN)
    )

    order = np.argsort(model.elevations, kind="stable")
    ascending = model.elevations[order]
    low = np.searchsorted(ascending, elevation - cap)
    count = np.where(reachable, np.searchsorted(ascending, elevation + cap, side="right") - low, 0)
    target = np.repeat(np.arange(len(offsets)), count)
    within = np.arange(len(target)) - np.repeat(np.cumsum(count) - count, count)
    channel = order[low[target] + within]

    beam = model.elevations[channel]
    half_width = _azimuth_half_width(cap[target], beam, elevation[target])
    step = 2 * math.pi / model.azimuth_count
    azimuth = np.arctan2(offsets[:, 1], offsets[:, 0])[target] - yaw - model.azimuth_offsets[channel]
    first = np.ceil((azimuth - half_width) / step).astype(np.int64)
    last = np.floor((azimuth + half_width) / step).astype(np.int64)
    nearest = np.clip(np.rint(azimuth / step).astype(np.int64), first, last)
    miss = _miss_on_level_road(beam, level[target], offsets[target, 2], azimuth - nearest * step)

    some = last >= first
    steps = model.azimuth_count
    return NearRays(
        shape=(model.channels, steps),
        target=target[some],
        channel=channel[some],
        first=first[some] % steps,
        width=np.minimum(last - first + 1, steps)[some],
        likeliest=(channel * steps + nearest % steps)[some],
        miss=miss[some],
    )


def _cap_half_angle(distance: Float, delta: float) -> Float:
    """Half-angle under which a ball of radius delta is seen; π from within it."""
    sine = delta / np.maximum(distance, delta)
    angle = np.arcsin(sine) * (1 + _RELATIVE_MARGIN) + _MARGIN
    return np.where(distance > delta * (1 + _RELATIVE_MARGIN), angle, math.pi)


def _azimuth_half_width(cap: Float, beam: Float, elevation: Float) -> Float:
    haversine = np.sin(cap / 2) ** 2 - np.sin((beam - elevation) / 2) ** 2
    flatness = np.maximum(np.cos(beam) * np.cos(elevation), 1e-300)  # a target straight below is near all azimuths
    half: Float = 2 * np.arcsin(np.sqrt(np.clip(haversine / flatness, 0.0, 1.0))) + _MARGIN
    return half


def _miss_on_level_road(beam: Float, level: Float, rise: Float, aside: Float) -> Float:
    """Distance between a target and where a beam meets the horizontal plane through it."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        radius = rise / np.tan(beam)
        miss = np.hypot(radius - level, level * aside)
    return np.where(radius > 0, miss, np.inf)
