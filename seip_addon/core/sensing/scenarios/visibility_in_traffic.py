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

from ...base.arrays import Boolean, Float, Integer, concatenated_ranges
from ...base.progress import Progress, each_in_threads
from ..lidar.beams import BeamPattern
from ..scans.beam_culling import BeamWindows
from ..scans.sensor import level_orientation
from ..visibility.near_surfaces import NearSurfaces, near_surfaces, rotated_surfaces
from ..visibility.ray_casting import RayCaster, engine_name, make_ray_caster
from ..visibility.scanning import ScanPosition
from ..visibility.surroundings import Surroundings
from ..visibility.target_index import TargetIndex
from .scenario_visibility import ScenarioVisibility
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
    site = around.site
    caster = make_ray_caster(site.triangles, engine_name(around.engine))
    surfaces = near_surfaces(site.triangles, site.targets.xyz, around.sight.delta, site.reflectivity)
    vehicles = [_vehicles(around, one) for one in instants]
    packed = np.zeros((len(instants), len(poses), (len(site.targets) + 7) // 8), dtype=np.uint8)

    def compute(number: int) -> None:
        scan = _StaticScan(around, caster, surfaces, int(poses[number]))
        for instant, present in enumerate(vehicles):
            packed[instant, number] = np.packbits(scan.seen_between(present))

    yield from each_in_threads(compute, range(len(poses)), caster.threads, "computing visibility in traffic")
    return ScenarioVisibility(packed, len(site.targets))


@dataclass(frozen=True, eq=False)
class _Vehicles:
    """Ray caster of the road users of an instant, the reflectivity of its triangles, and bounding boxes (k, 8, 3)."""

    caster: RayCaster
    reflectivity: Float
    hulls: Float


def _vehicles(around: Surroundings, present: TrafficObstacles) -> _Vehicles:
    """Return a caster of the bodies with the same rounding as one of the scene and the bodies together."""
    # Casters move all triangles to a common centre before they round them to float32. The scene's triangles are passed
    # in for that centre, but only those of the bodies are kept.
    site = around.site
    everything = np.concatenate([site.triangles, present.triangles])
    bodies = np.arange(len(everything)) >= len(site.triangles)
    reflectivity = np.concatenate([site.reflectivity, present.reflectivity])
    return _Vehicles(make_ray_caster(everything, engine_name(around.engine), bodies), reflectivity, present.hulls)


class _StaticScan:
    """Scan of the empty road from one pose, and the targets that each of its returns sees.

    Rays that pass outside the bounding box of the targets are left out.

    Parameters
    ----------
    caster : RayCaster
        Ray caster of the site's triangles.
    surfaces : NearSurfaces
        Surfaces near the targets, local site axes.
    pose : int
        Index among the site's candidates.
    """

    def __init__(self, around: Surroundings, caster: RayCaster, surfaces: NearSurfaces, pose: int) -> None:
        candidates, delta = around.site.candidates, around.sight.delta
        self._model = model = around.models[str(candidates.sensor[pose])]
        xyz, yaw = candidates.xyz[pose], float(candidates.yaw[pose])
        position = ScanPosition(caster, xyz, yaw, model, around.sight, around.site.reflectivity)
        if candidates.tilt[pose] != 0:  # computed in the axes of the sensor, as visibility on the empty road is
            orientation = candidates.orientation(pose)
            position, surfaces = position.in_sensor_axes(orientation), rotated_surfaces(surfaces, xyz, orientation)
        self._position, self._surfaces = position, surfaces
        self._pattern, self._windows = BeamPattern(model, position.yaw), BeamWindows(model)
        self._index = TargetIndex(surfaces.xyz, delta)
        # A ray that passes no point nearer than δ sees none, with or without traffic: only those through the box of all
        # points, enlarged by δ, are cast.
        low, high = surfaces.xyz.min(axis=0) - delta, surfaces.xyz.max(axis=0) + delta
        rays = model.channels * model.azimuth_count
        self._matters = np.zeros(rays, dtype=bool)
        self._matters[self._through(np.where(_CORNERS > 0, high, low)[None])] = True
        self._distance = np.full(rays, np.inf)
        # All pairs of a returning ray and a target that it sees on the empty road are computed once. They are stored as
        # lists of targets, one list after the other in order of rays (compressed sparse rows): `_target` has the
        # targets, and those of ray r are at `_first[r]` up to `_first[r + 1]`. `_times` has the number of rays that see
        # each target.
        matters = np.flatnonzero(self._matters)
        pairs = []
        for ray in np.array_split(matters, max(1, -(-len(matters) // _RAYS_AT_ONCE))):
            directions = self._pattern.directions(ray)
            distance, triangle = position.cast(directions)
            self._distance[ray] = distance
            pairs.append(self._seen_by(position, ray, directions, distance, triangle))
        self._target = np.concatenate([target for _, target in pairs]).astype(np.int32)
        # rays ascend, and pairs come in their order: so the counts by ray give the lists' beginnings
        count = np.bincount(np.concatenate([ray for ray, _ in pairs]), minlength=rays)
        self._first = np.concatenate([[0], np.cumsum(count)])
        self._times = np.bincount(self._target, minlength=len(surfaces.xyz))

    def seen_between(self, vehicles: _Vehicles) -> Boolean:
        """Return the targets that are seen while vehicles are present, (t,) bool."""
        # Bodies are in a caster of their own. A ray ends at the nearer of the two hits, so that the full scan with
        # traffic follows from the scan of the empty road and the few rays towards vehicles. Where both are equally far
        # the road keeps the ray.
        towards = np.zeros(len(self._matters), dtype=bool)
        towards[self._through(self._position.to_axes(vehicles.hulls))] = True
        ray = np.flatnonzero(towards & self._matters)
        directions = self._pattern.directions(ray)
        present = replace(self._position, caster=vehicles.caster, reflectivity=vehicles.reflectivity)
        distance, triangle = present.cast(directions)
        sooner = distance < self._distance[ray]
        stopped = ray[sooner]
        # A road user that stops a ray takes it away from all targets of its list. A target stays seen if more rays see
        # it than were stopped: one left is enough, and which one does not matter. That needs no search for other rays,
        # and its cost grows with the stopped rays, not with all rays or targets.
        begin = self._first[stopped]
        lost = self._target[concatenated_ranges(begin, self._first[stopped + 1] - begin)]
        seen: Boolean = self._times > np.bincount(lost, minlength=len(self._times))
        # The stopped rays that return from the road user may see targets near its surface: these are added.
        seen[self._seen_by(present, stopped, directions[sooner], distance[sooner], triangle[sooner])[1]] = True
        return seen

    def _through(self, hulls: Float) -> Integer:
        """Return the rays that may pass through hulls (k, 8, 3), given in the axes of the scan."""
        position = self._position
        return self._windows.rays_towards((hulls - position.origin) @ level_orientation(position.yaw))[1]

    def _seen_by(
        self, position: ScanPosition, ray: Integer, directions: Float, distance: Float, triangle: Integer
    ) -> tuple[Integer, Integer]:
        """Return pairs of rays and the targets that their returns see, in the order of the rays."""
        which, target = position.pairs_seen(directions, distance, triangle, self._surfaces, self._index)
        return ray[which], target
