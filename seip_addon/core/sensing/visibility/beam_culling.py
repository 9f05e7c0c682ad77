r"""Beam culling: the rays of a scan that can return from near a target.

Returns within δ of a target lie in its patch: an upright cylinder of radius δ about it, between the heights at which
there are surfaces (`near_surfaces`). A channel of slope σ = tan φ is between these heights only at distances r in plan
from r₁ to r₂. The part of that annulus inside the cylinder, whose axis is at the distance L, is an arc of azimuths
about the target's. By the law of cosines its half-width is

.. math::

    Δ = \arccos \frac{L^2 + r^2 - δ^2}{2 L r},
    \quad r = \operatorname{clip}\left(\sqrt{L^2 - δ^2}, r_1, r_2\right)

That is a first bound, quick to compute for all targets. The second bound treats each surface near a target separately:
the disc that the ball of radius δ cuts out of its plane has a cylinder and heights of its own, and a beam meets the
plane n·x = k at a distance r in plan where

.. math::

    n_{xy} \cos(a - a_n) + n_z σ = k / r,

a is the beam's azimuth, and n_xy and a_n are length and azimuth of the normal in plan. With r₁ ≤ r ≤ r₂ that leaves
two arcs, one on each side of a_n.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from ...base.arrays import Boolean, Float, Integer, concatenated_ranges
from ..lidar.azimuth_steps import steps_in_arcs
from ..lidar.model import DetectionLaw, LidarModel
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
class Planes:
    """The planes in which returns of patches lie, as seen from one position.

    Parameters
    ----------
    normal : (p, 3) float64
        Unit normals, which point away from the position.
    distance : (p,) float64, metres
        Distance of each plane from the position.
    reflectivity : (p,) float64, 0 to 1
        Reflectivity of each surface.
    tolerance : float, metres
        Largest distance of returns from their plane.
    """

    normal: Float
    distance: Float
    reflectivity: Float
    tolerance: float


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
    least : tuple of (law, float)
        Detection law and least strength of a return for each sensor; see `VisibilitySettings.least_strength`.
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
    least: tuple[tuple[DetectionLaw, float], ...]

    @classmethod
    def of(cls, models: Sequence[LidarModel], yaw: float, settings: VisibilitySettings) -> Beams:
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
            least=tuple((model.law, settings.least_strength(model)) for model in models),
        )

    def reach(self, sensor: int, planes: Planes) -> Float:
        r"""Return the distance up to which returns from planes are strong enough for a sensor, (p,) float64, metres.

        A return lies off its plane, at the distance k, by at most the tolerance ε. A ray that meets the plane at r has
        the cosine k / r, so that the distance of the return differs from r by at most the share x = ε / k.
        """
        law, least = self.least[sensor]
        if least == 0:
            return np.full(len(planes.distance), np.inf)
        # A plane nearer than the tolerance gives x = 1 and an infinite reach: nothing is culled there. A quotient
        # without a value (0/0, inf - inf) is also taken as infinite. Errors are only allowed on this side.
        share = planes.tolerance / np.maximum(planes.distance, planes.tolerance)
        with np.errstate(divide="ignore", invalid="ignore"):
            slack = (1 + share) / (1 - share) * (1 + _MARGIN)
            far = law.farthest_on_planes(planes.reflectivity, planes.distance, least) * slack
        return np.where(np.isnan(far), np.inf, far)


@dataclass(frozen=True, eq=False)
class NearRays:
    """The rays that can return from near targets: bundles of neighbouring azimuth steps of a channel.

    Parameters
    ----------
    target : (k,) int64
        Target of each bundle.
    patch : (k,) int64
        Patch of each bundle.
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
    patch: Integer
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

    def beside_middle(self) -> tuple[NearRays, Integer]:
        """Return the halves to the left and right of the middle rays, and the bundle of which each is a part."""
        # bundles of one ray have no halves and end here; those of two have one
        before = (self.width - 1) // 2
        after = self.width - 1 - before
        right, left = np.flatnonzero(before), np.flatnonzero(after)
        parent = np.concatenate([right, left])
        halves = self.pick(parent)
        first = np.concatenate([self.first[right], (self.first + before + 1)[left]])
        width = np.concatenate([before[right], after[left]])
        return replace(halves, first=first, width=width), parent


