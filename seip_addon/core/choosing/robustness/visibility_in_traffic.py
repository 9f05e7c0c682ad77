r"""Visibility grids at instants of traffic, with vehicles as occluders.

Each ray of a sensor's scan ends on the first triangle of the scene or of the bodies of road users. A target is seen by
a return nearer than δ to it, as on the empty road. A return from a vehicle on a target, or next to it, sees the target
as a return from the road does.

For each pose all rays are cast once against the empty road. At an instant, only the rays that pass through the bounding
box of a road user are cast again, against the bodies only, and only targets with a stopped ray are evaluated again.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Boolean, Float, Integer
from ...progress import Progress
from ...sensing.lidar.beams import BeamPattern
from ...sensing.scans.beam_culling import BeamWindows
from ...sensing.scans.sensor import level_orientation
from ...sensing.visibility.near_surfaces import NearSurfaces, near_surfaces, rotated_surfaces
from ...sensing.visibility.ray_casting import engine_name, make_ray_caster
from ...sensing.visibility.scanning import Caster, ScanPosition
from ...sensing.visibility.surroundings import Surroundings
from ...sensing.visibility.target_index import TargetIndex
from ...sensing.visibility.visibility_model import in_sensor_axes
from .scenario_visibility import ScenarioVisibility, each_in_threads
from .traffic_instants import TrafficObstacles

_RAYS_AT_ONCE = 1 << 17  # bounds the memory of a full scan
_CORNERS = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1), indexing="ij")).reshape(3, 8).T


def visibility_in_traffic(
    around: Surroundings, poses: Integer, instants: Sequence[TrafficObstacles]
) -> Generator[Progress, None, ScenarioVisibility]:
    """Compute visibility from poses at instants of traffic.

    Parameters
    ----------
    poses : (s,) int64
        Indices among the site's candidates.
    instants : sequence of TrafficObstacles
        Bodies of the vehicles present at each of n instants.

    Yields
    ------
    Progress
        Progress after each pose.

    Returns
    -------
    ScenarioVisibility
        Visibility at each instant, identical to that of full scans with all triangles in one ray caster.
    """
    setting = _Setting(around)
    vehicles = [_vehicle_caster(around, one) for one in instants]
    packed = np.zeros((len(instants), len(poses), (len(setting.wanted) + 7) // 8), dtype=np.uint8)

    def compute(number: int) -> None:
        from_pose = _PoseInTraffic(setting, int(poses[number]))
        for instant, vehicle in enumerate(vehicles):
            packed[instant, number] = np.packbits(from_pose.seen(vehicle))

    threads = setting.caster.threads
    yield from each_in_threads(compute, range(len(poses)), threads, "computing visibility in traffic")
    return ScenarioVisibility(packed, len(setting.wanted))


class _Setting:
    """Parts that all poses share: ray caster of the scene, and the points that may be seen."""

    def __init__(self, around: Surroundings) -> None:
        site = around.site
        self.around = around
        self.caster = make_ray_caster(site.triangles, engine_name(around.engine))
        self.wanted = site.targets.xyz
        self.index = TargetIndex(self.wanted, around.sight.delta)
        self.surfaces = near_surfaces(site.triangles, self.wanted, around.sight.delta, site.reflectivity)


class _PoseInTraffic:
    """Visibility from one pose: its rays on the empty road, of which vehicles stop some."""

    def __init__(self, setting: _Setting, pose: int) -> None:
        around, candidates = setting.around, setting.around.site.candidates
        model, xyz, yaw = around.models[str(candidates.sensor[pose])], candidates.xyz[pose], candidates.yaw[pose]
        place = ScanPosition(setting.caster, xyz, float(yaw), [model], around.sight, around.site.reflectivity)
        points, near, found = setting.wanted, setting.surfaces, setting.index
        self._tilted: tuple[ScanPosition, Float] | None = None
        if candidates.tilt[pose] != 0:  # computed in the axes of the sensor, as visibility on the empty road is
            orientation = candidates.orientation(pose)
            self._tilted = place, orientation
            place, near = in_sensor_axes(place, orientation), rotated_surfaces(setting.surfaces, xyz, orientation)
            points, found = near.xyz, TargetIndex(near.xyz, around.sight.delta)
        self._static = _StaticScan(place, points)
        self._visibility = _RoadVisibility(self._static, found, near)

    def seen(self, vehicles: _VehicleCaster) -> Boolean:
        """Return the targets that are seen while vehicles are present, (t,) bool."""
        present = vehicles if self._tilted is None else vehicles.rotated(*self._tilted)
        return self._visibility.seen(self._static.blocked_by(present))


@dataclass(frozen=True, eq=False)
class _VehicleCaster:
    """Ray caster of the road users of an instant, with their reflectivity and bounding boxes."""

    caster: Caster
    reflectivity: Float
    hulls: Float

    def rotated(self, place: ScanPosition, orientation: Float) -> _VehicleCaster:
        """Return the same in the axes of the sensor at a position, which has the given orientation."""
        there = in_sensor_axes(replace(place, caster=self.caster), orientation)
        return replace(self, caster=there.caster, hulls=(self.hulls - place.origin) @ orientation)


def _vehicle_caster(around: Surroundings, present: TrafficObstacles) -> _VehicleCaster:
    """Return a caster of the bodies with the same rounding as one of the scene and the bodies together."""
    # Casters move all triangles to a common centre before they round them to float32. The scene's triangles are passed
    # in for that centre, but only those of the bodies are kept.
    site = around.site
    everything = np.concatenate([site.triangles, present.triangles])
    bodies = np.arange(len(everything)) >= len(site.triangles)
    reflectivity = np.concatenate([site.reflectivity, present.reflectivity])
    return _VehicleCaster(make_ray_caster(everything, engine_name(around.engine), bodies), reflectivity, present.hulls)


@dataclass(frozen=True, eq=False)
class _BlockedRays:
    """The k rays that end on a road user.

    Parameters
    ----------
    ray : (k,) int64
        Numbers of the rays, ascending.
    distance : (k,) float64, metres
        Distance at which each ray ends.
    returns : (k,) bool
        Whether each ray returns from there.
    """

    ray: Integer
    distance: Float
    returns: Boolean


class _StaticScan:
    """Ends of the rays of one pose on the empty road, for the rays that pass the bounding box of the targets.

    Parameters
    ----------
    place : ScanPosition
        Position of one sensor.
    wanted : (t, 3) float64, metres
        Points that may be seen.
    """

    def __init__(self, place: ScanPosition, wanted: Float) -> None:
        self.place, (self.model,) = place, place.models
        self._windows = BeamWindows(self.model)
        self._pattern = BeamPattern(self.model, place.yaw)
        self._orientation = level_orientation(place.yaw)
        # A ray that passes no point nearer than δ sees none, with or without traffic: only those through the box of all
        # points, enlarged by δ, are cast.
        low, high = wanted.min(axis=0) - place.settings.delta, wanted.max(axis=0) + place.settings.delta
        self._matters = np.zeros(self.rays, dtype=bool)
        self._matters[self.through(np.where(_CORNERS > 0, high, low)[None])[1]] = True
        self.distance = np.full(self.rays, np.inf)
        self.counts = np.zeros(self.rays, dtype=bool)
        matters = np.flatnonzero(self._matters)
        for ray in np.array_split(matters, max(1, -(-len(matters) // _RAYS_AT_ONCE))):
            directions = self.directions(ray)
            self.distance[ray], triangle = place.caster.cast(place.origin, directions, self.model.max_range)
            self.counts[ray] = place.counting(self.model, directions, self.distance[ray], triangle)

    @property
    def rays(self) -> int:
        """Number of all rays."""
        return self.model.channels * self.model.azimuth_count

    def through(self, hulls: Float) -> tuple[Integer, Integer]:
        """Pair hulls with rays that may pass through them; see `BeamWindows.rays_towards`."""
        return self._windows.rays_towards((hulls - self.place.origin) @ self._orientation)

    def directions(self, ray: Integer) -> Float:
        """Return the directions of rays, (n, 3)."""
        return self._pattern.directions(ray)

    def blocked_by(self, present: _VehicleCaster) -> _BlockedRays:
        """Return the rays that road users stop before their end on the empty road."""
        # Bodies are in a caster of their own. A ray ends at the nearer of the two hits, so that the full scan with
        # traffic follows from the scan of the empty road and the few rays towards vehicles. Where both are equally far
        # the road keeps the ray.
        towards = np.zeros(self.rays, dtype=bool)
        towards[self.through(present.hulls)[1]] = True
        ray = np.flatnonzero(towards & self._matters)
        directions = self.directions(ray)
        distance, triangle = present.caster.cast(self.place.origin, directions, self.model.max_range)
        sooner = distance < self.distance[ray]
        ray, distance = ray[sooner], distance[sooner]
        bodies = replace(self.place, caster=present.caster, reflectivity=present.reflectivity)
        return _BlockedRays(ray, distance, bodies.counting(self.model, directions[sooner], distance, triangle[sooner]))


class _RoadVisibility:
    """Visibility of the road: returns near each target are counted, and those of stopped rays subtracted."""

    def __init__(self, static: _StaticScan, index: TargetIndex, surfaces: NearSurfaces) -> None:
        self._static, self._index, self._surfaces, self._targets = static, index, surfaces, len(surfaces.xyz)
        # All pairs of a returning ray and a target that it sees on the empty road are computed once. They are stored as
        # lists of targets, one list after the other in order of rays (compressed sparse rows): `_target` has the
        # targets, and those of ray r are at `_first[r]` up to `_first[r + 1]`. `_times` has the number of rays that see
        # each target.
        returning = np.flatnonzero(static.counts)
        near = [
            self._near(part, static.distance[part])
            for part in np.array_split(returning, max(1, len(returning) // _RAYS_AT_ONCE))
        ]
        self._target = np.concatenate([target for _, target in near]).astype(np.int32)
        # returning rays ascend, and pairs come in their order: so the counts by ray give the lists' beginnings
        many = np.bincount(np.concatenate([ray for ray, _ in near]), minlength=static.rays)
        self._first = np.concatenate([[0], np.cumsum(many)])
        self._times = np.bincount(self._target, minlength=self._targets)

    def seen(self, stopped: _BlockedRays) -> Boolean:
        # A road user that stops a ray takes it away from all targets of its list. A target stays seen if more rays see
        # it than were stopped: one left is enough, and which one does not matter. That needs no search for other rays,
        # and its cost grows with the stopped rays, not with all rays or targets. The lists of the stopped rays are
        # joined by index arithmetic: `lost` are the positions of their entries in `_target`.
        begin = self._first[stopped.ray]
        count = self._first[stopped.ray + 1] - begin
        lost = np.arange(count.sum()) + np.repeat(begin - (np.cumsum(count) - count), count)
        seen: Boolean = self._times > np.bincount(self._target[lost], minlength=self._targets)
        # The stopped rays that return from the road user may see targets near its surface: these are added.
        seen[self._near(stopped.ray[stopped.returns], stopped.distance[stopped.returns])[1]] = True
        return seen

    def _near(self, ray: Integer, distance: Float) -> tuple[Integer, Integer]:
        """Return pairs of returning rays and the targets that they see, in the order of the rays."""
        # the same two conditions as for full scans: nearer than δ, and strong enough for every surface that meets there
        static, directions = self._static, self._static.directions(ray)
        which, target = self._index.pairs_within_delta(static.place.origin + distance[:, None] * directions)
        strong = static.place.counting_at_borders(
            static.model, self._surfaces, directions[which], distance[which], target
        )
        return ray[which[strong]], target[strong]
