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
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from ...base.arrays import Boolean, Float, Integer, concatenated_ranges
from ..lidar.azimuth_steps import steps_in_arcs
from ..lidar.model import LidarModel
from .near_surfaces import NearSurfaces
from .settings import VisibilitySettings

_MARGIN = 1e-9  # radians; one ray too many costs a cast, one too few makes the grid wrong


@dataclass(frozen=True, eq=False)
class Patches:
    """Patches: regions in which returns near targets can lie, as seen from one position.

    Parameters
    ----------
    target : (p,) int64
        Target of each patch, ascending.
    azimuth : (p,) float64, radians
        Azimuth of the cylinder's axis, counter-clockwise from +x.
    distance : (p,) float64, metres
        Distance of the axis in plan.
    radius : (p,) float64, metres
        Radius of the cylinder.
    bottom, top : (p,) float64, metres
        Heights relative to the position; bottom > top where no return is possible.
    """

    target: Integer
    azimuth: Float
    distance: Float
    radius: Float
    bottom: Float
    top: Float


@dataclass(frozen=True, eq=False)
class Beams:
    """The channels of all sensors at one position, one after the other.

    Parameters
    ----------
    sensor : (c,) int64
        Number of the sensor that has the channel.
    elevation : (c,) float64, radians
        Elevation of the channel.
    zero : (c,) float64, radians
        Azimuth of step 0.
    steps : (c,) int64
        Azimuth steps of a revolution or frame.
    size : (c,) float64, radians
        Size of a step.
    all_round : (c,) bool
        Whether step 0 follows the last one.
    first_ray : (c,) int64
        Number of the ray at step 0. Rays of the same direction have the same number.
    min_range, max_range : (c,) float64, metres
        Range of the sensor.
    rays : int
        Number of different rays.
    """

    sensor: Integer
    elevation: Float
    zero: Float
    steps: Integer
    size: Float
    all_round: Boolean
    first_ray: Integer
    min_range: Float
    max_range: Float
    rays: int

    @classmethod
    def of(cls, models: Sequence[LidarModel], yaw: float) -> Beams:
        """Join the channels of models that have the same yaw.

        Channels with the same elevation, azimuth offset, number of steps and field of view have the same rays.
        """
        channels = [model.channels for model in models]
        elevation = np.concatenate([model.elevations for model in models])
        offset = np.concatenate([model.azimuth_offsets for model in models])
        steps = np.repeat([model.azimuth_count for model in models], channels)
        view = np.repeat([model.field_of_view for model in models], channels)
        # Sensors of one family differ in range or sensitivity and have the same beams. Numbering rays by distinct
        # channels lets such sensors share each cast ray.
        kinds, kind = np.unique(np.column_stack([elevation, offset, steps, view]), axis=0, return_inverse=True)
        end = np.cumsum(kinds[:, 2].astype(np.int64))
        return cls(
            sensor=np.repeat(np.arange(len(models)), channels),
            elevation=elevation,
            zero=yaw + offset + np.repeat([model.first_azimuth for model in models], channels),
            steps=steps,
            size=view / steps,
            all_round=np.repeat([model.all_round for model in models], channels),
            first_ray=(end - kinds[:, 2].astype(np.int64))[kind.ravel()],
            min_range=np.repeat([model.min_range for model in models], channels),
            max_range=np.repeat([model.max_range for model in models], channels),
            rays=int(end[-1]),
        )


@dataclass(frozen=True, eq=False)
class NearRays:
    """The rays that can return from near targets: bundles of neighbouring azimuth steps of a channel.

    Parameters
    ----------
    target : (k,) int64
        Target of each bundle.
    channel : (k,) int64
        Channel of each bundle, as in `Beams`.
    first : (k,) int64
        First azimuth step; it may be negative or beyond the revolution if the channel goes all round.
    width : (k,) int64
        Number of steps, at least 1.
    miss : (k,) float64, metres
        Distance in plan between the middle of the patch and the middle of the channel's part in it.
    """

    target: Integer
    channel: Integer
    first: Integer
    width: Integer
    miss: Float

    def __len__(self) -> int:
        return len(self.target)

    @property
    def middle(self) -> Integer:
        """The middle step of each bundle, (k,) int64."""
        return self.first + (self.width - 1) // 2

    def pick(self, which: Boolean | Integer) -> NearRays:
        """Return some of the bundles."""
        return NearRays(*(getattr(self, field.name)[which] for field in fields(self)))

    def likeliest(self, sensor: Integer) -> NearRays:
        """Return the bundle that should end nearest to the target, for each target and sensor.

        Parameters
        ----------
        sensor : (c,) int64
            Sensor of each channel.
        """
        # grouped minimum: one number for each pair of sensor and target; the first of equal bundles is taken
        number = sensor[self.channel] * (self.target.max(initial=0) + 1) + self.target
        least = np.full(number.max(initial=0) + 1, np.inf)
        np.minimum.at(least, number, self.miss)
        best = np.flatnonzero(self.miss == least[number])
        return self.pick(best[np.unique(number[best], return_index=True)[1]])

    def beside_middle(self) -> NearRays:
        """Return the halves to the left and right of the middle rays."""
        # bundles of one ray have no halves and end here; those of two have one
        before = (self.width - 1) // 2
        after = self.width - 1 - before
        right, left = np.flatnonzero(before), np.flatnonzero(after)
        first = np.concatenate([self.first[right], (self.first + before + 1)[left]])
        width = np.concatenate([before[right], after[left]])
        return replace(self.pick(np.concatenate([right, left])), first=first, width=width)