def may_return(origin: Float, surfaces: NearSurfaces, beams: Beams) -> Boolean:
    """Return the mask of targets from which returns can be strong enough for each sensor, (models, t) bool.

    It is true for all of these targets and for few others.

    Parameters
    ----------
    origin : (3,) float64, metres
        Position of the sensors.
    beams : Beams
        Channels of the sensors.
    """
    may = np.zeros((len(beams.least), len(surfaces.xyz)), dtype=bool)
    if not any(least > 0 for _, least in beams.least):
        return ~may
    patches, planes = disc_patches(origin, surfaces, np.ones(len(surfaces.xyz), dtype=bool))
    nearest = patches.distance - patches.radius
    for sensor in range(len(beams.least)):
        may[sensor, patches.target[nearest <= beams.reach(sensor, planes)]] = True
    return may


def target_patches(origin: Float, surfaces: NearSurfaces, selected: Boolean) -> Patches:
    """Return the patches of selected targets as seen from a position; see `disc_patches`."""
    target = np.flatnonzero(selected)
    azimuth, distance = _polar(surfaces.xyz[target] - origin)
    radius = np.full(len(distance), surfaces.radius)
    return Patches(
        target, azimuth, distance, radius, surfaces.low[target] - origin[2], surfaces.high[target] - origin[2]
    )


def disc_patches(origin: Float, surfaces: NearSurfaces, selected: Boolean) -> tuple[Patches, Planes]:
    """Return a patch for each surface near selected targets, as seen from a position.

    Parameters
    ----------
    origin : (3,) float64, metres
        Position of the sensors.
    selected : (t,) bool
        Targets to return patches for.
    """
    discs = surfaces.discs
    pick = np.flatnonzero(selected[discs.target])
    centre, normal = discs.centre[pick] - origin, discs.normal[pick]
    away = (centre * normal).sum(axis=1)
    normal = np.where(away[:, None] < 0, -normal, normal)
    azimuth, distance = _polar(centre)
    bottom, top = discs.low[pick] - origin[2], discs.high[pick] - origin[2]
    patches = Patches(discs.target[pick], azimuth, distance, discs.radius[pick] + surfaces.tolerance, bottom, top)
    return patches, Planes(normal, np.abs(away), discs.reflectivity[pick], surfaces.tolerance)


def near_rays(beams: Beams, patches: Patches, planes: Planes | None = None) -> NearRays:
    """Find the rays that can return from patches.

    Parameters
    ----------
    patches : Patches
        Patches as seen from the sensors.
    planes : Planes, optional
        Plane of each patch, for the tighter bound.

    Returns
    -------
    NearRays
        All rays that can return from a patch, and few that cannot.
    """
    # Strength first: it shortens distances, from which the arcs on the plane follow.
    arcs = _arcs(beams, patches)
    if planes is not None:
        arcs = _cut_by_planes(_cut_by_strength(arcs, beams, planes), planes)
    channel = arcs.channel
    arc, first, width = steps_in_arcs(
        arcs.azimuth - beams.zero[channel],
        arcs.half_width,
        beams.size[channel],
        beams.steps[channel],
        beams.all_round[channel],
    )
    patch = arcs.patch[arc]
    miss = np.abs((arcs.begin + arcs.end)[arc] / 2 - patches.distance[patch])
    return NearRays(patches.target[patch], patch, channel[arc], first, width, miss)


@dataclass(frozen=True, eq=False)
class _Arcs:
    """Arcs in which a channel is within a patch: azimuths about ``azimuth``, and distances in plan; arrays (k,)."""

    patch: Integer
    channel: Integer
    slope: Float
    begin: Float
    end: Float
    azimuth: Float
    half_width: Float

    def pick(self, which: Boolean) -> _Arcs:
        return _Arcs(*(getattr(self, field.name)[which] for field in fields(self)))


