"""Scans of the sensors at one position, full or lazy.

A target is seen if some return of the scan lies nearer than δ to it, and is strong enough. Where surfaces meet within
the tolerance of the ray caster, the return of each of them must be: which of them stopped the ray is chance. So

1. only rays are cast that can return from near a target (`beam_culling`);
2. of these first, for each sensor and target, the one that should end nearest to it;
3. then, for what is still unseen, bundles of neighbouring rays, each aimed at one surface about one target. A bundle
   goes when its target is seen, or when the triangle that stopped a ray beside it is proven to stop all of it
   (`occlusion`). Of each other bundle the middle ray is cast, and the halves beside it are bundles anew.

No ray is cast twice, neither for two targets nor for two sensors that share it.

The rays of a rosette have no neighbours in rows: all of them that can return from near a target are cast
(`ray_culling`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ...arrays import Boolean, Float, Integer
from ..lidar.beams import BeamPattern
from ..lidar.model import LidarModel
from .beam_culling import Beams, NearRays, counted, disc_patches, may_return, near_rays, target_patches
from .near_surfaces import NearSurfaces
from .occlusion import stopped_by
from .ray_culling import rays_near
from .settings import VisibilitySettings
from .target_index import TargetIndex, is_within, squared_length

_RAYS_AT_ONCE = 1 << 17  # bounds the memory of a full scan


class Corners(Protocol):
    """Triangles whose corners can be asked for."""

    def __getitem__(self, which: Integer, /) -> Float:
        """Return corners, (k, 3, 3) float64, metres."""


class Caster(Protocol):
    """Interface of a `RayCaster` that scans use."""

    @property
    def triangles(self) -> Corners:
        """The triangles that hits index."""

    def cast(self, origin: Float, directions: Float, max_range: float) -> tuple[Float, Integer]:
        """Cast rays; see `RayCaster.cast`."""


@dataclass(frozen=True, eq=False)
class ScanPosition:
    """Position of the sensors whose scans are wanted, and which of their returns count.

    Parameters
    ----------
    origin : (3,) float64, metres
    yaw : float, radians
    models : sequence of LidarModel
        Whose scans from here are wanted.
    reflectivity : (n,) float64, 0 to 1
        Of the caster's triangles.
    """

    caster: Caster
    origin: Float
    yaw: float
    models: Sequence[LidarModel]
    settings: VisibilitySettings
    reflectivity: Float

    def counting(self, model: LidarModel, directions: Float, distance: Float, triangle: Integer) -> Boolean:
        """Return which of a sensor's hits count as returns: within its range and strong enough, (n,) bool."""
        counts = (distance >= model.min_range) & (distance <= model.max_range)
        least = self.settings.least_strength(model)
        if least > 0:
            met = triangle[counts]
            corners = self.caster.triangles[met]
            normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            normal /= np.linalg.norm(normal, axis=1)[:, None]
            reflected = self.reflectivity[met] * np.abs((normal * directions[counts]).sum(axis=1))
            counts[counts] = model.law.strength(distance[counts], reflected) >= least
        return counts

    def counting_at_borders(
        self, model: LidarModel, surfaces: NearSurfaces, directions: Float, distance: Float, target: Integer
    ) -> Boolean:
        """Return which of a sensor's returns from near targets are strong enough off every surface that meets there.

        Parameters
        ----------
        surfaces : NearSurfaces
            About the targets.
        directions, distance : (n, 3) and (n,) float64
            Of rays that return, each from nearer than δ to its target.
        target : (n,) int64

        Returns
        -------
        (n,) bool
        """
        least, cuts = self.settings.least_strength(model), surfaces.discs.cuts
        strong = np.ones(len(target), dtype=bool)
        if least == 0:
            return strong
        first = np.searchsorted(cuts.target, target)
        count = np.searchsorted(cuts.target, target, side="right") - first
        ray, cut = np.repeat(np.arange(len(target)), count), counted(first, count)
        there = cuts.pick(cut).holds((self.origin + distance[:, None] * directions)[ray], surfaces.tolerance)
        ray, cut = ray[there], cut[there]
        reflected = cuts.reflectivity[cut] * np.abs((cuts.normal[cut] * directions[ray]).sum(axis=1))
        strong[ray[model.law.strength(distance[ray], reflected) < least]] = False
        return strong


