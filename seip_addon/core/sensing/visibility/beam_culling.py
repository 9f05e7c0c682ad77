r"""Beam culling: the rays of a scan that can return from near a target.

Returns within δ of a target lie in its patch: an upright cylinder of radius δ about it, between the heights at which
there are surfaces (`near_surfaces`). A channel of slope σ = tan φ is between these heights only at distances r in plan
from r₁ to r₂. The part of that annulus inside the cylinder, whose axis is at the distance L, is an arc of azimuths
about the target's. By the law of cosines its half-width is

.. math::

    Δ = \arccos \frac{L^2 + r^2 - δ^2}{2 L r},
    \quad r = \operatorname{clip}\left(\sqrt{L^2 - δ^2}, r_1, r_2\right)

A target whose surfaces return too little light, wherever they are met, needs no ray at all (`may_return`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np

from ...base.arrays import Boolean, Float, Integer
from ..lidar.beam_windows import channels_between, steps_in_arcs
from ..lidar.model import LidarModel
from .near_surfaces import NearSurfaces
from .settings import VisibilitySettings

_MARGIN = 1e-9  # radians; one ray too many costs a cast, one too few makes the grid wrong


@dataclass(frozen=True, eq=False)
class NearRays:
    """The rays that can return from near targets: bundles of neighbouring azimuth steps of a channel.

    Parameters
    ----------
    target : (k,) int64
        Target of each bundle.
    channel : (k,) int64
        Channel of each bundle.
    first : (k,) int64
        First azimuth step; it may be negative or beyond the revolution if the channel goes all round.
    width : (k,) int64
        Number of steps, at least 1.
    """

    target: Integer
    channel: Integer
    first: Integer
    width: Integer

    def __len__(self) -> int:
        return len(self.target)

    @property
    def middle(self) -> Integer:
        """The middle step of each bundle, (k,) int64."""
        return self.first + (self.width - 1) // 2

    def pick(self, which: Boolean | Integer) -> NearRays:
        """Return some of the bundles."""
        return NearRays(*(getattr(self, field.name)[which] for field in fields(self)))

    def beside_middle(self) -> NearRays:
        """Return the halves to the left and right of the middle rays."""
        # bundles of one ray have no halves and end here; those of two have one
        before = (self.width - 1) // 2
        after = self.width - 1 - before
        right, left = np.flatnonzero(before), np.flatnonzero(after)
        first = np.concatenate([self.first[right], (self.first + before + 1)[left]])
        width = np.concatenate([before[right], after[left]])
        return replace(self.pick(np.concatenate([right, left])), first=first, width=width)


def may_return(origin: Float, surfaces: NearSurfaces, model: LidarModel, settings: VisibilitySettings) -> Boolean:
    r"""Return the mask of targets from which returns can be strong enough for a sensor, (t,) bool.

    It is true for all of these targets and for few others. A return lies off its plane, at the distance k, by at most
    the tolerance ε. A ray that meets the plane at r has the cosine k / r, so that the distance of the return differs
    from r by at most the share x = ε / k.

    Parameters
    ----------
    origin : (3,) float64, metres
        Position of the sensor.
    """
    least = settings.least_strength(model)
    may = np.full(len(surfaces.xyz), least == 0)
    if least == 0:
        return may
    cuts, tolerance = surfaces.cuts, surfaces.tolerance
    away = cuts.middle - origin
    height = np.abs((away * cuts.normal).sum(axis=1))
    nearest = np.linalg.norm(away, axis=1) - cuts.radius - tolerance
    # A plane nearer than the tolerance gives x = 1 and an infinite reach: nothing is culled there. A quotient without a
    # value (0/0, inf - inf) also leaves the target. Errors are only allowed on this side.
    share = tolerance / np.maximum(height, tolerance)
    with np.errstate(divide="ignore", invalid="ignore"):
        slack = (1 + share) / (1 - share) * (1 + _MARGIN)
        beyond = nearest > model.law.farthest_on_planes(cuts.reflectivity, height, least) * slack
    may[cuts.target[~beyond]] = True
    return may


def near_rays(model: LidarModel, origin: Float, yaw: float, surfaces: NearSurfaces, selected: Boolean) -> NearRays:
    """Find the rays of a sensor that can return from near selected targets, (t,) bool.

    Parameters
    ----------
    origin : (3,) float64, metres
        Position of the sensor.
    yaw : float, radians
        Direction of azimuth zero.

    Returns
    -------
    NearRays
        All rays that can return from a patch, and few that cannot.
    """
    target = np.flatnonzero(selected & (surfaces.low <= surfaces.high))
    x, y, _ = (surfaces.xyz[target] - origin).T
    bottom, top = surfaces.low[target] - origin[2], surfaces.high[target] - origin[2]
    patch_distance, radius = np.hypot(x, y), surfaces.radius
    patch, channel = channels_between(
        model, bottom, top, np.maximum(patch_distance - radius, 0.0), patch_distance + radius
    )
    slope, distance = np.tan(model.elevations)[channel], patch_distance[patch]
    begin, end = _between_heights(slope, bottom[patch], top[patch])
    # fmax and fmin ignore NaN, the value of level beams within the heights: for these only the cylinder limits r
    begin = np.fmax(begin, np.maximum(distance - radius, 0.0))
    end = np.fmin(end, distance + radius)
    half_width = _half_width(distance, begin, end, radius)
    # The range is measured along the ray, from `begin` at least to the far end at the greatest depth at most: both
    # tests keep an arc if any of it may be within range.
    depth = np.maximum(np.abs(bottom), np.abs(top))[patch]
    in_range = (begin <= model.max_range) & (np.hypot(end, depth) >= model.min_range)
    some = np.flatnonzero((begin <= end) & in_range)
    patch, channel = patch[some], channel[some]
    zero = yaw + model.azimuth_offsets + model.first_azimuth
    azimuth = np.arctan2(y, x)[patch] - zero[channel]
    arc, first, width = steps_in_arcs(
        azimuth, half_width[some], model.azimuth_step, model.azimuth_count, all_round=model.all_round
    )
    return NearRays(target[patch[arc]], channel[arc], first, width)


def _between_heights(slope: Float, bottom: Float, top: Float) -> tuple[Float, Float]:
    """Return the distances in plan at which a beam enters and leaves heights; NaN where it is always between them."""
    slope = slope + 0.0  # the slope of a level beam may be -0.0, whose quotients have the wrong sign
    with np.errstate(divide="ignore", invalid="ignore"):
        at_bottom, at_top = bottom / slope, top / slope
    return np.where(slope < 0, at_top, at_bottom), np.where(slope < 0, at_bottom, at_top)


def _half_width(distance: Float, begin: Float, end: Float, radius: float) -> Float:
    """Return half the arc of an annulus within a circle; π from within the circle."""
    # Seen from outside, a circle is widest at the tangent length √(L² - δ²). If the annulus does not contain that, the
    # arc is widest at the end of the annulus that is nearer to it.
    widest = np.clip(np.sqrt(np.maximum(distance**2 - radius**2, 0.0)), begin, end)
    outside = distance > radius
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = (distance**2 + widest**2 - radius**2) / (2 * distance * widest)
    return np.where(outside, np.arccos(np.clip(np.where(outside, cosine, 0.0), -1, 1)), math.pi) + _MARGIN