def may_return(
    origin: Float, surfaces: NearSurfaces, models: Sequence[LidarModel], settings: VisibilitySettings
) -> Boolean:
    r"""Return the mask of targets from which returns can be strong enough for each sensor, (models, t) bool.

    It is true for all of these targets and for few others. A return lies off its plane, at the distance k, by at most
    the tolerance ε. A ray that meets the plane at r has the cosine k / r, so that the distance of the return differs
    from r by at most the share x = ε / k.

    Parameters
    ----------
    origin : (3,) float64, metres
        Position of the sensors.
    """
    may = np.ones((len(models), len(surfaces.xyz)), dtype=bool)
    cuts, tolerance = surfaces.cuts, surfaces.tolerance
    away = cuts.middle - origin
    height = np.abs((away * cuts.normal).sum(axis=1))
    nearest = np.linalg.norm(away, axis=1) - cuts.radius - tolerance
    # A plane nearer than the tolerance gives x = 1 and an infinite reach: nothing is culled there. A quotient without a
    # value (0/0, inf - inf) also leaves the target. Errors are only allowed on this side.
    share = tolerance / np.maximum(height, tolerance)
    for sensor, model in enumerate(models):
        least = settings.least_strength(model)
        if least > 0:
            with np.errstate(divide="ignore", invalid="ignore"):
                slack = (1 + share) / (1 - share) * (1 + _MARGIN)
                beyond = nearest > model.law.farthest_on_planes(cuts.reflectivity, height, least) * slack
            may[sensor] = False
            may[sensor, cuts.target[~beyond]] = True
    return may


def target_patches(origin: Float, surfaces: NearSurfaces, selected: Boolean) -> Patches:
    """Return the patches of selected targets (t,) bool as seen from a position."""
    target = np.flatnonzero(selected)
    x, y, _ = (surfaces.xyz[target] - origin).T
    radius = np.full(len(target), surfaces.radius)
    bottom, top = surfaces.low[target] - origin[2], surfaces.high[target] - origin[2]
    return Patches(target, np.arctan2(y, x), np.hypot(x, y), radius, bottom, top)


def near_rays(beams: Beams, patches: Patches) -> NearRays:
    """Find the rays that can return from patches, as seen from the sensors.

    Returns
    -------
    NearRays
        All rays that can return from a patch, and few that cannot.
    """
    patch, channel = _channels_at(beams, patches)
    slope, distance, radius = np.tan(beams.elevation)[channel], patches.distance[patch], patches.radius[patch]
    begin, end = _between_heights(slope, patches.bottom[patch], patches.top[patch])
    # fmax and fmin ignore NaN, the value of level beams within the heights: for these only the cylinder limits r
    begin = np.fmax(begin, np.maximum(distance - radius, 0.0))
    end = np.fmin(end, distance + radius)
    half_width = _half_width(distance, begin, end, radius)
    # The range is measured along the ray, from `begin` at least to the far end at the greatest depth at most: both
    # tests keep an arc if any of it may be within range.
    depth = np.maximum(np.abs(patches.bottom), np.abs(patches.top))[patch]
    in_range = (begin <= beams.max_range[channel]) & (np.hypot(end, depth) >= beams.min_range[channel])
    some = np.flatnonzero((begin <= end) & in_range)
    patch, channel = patch[some], channel[some]
    arc, first, width = steps_in_arcs(
        patches.azimuth[patch] - beams.zero[channel],
        half_width[some],
        beams.size[channel],
        beams.steps[channel],
        beams.all_round[channel],
    )
    miss = np.abs((begin + end)[some] / 2 - patches.distance[patch])
    return NearRays(patches.target[patch[arc]], channel[arc], first, width, miss[arc])


def _channels_at(beams: Beams, patches: Patches) -> tuple[Integer, Integer]:
    """Return pairs of patches and of channels that are at the patch's heights somewhere in the cylinder."""
    # The slopes from the sensor to the patch's edges, each at the side of the cylinder where it is most extreme.
    # Channels between these slopes are one slice of all channels sorted by elevation.
    near = np.maximum(patches.distance - patches.radius, 0.0)
    far = patches.distance + patches.radius
    with np.errstate(divide="ignore"):
        least = patches.bottom / np.where(patches.bottom < 0, near, far)
        most = patches.top / np.where(patches.top > 0, near, far)
    order = np.argsort(beams.elevation, kind="stable")
    slopes = np.tan(beams.elevation[order])
    low = np.searchsorted(slopes, least)
    count = np.searchsorted(slopes, most, side="right") - low
    count = np.where((patches.bottom <= patches.top) & (near <= beams.max_range.max()), np.maximum(count, 0), 0)
    return np.repeat(np.arange(len(count)), count), order[concatenated_ranges(low, count)]


def _between_heights(slope: Float, bottom: Float, top: Float) -> tuple[Float, Float]:
    """Return the distances in plan at which a beam enters and leaves heights; NaN where it is always between them."""
    slope = slope + 0.0  # the slope of a level beam may be -0.0, whose quotients have the wrong sign
    with np.errstate(divide="ignore", invalid="ignore"):
        at_bottom, at_top = bottom / slope, top / slope
    return np.where(slope < 0, at_top, at_bottom), np.where(slope < 0, at_bottom, at_top)


def _half_width(distance: Float, begin: Float, end: Float, radius: Float) -> Float:
    """Return half the arc of an annulus within a circle; π from within the circle."""
    # Seen from outside, a circle is widest at the tangent length √(L² - δ²). If the annulus does not contain that, the
    # arc is widest at the end of the annulus that is nearer to it.
    widest = np.clip(np.sqrt(np.maximum(distance**2 - radius**2, 0.0)), begin, end)
    outside = distance > radius
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = (distance**2 + widest**2 - radius**2) / (2 * distance * widest)
    return np.where(outside, np.arccos(np.clip(np.where(outside, cosine, 0.0), -1, 1)), math.pi) + _MARGIN