def seen_by_near_rays(position: ScanPosition, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find which targets are seen, casting only rays that can matter.

    Parameters
    ----------
    surfaces : NearSurfaces
        About the targets, for the settings' δ.

    Returns
    -------
    seen : (models, t) bool
        The same, bit for bit, as `seen_by_all_rays`.
    cast : int
        Number of rays.
    """
    turning = [model for model in position.models if model.rosette is None]
    if len(turning) == len(position.models):
        return _seen_by_channels(position, surfaces)
    seen, cast = np.zeros((len(position.models), len(surfaces.xyz)), dtype=bool), 0
    if turning:
        of_these = np.array([model.rosette is None for model in position.models])
        seen[of_these], cast = _seen_by_channels(replace(position, models=turning), surfaces)
    index = TargetIndex(surfaces.xyz, position.settings.delta)
    patches = target_patches(position.origin, surfaces, np.ones(len(surfaces.xyz), dtype=bool))
    for number, model in enumerate(position.models):
        if model.rosette is not None:
            rays = rays_near(patches, position.yaw + model.azimuth_offsets, model.elevations, model.max_range)
            seen[number] = _seen_by_rays(position, model, rays, surfaces, index)
            cast += len(rays)
    return seen, cast


def _seen_by_channels(position: ScanPosition, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find which targets sensors see whose rays are the azimuth steps of channels; see `seen_by_near_rays`."""
    beams = Beams.of(position.models, position.yaw, position.settings)
    returns = _Returns(position, beams, surfaces)
    seen = np.zeros((len(position.models), len(surfaces.xyz)), dtype=bool)

    hopeful = may_return(position.origin, surfaces, beams)
    first = near_rays(beams, target_patches(position.origin, surfaces, hopeful.any(axis=0)))
    first = first.pick(hopeful[beams.sensor[first.channel], first.target]).likeliest(beams.sensor)
    sees, triangle = returns.see(first)
    seen[beams.sensor[first.channel], first.target] = sees
    unseen = np.zeros(len(surfaces.xyz), dtype=bool)
    unseen[first.target[~sees]] = True
    blocker = np.full(seen.shape, -1)
    blocker[beams.sensor[first.channel], first.target] = triangle

    # every round keeps, beside each bundle, the triangle that stopped the last ray cast for it
    patches, planes = disc_patches(position.origin, surfaces, unseen)
    bundles = near_rays(beams, patches, planes)
    open_still = hopeful & ~seen
    bundles = bundles.pick(np.flatnonzero(open_still[beams.sensor[bundles.channel], bundles.target]))
    triangle = blocker[beams.sensor[bundles.channel], bundles.target]
    while len(bundles):
        stopped = (triangle >= 0) & (bundles.width > 1)  # a single ray is cast as quickly as it is proven stopped
        corners = position.caster.triangles[triangle[stopped]]
        stopped[stopped] = stopped_by(position.origin, corners, beams, bundles.pick(stopped), planes)
        bundles = bundles.pick(~stopped)
        sees, triangle = returns.see(bundles)
        seen[beams.sensor[bundles.channel[sees]], bundles.target[sees]] = True
        unseen = np.flatnonzero(~seen[beams.sensor[bundles.channel], bundles.target])
        bundles, part_of = bundles.pick(unseen).beside_middle()
        triangle = triangle[unseen][part_of]
    return seen, returns.cast


def seen_by_all_rays(position: ScanPosition, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find which targets are seen by casting every ray of every sensor: the reference."""
    index = TargetIndex(surfaces.xyz, position.settings.delta)
    rays = [np.arange(model.channels * model.azimuth_count) for model in position.models]
    seen = [
        _seen_by_rays(position, model, own, surfaces, index) for model, own in zip(position.models, rays, strict=True)
    ]
    return np.array(seen), sum(map(len, rays))


def _seen_by_rays(
    position: ScanPosition, model: LidarModel, rays: Integer, surfaces: NearSurfaces, index: TargetIndex
) -> Boolean:
    """Return which targets a sensor sees by casting rays of it, (t,) bool.

    Parameters
    ----------
    rays : (n,) int64
        As in `BeamPattern`.
    index : TargetIndex
        Of the targets.
    """
    pattern = BeamPattern(model, position.yaw)
    seen = np.zeros(len(surfaces.xyz), dtype=bool)
    for begin in range(0, len(rays), _RAYS_AT_ONCE):
        directions = pattern.directions(rays[begin : begin + _RAYS_AT_ONCE])
        distance, triangle = position.caster.cast(position.origin, directions, model.max_range)
        counts = position.counting(model, directions, distance, triangle)
        directions, distance = directions[counts], distance[counts]
        ray, target = index.pairs_within_delta(_points(position.origin, directions, distance))
        strong = position.counting_at_borders(model, surfaces, directions[ray], distance[ray], target)
        seen[target[strong]] = True
    return seen


class _Returns:
    """The returns of all sensors at one position, each ray cast when it is first asked for.

    Parameters
    ----------
    beams : Beams
        Of the position.
    """

    def __init__(self, position: ScanPosition, beams: Beams, surfaces: NearSurfaces) -> None:
        self._position, self._beams, self._surfaces = position, beams, surfaces
        self._patterns = [BeamPattern(model, position.yaw) for model in position.models]
        self._first_channel = np.searchsorted(beams.sensor, np.arange(len(position.models)))
        self._reach = max(model.max_range for model in position.models)
        self._row = np.zeros(beams.rays, dtype=np.int32)  # of each ray in the arrays below; row 0: not cast
        self._direction = np.zeros((1, 3))
        self._distance = np.full(1, np.inf)
        self._point = np.full((1, 3), np.inf)
        self._triangle = np.full(1, -1, dtype=np.int64)

    @property
    def cast(self) -> int:
        """Number of rays that have been cast."""
        return len(self._distance) - 1

    def see(self, bundles: NearRays) -> tuple[Boolean, Integer]:
        """Tell which bundles' middle rays return from nearer than δ to their targets, strongly enough.

        Returns
        -------
        sees : (k,) bool
        triangle : (k,) int64
            That stops the ray; -1 for none.
        """
        row = self._rows(bundles.channel, bundles.middle % self._beams.steps[bundles.channel])
        gap = self._point[row] - self._surfaces.xyz[bundles.target]
        sees = is_within(squared_length(gap), self._position.settings.delta)
        triangle = self._triangle[row]
        near = np.flatnonzero(sees)
        for number, model in enumerate(self._position.models):
            own = near[self._beams.sensor[bundles.channel[near]] == number]
            directions, distance = self._direction[row[own]], self._distance[row[own]]
            counts = self._position.counting(model, directions, distance, triangle[own])
            counts[counts] = self._position.counting_at_borders(
                model, self._surfaces, directions[counts], distance[counts], bundles.target[own[counts]]
            )
            sees[own] = counts
        return sees, triangle

    def _rows(self, channel: Integer, step: Integer) -> Integer:
        """Rows of rays in the arrays, after casting those that are new."""
        ray = self._beams.first_ray[channel] + step
        fresh = np.flatnonzero(self._row[ray] == 0)
        if len(fresh):
            self._row[ray[fresh]] = np.arange(len(fresh))  # of bundles with the same ray the last one stands for all
            fresh = fresh[self._row[ray[fresh]] == np.arange(len(fresh))]
            directions = self._directions(channel[fresh], step[fresh])
            distance, triangle = self._position.caster.cast(self._position.origin, directions, self._reach)
            self._row[ray[fresh]] = np.arange(len(fresh)) + len(self._distance)
            self._direction = np.concatenate([self._direction, directions])
            self._distance = np.concatenate([self._distance, distance])
            self._point = np.concatenate([self._point, _points(self._position.origin, directions, distance)])
            self._triangle = np.concatenate([self._triangle, triangle])
        rows: Integer = self._row[ray]
        return rows

    def _directions(self, channel: Integer, step: Integer) -> Float:
        directions = np.empty((len(channel), 3))
        for number, pattern in enumerate(self._patterns):
            own = np.flatnonzero(self._beams.sensor[channel] == number)
            local = channel[own] - self._first_channel[number]
            directions[own] = pattern.directions(local * self._position.models[number].azimuth_count + step[own])
        return directions


def _points(origin: Float, directions: Float, distance: Float) -> Float:
    """End points of rays; infinitely far on a miss."""
    far = np.isinf(distance)
    points: Float = origin + np.where(far, 0.0, distance)[:, None] * directions
    points[far] = np.inf
    return points
