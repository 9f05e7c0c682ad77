"""Scans of one sensor: cached static returns, and returns of traffic.

Rays are cast against each road user in its own axes, in which its shape never changes, and only those rays that pass
through its bounding box. A ray ends at the nearest hit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Boolean, Float, Integer
from ..lidar.beams import BeamPattern
from ..lidar.noisy_returns import return_chance
from ..visibility.ray_casting import RayCaster
from .beam_culling import rays_towards
from .frame import STATIC_INSTANCE
from .motion import Motion
from .sensor import MountedSensor

_RAYS_AT_ONCE = 1 << 17  # bounds the memory of the static scan
_MARGIN = 1e-3
"""Metres by which bounding boxes are larger than their contents: engines compute in float32."""
_CORNERS = np.array(np.meshgrid((0, 1), (0, 1), (0, 1), indexing="ij")).reshape(3, 8).T


class ReflectiveSurface:
    """Triangles that rays are cast against, with their reflectivity.

    Parameters
    ----------
    caster : RayCaster
        Ray caster of the triangles.
    reflectivity : (n,) float64, 0 to 1
        Reflectivity of each triangle.
    """

    def __init__(self, caster: RayCaster, reflectivity: Float) -> None:
        self.caster = caster
        self._reflectivity = reflectivity
        a, b, c = caster.triangles.transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        self.normals = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)

    def reflected(self, directions: Float, triangle: Integer) -> Float:
        """Return reflectivity times cosine of incidence (n,) at hits, with directions in the triangles' axes."""
        cos_incidence = np.einsum("ni,ni->n", self.normals[triangle], directions)
        reflected: Float = np.abs(cos_incidence) * self._reflectivity[triangle]
        return reflected


class BodySurface(ReflectiveSurface):
    """A road user's surface in its own axes, with its bounding box.

    Parameters
    ----------
    reflectivity : (n,) float64, 0 to 1
        Reflectivity of each triangle.
    """

    def __init__(self, caster: RayCaster, reflectivity: Float) -> None:
        super().__init__(caster, reflectivity)
        points = caster.triangles.reshape(-1, 3)
        self.low, self.high = points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN

    def hull(self, motion: Motion) -> Float:
        """Return points (8 s, 3) whose convex hull contains the bounding box during a whole motion, in site axes.

        Between two samples, a corner departs from the straight line by at most an eighth of its largest acceleration
        times the time squared; angles change at a constant rate.
        """
        size = self.high - self.low
        corners = self.low + _CORNERS * size
        # Positions are interpolated along straight lines, so that boxes that do not turn stay within the hull of the
        # samples. A box that turns by an angle moves its corners on arcs: at a radius r and a constant rate the
        # acceleration times the time squared is r times the angle squared. The box is enlarged by an eighth of that on
        # every side, with the largest angle between two samples; yaw and pitch together turn by no more than their sum.
        angle = np.abs(np.diff(motion.yaw)) + np.abs(np.diff(motion.pitch))
        bulge = np.linalg.norm(corners, axis=1).max() * angle.max(initial=0.0) ** 2 / 8
        corners += (2 * _CORNERS - 1) * bulge
        placed: Float = motion.position[:, None] + corners @ motion.attitude.transpose(0, 2, 1)
        return placed.reshape(-1, 3)


def hulls_of(motions: Sequence[Motion], shapes: Sequence[BodySurface]) -> Float:
    """Return points (k, m, 3), in site axes, whose convex hulls contain the motions of k road users."""
    hulls = [shape.hull(motion) for motion, shape in zip(motions, shapes, strict=True)]
    # Motions have different numbers of samples. Shorter hulls repeat their last point, which changes no convex hull, so
    # that all fit into one array.
    most = max(map(len, hulls), default=0)
    even = [np.concatenate([hull, np.repeat(hull[-1:], most - len(hull), axis=0)]) for hull in hulls]
    return np.array(even).reshape(len(hulls), most, 3)


@dataclass(frozen=True, eq=False)
class Scan:
    """Hits of the rays of one revolution; r rays in the order of `BeamPattern`.

    Parameters
    ----------
    distance : (r,) float64, metres
        Distance of the hit; infinite on a miss.
    empty : (r,) float64, metres
        Distance without traffic.
    intensity : (r,) float64, 0 to 1
        Intensity of the return.
    chance : (r,) float32
        Probability that the return is not lost.
    instance : (r,) int32
        Road user that was hit, or `STATIC_INSTANCE`.
    unoccluded : (u,) int64
        For each of the trajectories' road users, the number of rays that would return from it in an empty scene.
    visible : (u,) int64
        Number of rays that do return from it.
    """

    distance: Float
    empty: Float
    intensity: Float
    chance: NDArray[np.float32]
    instance: NDArray[np.int32]
    unoccluded: Integer
    visible: Integer


@dataclass(frozen=True, eq=False)
class _Hits:
    """Hits of n rays, with the product of reflectivity and cosine, and the probability of a return."""

    ray: Integer
    distance: Float
    reflected: Float
    chance: Float


