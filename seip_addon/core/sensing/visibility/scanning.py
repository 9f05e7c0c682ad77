"""Scans of the sensors at one position.

A target is seen if some return of the scan lies nearer than δ to it and is strong enough. Where surfaces meet within
the tolerance of the ray caster, it is chance which of them stops the ray; the return must then be strong enough from
each of them. The same result as that of full scans is found with few rays:

1. Only rays that can return from near a target are cast (`beam_culling`).
2. For each sensor and target, the first is the one that should end nearest to the target.
3. For targets not seen yet, bundles of neighbouring rays follow. The middle ray of a bundle is cast, and the two halves
   become new bundles, until the target is seen.

No ray is cast twice, neither for two targets nor for two sensors that share it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.arrays import Boolean, Float, Integer, concatenated_ranges
from ...geometry.orientation import rotated
from ..lidar.beams import BeamPattern
from ..lidar.model import LidarModel
from .beam_culling import Beams, NearRays, may_return, near_rays, target_patches
from .near_surfaces import NearSurfaces
from .ray_casting import RayCaster
from .settings import VisibilitySettings
from .target_index import TargetIndex, is_within, squared_length

_RAYS_AT_ONCE = 1 << 17  # bounds the memory of rays that are cast at once
_PAIRS_AT_ONCE = 1 << 18  # of rays and surfaces: bounds the memory at borders of surfaces


@dataclass(frozen=True, eq=False)
class ScanPosition:
    """Position of the sensors to scan from, with the conditions on their returns.

    Parameters
    ----------
    caster : RayCaster
        Ray caster in the site's axes.
    origin : (3,) float64, metres
        Optical centre of the sensors, in the axes of the scan.
    yaw : float, radians
        Direction of azimuth zero, in the axes of the scan.
    models : sequence of LidarModel
        Sensors at this position.
    reflectivity : (n,) float64, 0 to 1
        Reflectivity of the caster's triangles.
    axes : ((3,) float64, (3, 3) float64), optional
        Origin and orientation of the axes of the scan, if they are not the site's; see `in_sensor_axes`.
    """

    caster: RayCaster
    origin: Float
    yaw: float
    models: Sequence[LidarModel]
    settings: VisibilitySettings
    reflectivity: Float
    axes: tuple[Float, Float] | None = None

    def in_sensor_axes(self, orientation: Float) -> ScanPosition:
        """Return the position in the axes of its sensors, which have the given orientation (3, 3) in the site."""
        return replace(self, origin=np.zeros(3), yaw=0.0, axes=(self.origin, orientation))

    def to_axes(self, points: Float) -> Float:
        """Return points (..., 3) of the site in the axes of the scan."""
        if self.axes is None:
            return points
        origin, orientation = self.axes
        return (points - origin) @ orientation

    def cast(self, directions: Float, max_range: float) -> tuple[Float, Integer]:
        """Cast rays along directions (n, 3) from the sensors' optical centre; see `RayCaster.cast`."""
        if self.axes is None:
            return self.caster.cast(self.origin, directions, max_range)
        origin, orientation = self.axes
        return self.caster.cast(origin, rotated(directions, orientation), max_range)

    def corners(self, triangle: Integer) -> Float:
        """Return the corners of some of the caster's triangles (k, 3, 3), in the axes of the scan."""
        return self.to_axes(self.caster.triangles[triangle])

    def counting(self, model: LidarModel, directions: Float, distance: Float, triangle: Integer) -> Boolean:
        """Return which of a sensor's hits are returns: within its range and strong enough, (n,) bool."""
        counts = (distance >= model.min_range) & (distance <= model.max_range)
        least = self.settings.least_strength(model)
        if least > 0:
            # strength depends on distance and on reflectivity times the cosine of the angle of incidence
            met = triangle[counts]
            corners = self.corners(met)
            normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            normal /= np.linalg.norm(normal, axis=1)[:, None]
            reflected = self.reflectivity[met] * np.abs((normal * directions[counts]).sum(axis=1))
            counts[counts] = model.law.strength(distance[counts], reflected) >= least
        return counts

    def counting_at_borders(
        self, model: LidarModel, surfaces: NearSurfaces, directions: Float, distance: Float, target: Integer
    ) -> Boolean:
        """Return which of a sensor's returns from near targets are strong enough for every surface that meets there.

        Parameters
        ----------
        surfaces : NearSurfaces
            Surfaces near the targets.
        directions, distance : (n, 3) and (n,) float64
            Direction and length of rays that return, each from nearer than δ to its target.
        target : (n,) int64
            Target of each ray.

        Returns
        -------
        (n,) bool
        """
        least, cuts = self.settings.least_strength(model), surfaces.cuts
        strong = np.ones(len(target), dtype=bool)
        if least == 0:
            return strong
        # Cuts are sorted by target: those of a ray's target are one slice. Each ray is paired with each cut of it, and
        # the pairs are kept where the ray ends on the cut's triangle, within the tolerance of the caster. A large δ
        # gives a target thousands of cuts, so rays are taken in turns that bound the memory of the pairs.
        first = np.searchsorted(cuts.target, target)
        count = np.searchsorted(cuts.target, target, side="right") - first
        turn = np.cumsum(count) // _PAIRS_AT_ONCE
        for rays in np.split(np.arange(len(target)), np.flatnonzero(np.diff(turn)) + 1):
            ray, cut = np.repeat(rays, count[rays]), concatenated_ranges(first[rays], count[rays])
            there = cuts.pick(cut).holds((self.origin + distance[:, None] * directions)[ray], surfaces.tolerance)
            ray, cut = ray[there], cut[there]
            # Where surfaces meet it is chance which of their triangles the caster reports. With the weakest of all
            # surfaces deciding, that does not matter.
            reflected = cuts.reflectivity[cut] * np.abs((cuts.normal[cut] * directions[ray]).sum(axis=1))
            strong[ray[model.law.strength(distance[ray], reflected) < least]] = False
        return strong

    def pairs_seen(
        self,
        model: LidarModel,
        directions: Float,
        distance: Float,
        triangle: Integer,
        surfaces: NearSurfaces,
        index: TargetIndex,
    ) -> tuple[Integer, Integer]:
        """Return each ray of a sensor with each target that its return sees, from the hits of n rays.

        Parameters
        ----------
        directions, distance, triangle : (n, 3) and (n,) float64, (n,) int64
            Directions of the rays, and their hits.
        surfaces : NearSurfaces
            Surfaces near the targets.
        index : TargetIndex
            Index of the targets.

        Returns
        -------
        ray, target : (p,) int64
            Indices of the pairs, rays ascending.
        """
        # A return may see several targets, and the strength at borders depends on the target's surfaces: pairs of both
        returns = np.flatnonzero(self.counting(model, directions, distance, triangle))
        directions, distance = directions[returns], distance[returns]
        ray, target = index.pairs_within_delta(self.origin + distance[:, None] * directions)
        strong = self.counting_at_borders(model, surfaces, directions[ray], distance[ray], target)
        return returns[ray[strong]], target[strong]