def _arcs(beams: Beams, patches: Patches) -> _Arcs:
    """Return the arcs of all pairs of patch and channel that can meet."""
    patch, channel = _channels_at(beams, patches)
    slope, distance, radius = np.tan(beams.elevation)[channel], patches.distance[patch], patches.radius[patch]
    begin, end = _between_heights(slope, patches.bottom[patch], patches.top[patch])
    # fmax and fmin ignore NaN, the value of level beams within the heights: for these only the cylinder limits r.
    # Adding 0.0 makes -0.0 positive, as either may be taken as the greater of both, and the sign matters in quotients
    # below.
    begin = np.fmax(begin, np.maximum(distance - radius, 0.0)) + 0.0
    end = np.fmin(end, distance + radius)
    half_width = _half_width(distance, begin, end, radius)
    # The range is measured along the ray, from `begin` at least to the far end at the greatest depth at most: both
    # tests keep an arc if any of it may be within range.
    depth = np.maximum(np.abs(patches.bottom), np.abs(patches.top))[patch]
    in_range = (begin <= beams.max_range[channel]) & (np.hypot(end, depth) >= beams.min_range[channel])
    return _Arcs(patch, channel, slope, begin, end, patches.azimuth[patch], half_width).pick((begin <= end) & in_range)


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


def _cut_by_strength(arcs: _Arcs, beams: Beams, planes: Planes) -> _Arcs:
    """Return the part of each arc that is near enough for a return to be strong enough."""
    # the reach is along the ray, the ends of arcs are in plan: their ratio is √(1 + σ²)
    sensor = beams.sensor[arcs.channel]
    end = arcs.end
    for number, (_, least) in enumerate(beams.least):
        if least > 0:
            reach = beams.reach(number, planes)[arcs.patch] / np.hypot(1.0, arcs.slope)
            end = np.where(sensor == number, np.minimum(end, reach), end)
    return arcs if end is arcs.end else replace(arcs, end=end).pick(arcs.begin <= end)


def _cut_by_planes(arcs: _Arcs, planes: Planes) -> _Arcs:
    """Return the part of each arc that can meet the patch's plane: all of it, or a part on each side of the normal."""
    # From n_xy cos(a - a_n) + n_z σ = k / r with r in [begin, end] and k within the tolerance: cos(a - a_n) lies
    # between (k_min / end - n_z σ) / n_xy and (k_max / begin - n_z σ) / n_xy. For a negative k_min the smallest
    # quotient is at the smallest r. arccos falls, so that the lower limit gives the outer angle from a_n, the upper one
    # the inner.
    distance, normal = planes.distance[arcs.patch], planes.normal[arcs.patch]
    direction, level = _polar(normal)
    # level planes have no azimuth: the bound keeps the division finite, and the clipped cosines leave all or nothing
    level = np.maximum(level, _MARGIN)
    nearest, farthest = distance - planes.tolerance, distance + planes.tolerance
    climb = normal[:, 2] * arcs.slope
    with np.errstate(divide="ignore"):
        least = nearest / np.where(nearest >= 0, arcs.end, arcs.begin)
        most = farthest / arcs.begin
    outer = np.arccos(np.clip((least - climb) / level, -1, 1)) + _MARGIN
    inner = np.arccos(np.clip((most - climb) / level, -1, 1)) - _MARGIN
    half_width = (outer - inner) / 2
    # A part so wide that it could reach the arc across both of its ends would be cut at one of them only: such arcs are
    # kept whole, which costs rays but loses none. An arc that no azimuth fits is dropped.
    whole = (half_width > math.pi / 2 - _MARGIN) | (half_width + arcs.half_width >= math.pi)
    possible = ((most - climb) >= -level) & ((least - climb) <= level)
    parts = [arcs.pick(whole & possible)]
    for side in (-1, 1):
        middle = direction + side * (outer + inner) / 2
        # the two intervals of azimuths are intersected relative to the arc's middle, within ±π
        apart = (middle - arcs.azimuth + math.pi) % (2 * math.pi) - math.pi
        right = np.maximum(apart - half_width, -arcs.half_width)
        left = np.minimum(apart + half_width, arcs.half_width)
        part = replace(arcs, azimuth=arcs.azimuth + (left + right) / 2, half_width=(left - right) / 2)
        parts.append(part.pick(~whole & possible & (right <= left)))
    return _Arcs(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(_Arcs)))


def _polar(xyz: Float) -> tuple[Float, Float]:
    """Return azimuth and length in plan of vectors (n, 3)."""
    return np.arctan2(xyz[:, 1], xyz[:, 0]), np.hypot(xyz[:, 0], xyz[:, 1])
