"""Scans of the sensors at one position, full or lazy.

A target is seen if some return of the scan lies nearer than δ to it. So

1. only rays are cast that can return from near a target (`beam_culling`);
2. of these first, for each sensor and target, the one that should end nearest to it;
3. then, for what is still unseen, bundles of neighbouring rays, each aimed at one surface about one target. A bundle
   goes when its target is seen, or when the triangle that stopped a ray beside it is proven to stop all of it
   (`occlusion`). Of each other bundle the middle ray is cast, and the halves beside it are bundles anew.

No ray is cast twice, neither for two targets nor for two sensors that share it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..arrays import Boolean, Float, Integer
from ..lidar import BeamPattern, LidarModel, return_intensity
from .beam_culling import Beams, NearRays, disc_patches, near_rays, target_patches
from .near_surfaces import NearSurfaces
from .occlusion import stopped_by
from .settings import VisibilitySettings
from .target_index import TargetIndex

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
    """

    caster: Caster
    origin: Float
    yaw: float
    models: Sequence[LidarModel]
    settings: VisibilitySettings

    def counting(self, model: LidarModel, directions: Float, distance: Float, triangle: Integer) -> Boolean:
        """Return which of a sensor's hits count as returns: within its range and strong enough, (n,) bool."""
        counts = (distance >= model.min_range) & (distance <= model.max_range)
        if self.settings.min_intensity > 0:
            corners = self.caster.triangles[triangle[counts]]
            normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            cos_incidence = (normal * directions[counts]).sum(axis=1) / np.linalg.norm(normal, axis=1)
            counts[counts] = return_intensity(model, distance[counts], cos_incidence) >= self.settings.min_intensity
        return counts


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
    beams = Beams.of(position.models, position.yaw)
    returns = _Returns(position, beams)
    seen = np.zeros((len(position.models), len(surfaces.xyz)), dtype=bool)

    first = near_rays(beams, target_patches(position.origin, surfaces)).likeliest(beams.sensor)
    sees, triangle = returns.see(first, surfaces.xyz)
    seen[beams.sensor[first.channel], first.target] = sees
    unseen = np.zeros(len(surfaces.xyz), dtype=bool)
    unseen[first.target[~sees]] = True
    blocker = np.full(seen.shape, -1)
    blocker[beams.sensor[first.channel], first.target] = triangle

    # every round keeps, beside each bundle, the triangle that stopped the last ray cast for it
    patches, planes = disc_patches(position.origin, surfaces, unseen)
    bundles = near_rays(beams, patches, planes)
    bundles = bundles.pick(np.flatnonzero(~seen[beams.sensor[bundles.channel], bundles.target]))
    triangle = blocker[beams.sensor[bundles.channel], bundles.target]
    while len(bundles):
        stopped = (triangle >= 0) & (bundles.width > 1)  # a single ray is cast as quickly as it is proven stopped
        corners = position.caster.triangles[triangle[stopped]]
        stopped[stopped] = stopped_by(position.origin, corners, beams, bundles.pick(stopped), planes)
        bundles = bundles.pick(~stopped)
        sees, triangle = returns.see(bundles, surfaces.xyz)
        seen[beams.sensor[bundles.channel[sees]], bundles.target[sees]] = True
        unseen = np.flatnonzero(~seen[beams.sensor[bundles.channel], bundles.target])
        bundles, part_of = bundles.pick(unseen).beside_middle()
        triangle = triangle[unseen][part_of]
    return seen, returns.cast


def seen_by_all_rays(position: ScanPosition, targets: Float) -> tuple[Boolean, int]:
    """Find which targets are seen by casting every ray of every sensor: the reference."""
    index = TargetIndex(targets, position.settings.delta)
    seen = np.zeros((len(position.models), len(targets)), dtype=bool)
    cast = 0
    for number, model in enumerate(position.models):
        pattern = BeamPattern(model, position.yaw)
        total = model.channels * model.azimuth_count
        for begin in range(0, total, _RAYS_AT_ONCE):
            directions = pattern.directions(np.arange(begin, min(begin + _RAYS_AT_ONCE, total)))
            distance, triangle = position.caster.cast(position.origin, directions, model.max_range)
            counts = position.counting(model, directions, distance, triangle)
            points = _points(position.origin, directions[counts], distance[counts])
            seen[number, index.within_delta(points)] = True
        cast += total
    return seen, cast


class _Returns:
    """The returns of all sensors at one position, each ray cast when it is first asked for.

    Parameters
    ----------
    beams : Beams
        Of the position.
    """

    def __init__(self, position: ScanPosition, beams: Beams) -> None:
        self._position, self._beams = position, beams
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

    def see(self, bundles: NearRays, targets: Float) -> tuple[Boolean, Integer]:
        """Tell which bundles' middle rays return from nearer than δ to their targets.

        Parameters
        ----------
        targets : (t, 3) float64, metres

        Returns
        -------
        sees : (k,) bool
        triangle : (k,) int64
            That stops the ray; -1 for none.
        """
        row = self._rows(bundles.channel, bundles.middle % self._beams.steps[bundles.channel])
        gap = self._point[row] - targets[bundles.target]
        sees = gap[:, 0] ** 2 + gap[:, 1] ** 2 + gap[:, 2] ** 2 < self._position.settings.delta**2
        triangle = self._triangle[row]
        near = np.flatnonzero(sees)
        for number, model in enumerate(self._position.models):
            own = near[self._beams.sensor[bundles.channel[near]] == number]
            counts = self._position.counting(model, self._direction[row[own]], self._distance[row[own]], triangle[own])
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