def seen_by_near_rays(position: ScanPosition, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find the targets that are seen, casting only rays that can affect the result.

    Parameters
    ----------
    surfaces : NearSurfaces
        Surfaces near the targets, for the settings' δ.

    Returns
    -------
    seen : (models, t) bool
        Visibility, identical to that of a full scan, which casts every ray.
    cast : int
        Number of rays.
    """
    beams = Beams.of(position.models, position.yaw)
    returns = _Returns(position, beams, surfaces)
    seen = np.zeros((len(position.models), len(surfaces.xyz)), dtype=bool)
    possible = may_return(position.origin, surfaces, position.models, position.settings)
    bundles = near_rays(beams, target_patches(position.origin, surfaces, possible.any(axis=0)))
    bundles = bundles.pick(possible[beams.sensor[bundles.channel], bundles.target])
    # First the likeliest ray for each sensor and target: most targets that can be seen are seen by it.
    _note_seen(seen, beams, returns, bundles.likeliest(beams.sensor))
    # Then the bundles of the rest. Each round splits bundles in halves, so that the rounds are few: the logarithm of
    # the widest one. All middle rays of a round are cast together, which the casters need to be fast. The loop ends
    # when every ray of every bundle is cast, or of no use since its target is seen. So nothing is missed.
    while len(bundles := bundles.pick(~seen[beams.sensor[bundles.channel], bundles.target])):
        _note_seen(seen, beams, returns, bundles)
        bundles = bundles.beside_middle()
    return seen, returns.cast


def _note_seen(seen: Boolean, beams: Beams, returns: _Returns, bundles: NearRays) -> None:
    """Note the targets that the middle rays of bundles see, in an array (models, t) bool."""
    sees = returns.see(bundles)
    seen[beams.sensor[bundles.channel[sees]], bundles.target[sees]] = True


def seen_by_rays(
    position: ScanPosition, model: LidarModel, rays: Integer, surfaces: NearSurfaces, index: TargetIndex
) -> Boolean:
    """Return the targets that a sensor sees with the given rays, all of which are cast, (t,) bool.

    Parameters
    ----------
    rays : (n,) int64
        Numbers of the rays, as in `BeamPattern`.
    index : TargetIndex
        Index of the targets.
    """
    pattern = BeamPattern(model, position.yaw)
    seen = np.zeros(len(surfaces.xyz), dtype=bool)
    for begin in range(0, len(rays), _RAYS_AT_ONCE):
        directions = pattern.directions(rays[begin : begin + _RAYS_AT_ONCE])
        distance, triangle = position.cast(directions, model.max_range)
        seen[position.pairs_seen(model, directions, distance, triangle, surfaces, index)[1]] = True
    return seen


class _Returns:
    """The returns of all sensors at one position, each ray cast when it is first needed.

    Parameters
    ----------
    beams : Beams
        Channels of the sensors at the position.
    """

    def __init__(self, position: ScanPosition, beams: Beams, surfaces: NearSurfaces) -> None:
        self._position, self._beams, self._surfaces = position, beams, surfaces
        self._patterns = [BeamPattern(model, position.yaw) for model in position.models]
        self._first_channel = np.searchsorted(beams.sensor, np.arange(len(position.models)))
        # Sensors may share rays, so that each is cast to the longest range of all; `counting` applies their own ranges.
        self._reach = max(model.max_range for model in position.models)
        self._row = np.zeros(beams.rays, dtype=np.int32)  # row of each ray in the arrays below; row 0: not cast yet
        self._direction = np.zeros((1, 3))
        self._distance = np.full(1, np.inf)
        self._point = np.full((1, 3), np.inf)
        self._triangle = np.full(1, -1, dtype=np.int64)

    @property
    def cast(self) -> int:
        """Number of rays that have been cast."""
        return len(self._distance) - 1

    def see(self, bundles: NearRays) -> Boolean:
        """Return the bundles whose middle rays return from nearer than δ to their targets, strongly enough, (k,)."""
        # all-round bundles may run over step 0, where steps are negative or beyond the last one
        row = self._rows(bundles.channel, bundles.middle % self._beams.steps[bundles.channel])
        gap = self._point[row] - self._surfaces.xyz[bundles.target]
        sees = is_within(squared_length(gap), self._position.settings.delta)
        # the few rays that end near their target are also checked for range and strength, by the law of each sensor
        near = np.flatnonzero(sees)
        for number, model in enumerate(self._position.models):
            own = near[self._beams.sensor[bundles.channel[near]] == number]
            directions, distance = self._direction[row[own]], self._distance[row[own]]
            counts = self._position.counting(model, directions, distance, self._triangle[row[own]])
            counts[counts] = self._position.counting_at_borders(
                model, self._surfaces, directions[counts], distance[counts], bundles.target[own[counts]]
            )
            sees[own] = counts
        return sees

    def _rows(self, channel: Integer, step: Integer) -> Integer:
        """Return the rows of rays in the arrays, after casting those that are new."""
        ray = self._beams.first_ray[channel] + step
        fresh = np.flatnonzero(self._row[ray] == 0)
        if len(fresh):
            # Bundles may share a ray, which must be cast once. Each writes its number to the ray's entry, where the
            # last one remains: only the bundle that finds its own number there casts the ray.
            self._row[ray[fresh]] = np.arange(len(fresh))
            fresh = fresh[self._row[ray[fresh]] == np.arange(len(fresh))]
            directions = self._directions(channel[fresh], step[fresh])
            distance, triangle = self._position.cast(directions, self._reach)
            self._row[ray[fresh]] = np.arange(len(fresh)) + len(self._distance)
            self._direction = np.concatenate([self._direction, directions])
            self._distance = np.concatenate([self._distance, distance])
            self._point = np.concatenate([self._point, _points(self._position.origin, directions, distance)])
            self._triangle = np.concatenate([self._triangle, triangle])
        rows: Integer = self._row[ray]
        return rows

    def _directions(self, channel: Integer, step: Integer) -> Float:
        """Return the directions of rays, (n, 3) float64, from the function that full scans use, so that bits agree."""
        directions = np.empty((len(channel), 3))
        for number, pattern in enumerate(self._patterns):
            own = np.flatnonzero(self._beams.sensor[channel] == number)
            local = channel[own] - self._first_channel[number]
            directions[own] = pattern.directions(local * self._position.models[number].azimuth_count + step[own])
        return directions


def _points(origin: Float, directions: Float, distance: Float) -> Float:
    """Return the end points of rays; infinite on a miss."""
    far = np.isinf(distance)
    points: Float = origin + np.where(far, 0.0, distance)[:, None] * directions
    points[far] = np.inf
    return points