class Scanner:
    """Simulator of the scans of one sensor.

    Parameters
    ----------
    ground : ReflectiveSurface
        Static scene, in site axes.

    Attributes
    ----------
    directions : (r, 3) float64
        Directions of the rays, in site axes.
    coarse_directions : (r, 3) float32
        The same for computing points: the error is 1e-5 m at 200 m.
    delay : (r,) float64, seconds
        Time of each ray after the beginning of the revolution.
    threads : int
        Useful number of scanners that scan at once.
    """

    def __init__(self, sensor: MountedSensor, ground: ReflectiveSurface) -> None:
        self.sensor, self.threads = sensor, ground.caster.threads
        self.delay = sensor.model.delay(np.arange(sensor.model.channels * sensor.model.azimuth_count))
        self._model = sensor.model
        rays = np.arange(len(self.delay))
        self.directions: Float = BeamPattern(self._model).directions(rays) @ sensor.orientation.T
        self.coarse_directions: NDArray[np.float32] = self.directions.astype(np.float32)
        self._distance = np.full(len(rays), np.inf)
        self._intensity = np.zeros(len(rays))
        self._chance = np.zeros(len(rays), dtype=np.float32)
        for begin in range(0, len(rays), _RAYS_AT_ONCE):
            part = slice(begin, begin + _RAYS_AT_ONCE)
            hits = self._cast(ground, sensor.xyz, self.directions[part], rays[part])
            self._distance[hits.ray], self._chance[hits.ray] = hits.distance, hits.chance
            self._intensity[hits.ray] = self._model.law.intensity(hits.distance, hits.reflected)

    @property
    def sees_nothing(self) -> bool:
        """Whether no ray hits the static scene."""
        return not np.isfinite(self._distance).any()

    def scan(self, motions: Sequence[Motion], shapes: Sequence[BodySurface], hulls: Float, users: int) -> Scan:
        """Return the scan of a revolution with traffic.

        Parameters
        ----------
        motions, shapes : sequences of Motion and BodySurface
            Motion and shape of each of the k road users present.
        hulls : (k, m, 3) float64, metres
            Points around each motion; see `hulls_of`.
        users : int
            Number of the trajectories' road users.
        """
        # The static scan comes first; every road user then replaces the rays that it stops sooner. The nearest hit
        # remains, whatever the order of the road users.
        distance, intensity, chance = self._distance.copy(), self._intensity.copy(), self._chance.copy()
        instance = np.full(len(distance), STATIC_INSTANCE, dtype=np.int32)
        unoccluded = np.zeros(users, dtype=np.int64)
        for motion, hits in self._hits(motions, shapes, hulls):
            # counted before the comparison: hits of this road user in a scene without others
            unoccluded[motion.user] = self.in_range(hits.distance).sum()
            nearest = hits.distance < distance[hits.ray]
            ray = hits.ray[nearest]
            distance[ray], chance[ray] = hits.distance[nearest], hits.chance[nearest]
            intensity[ray] = self._model.law.intensity(hits.distance[nearest], hits.reflected[nearest])
            instance[ray] = motion.user
        visible = returns_by_user(instance[self.in_range(distance) & (instance != STATIC_INSTANCE)], users)
        return Scan(distance, self._distance, intensity, chance, instance, unoccluded, visible)

    def in_range(self, distance: Float) -> Boolean:
        """Return which distances the sensor can measure."""
        return (distance >= self._model.min_range) & (distance <= self._model.max_range)

    def _hits(
        self, motions: Sequence[Motion], shapes: Sequence[BodySurface], hulls: Float
    ) -> Iterator[tuple[Motion, _Hits]]:
        """Yield each road user's hits, ignoring the rest of the scene."""
        if not motions:
            return
        # the rays towards all hulls at once; they come sorted by hull, so that each road user's rays are one slice
        hull, ray = rays_towards(self._model, (hulls - self.sensor.xyz) @ self.sensor.orientation)
        first = np.searchsorted(hull, np.arange(len(motions) + 1))
        for number, (motion, shape) in enumerate(zip(motions, shapes, strict=True)):
            yield motion, self._cast_at(shape, motion, ray[first[number] : first[number + 1]])

    def _cast_at(self, shape: BodySurface, motion: Motion, ray: Integer) -> _Hits:
        """Cast rays against one road user, in its axes."""
        # Its ray caster is built once, in its own axes: in place of the body, the rays are moved. If it stands still,
        # all rays have one transformation. Otherwise (rolling shutter) each ray has its own: that of the pose at the
        # time when the ray goes out. So a passing car is seen by each azimuth where it is at that moment, and its
        # points are sheared as those of a spinning sensor are.
        directions = self.directions.take(ray, axis=0)
        if motion.is_still:
            start = (motion.attitude[0].T @ (self.sensor.xyz - motion.position[0])[:, None])[:, 0]
            directions = (motion.attitude[0].T @ directions.T).T
        else:
            position, attitude = motion.at(self.delay[ray])
            start = np.einsum("ni,nij->nj", self.sensor.xyz - position, attitude)
            directions = np.einsum("ni,nij->nj", directions, attitude)
        return self._cast(shape, start, directions, ray)

    def _cast(self, surface: ReflectiveSurface, origin: Float, directions: Float, ray: Integer) -> _Hits:
        """Cast rays at a surface in its axes."""
        distance, triangle = surface.caster.cast(origin, directions, self._model.max_range)
        hit = np.flatnonzero(triangle >= 0)
        distance, directions = distance[hit], directions[hit]
        reflected = surface.reflected(directions, triangle[hit])
        return _Hits(ray[hit], distance, reflected, return_chance(self._model, distance, reflected))


def returns_by_user(instance: NDArray[np.int32], users: int) -> Integer:
    """Return the number of returns from each of ``users`` road users, (u,)."""
    return np.bincount(instance[instance != STATIC_INSTANCE], minlength=users)
