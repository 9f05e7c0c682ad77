"""Scan of a sensor at one position.

A target is seen if some return of the scan lies nearer than δ to it and is strong enough. Where surfaces meet within
the tolerance of the ray caster, it is chance which of them stops the ray; the return must then be strong enough from
each of them. The same result as that of a full scan is found with few rays: only rays that can return from near a
target are cast (`beam_culling`), in bundles of neighbours. The middle ray of a bundle is cast, and the two halves
become new bundles, until the target is seen. No ray is cast twice.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base.arrays import Boolean, Float, Integer, concatenated_ranges
from ...geometry.orientation import rotated
from ..lidar.beams import BeamPattern
from ..lidar.model import LidarModel
from .beam_culling import NearRays, may_return, near_rays
from .near_surfaces import NearSurfaces
from .ray_casting import RayCaster
from .settings import VisibilitySettings

_PAIRS_AT_ONCE = 1 << 18  # of rays and surfaces: bounds the memory at borders of surfaces


@dataclass(frozen=True, eq=False)
class ScanPosition:
    """Sensor at a position to scan from, with the conditions on its returns.

    Parameters
    ----------
    caster : RayCaster
        Ray caster in the site's axes.
    origin : (3,) float64, metres
        Optical centre, in the axes of the scan.
    yaw : float, radians
        Direction of azimuth zero, in the axes of the scan.
    reflectivity : (n,) float64, 0 to 1
        Reflectivity of the caster's triangles.
    axes : ((3,) float64, (3, 3) float64), optional
        Origin and orientation of the axes of the scan, if they are not the site's; see `in_sensor_axes`.
    """

    caster: RayCaster
    origin: Float
    yaw: float
    model: LidarModel
    settings: VisibilitySettings
    reflectivity: Float
    axes: tuple[Float, Float] | None = None

    def in_sensor_axes(self, orientation: Float) -> ScanPosition:
        """Return the position in the axes of its sensor, which has the given orientation (3, 3) in the site."""
        return replace(self, origin=np.zeros(3), yaw=0.0, axes=(self.origin, orientation))

    def to_axes(self, points: Float) -> Float:
        """Return points (..., 3) of the site in the axes of the scan."""
        if self.axes is None:
            return points
        origin, orientation = self.axes
        return (points - origin) @ orientation

    def cast(self, directions: Float) -> tuple[Float, Integer]:
        """Cast rays along directions (n, 3) from the optical centre to the end of the range; see `RayCaster.cast`."""
        if self.axes is None:
            return self.caster.cast(self.origin, directions, self.model.max_range)
        origin, orientation = self.axes
        return self.caster.cast(origin, rotated(directions, orientation), self.model.max_range)

    def corners(self, triangle: Integer) -> Float:
        """Return the corners of some of the caster's triangles (k, 3, 3), in the axes of the scan."""
        return self.to_axes(self.caster.triangles[triangle])

    def counting(self, directions: Float, distance: Float, triangle: Integer) -> Boolean:
        """Return which hits are returns: within the range and strong enough, (n,) bool."""
        model = self.model
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
        self, surfaces: NearSurfaces, directions: Float, distance: Float, target: Integer
    ) -> Boolean:
        """Return which returns from near targets are strong enough for every surface that meets there.

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
        model, cuts = self.model, surfaces.cuts
        least = self.settings.least_strength(model)
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


def squared_length(gap: Float) -> Float:
    """Return squared lengths of vectors, (n,) from (n, 3), always summed in the same order, so that bits agree."""
    squared: Float = gap[:, 0] ** 2 + gap[:, 1] ** 2 + gap[:, 2] ** 2
    return squared


def is_within(squared_distance: Float, delta: float) -> Boolean:
    """Return whether returns at squared distances from targets see them: whether they are nearer than δ."""
    near: Boolean = squared_distance < delta**2
    return near


def seen_by_near_rays(position: ScanPosition, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find the targets that are seen, casting only rays that can affect the result.

    Parameters
    ----------
    surfaces : NearSurfaces
        Surfaces near the targets, for the settings' δ.

    Returns
    -------
    seen : (t,) bool
        Visibility, identical to that of a full scan, which casts every ray.
    cast : int
        Number of rays.
    """
    returns, seen = _Returns(position, surfaces), np.zeros(len(surfaces.xyz), dtype=bool)
    possible = may_return(position.origin, surfaces, position.model, position.settings)
    bundles = near_rays(position.model, position.origin, position.yaw, surfaces, possible)
    # Each round splits bundles in halves, so that the rounds are few: the logarithm of the widest one. All middle rays
    # of a round are cast together, which the casters need to be fast. The loop ends when every ray of every bundle is
    # cast, or of no use since its target is seen. So nothing is missed.
    while len(bundles := bundles.pick(~seen[bundles.target])):
        seen[bundles.target[returns.see(bundles)]] = True
        bundles = bundles.beside_middle()
    return seen, returns.cast


class _Returns:
    """The returns of a sensor, each ray cast when it is first needed."""

    def __init__(self, position: ScanPosition, surfaces: NearSurfaces) -> None:
        self._position, self._surfaces = position, surfaces
        self._pattern = BeamPattern(position.model, position.yaw)
        # row of each ray in the arrays below; row 0: not cast yet
        self._row = np.zeros(position.model.channels * position.model.azimuth_count, dtype=np.int64)
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
        position, steps = self._position, self._position.model.azimuth_count
        # all-round bundles may run over step 0, where steps are negative or beyond the last one
        row = self._rows(bundles.channel * steps + bundles.middle % steps)
        gap = self._point[row] - self._surfaces.xyz[bundles.target]
        sees = is_within(squared_length(gap), position.settings.delta)
        # the few rays that end near their target are also checked for range and strength
        near = np.flatnonzero(sees)
        directions, distance = self._direction[row[near]], self._distance[row[near]]
        counts = position.counting(directions, distance, self._triangle[row[near]])
        counts[counts] = position.counting_at_borders(
            self._surfaces, directions[counts], distance[counts], bundles.target[near[counts]]
        )
        sees[near] = counts
        return sees

    def _rows(self, ray: Integer) -> Integer:
        """Return the rows of rays in the arrays, after casting those that are new."""
        fresh = np.unique(ray[self._row[ray] == 0])
        if len(fresh):
            directions = self._pattern.directions(fresh)  # as full scans have them, so that bits agree
            distance, triangle = self._position.cast(directions)
            self._row[fresh] = np.arange(len(fresh)) + len(self._distance)
            self._direction = np.concatenate([self._direction, directions])
            self._distance = np.concatenate([self._distance, distance])
            self._point = np.concatenate([self._point, _points(self._position.origin, directions, distance)])
            self._triangle = np.concatenate([self._triangle, triangle])
        rows: Integer = self._row[ray]
        return rows


def _points(origin: Float, directions: Float, distance: Float) -> Float:
    """Return the end points of rays; infinite on a miss."""
    far = np.isinf(distance)
    points: Float = origin + np.where(far, 0.0, distance)[:, None] * directions
    points[far] = np.inf
    return points
