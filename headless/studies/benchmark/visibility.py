"""Time of full scans and of the lazy engine, which must compute the same grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from headless.studies.benchmark.resource_usage import Expense

import numpy as np
import shapely

from seip_addon.core.base.arrays import Boolean, Float, Integer
from seip_addon.core.base.errors import SeipError
from seip_addon.core.geometry.orientation import orientation as orientation_of
from seip_addon.core.sensing.lidar.beams import BeamPattern
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.visibility.grid import seen_from
from seip_addon.core.sensing.visibility.near_surfaces import NearSurfaces, near_surfaces, rotated_surfaces
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.scanning import ScanPosition, is_within, squared_length
from seip_addon.core.sensing.visibility.settings import Engine, VisibilitySettings
from seip_addon.core.sensing.visibility.visibility_model import VisibilityModel, is_upright, yaw_of
from seip_addon.core.site.site import Site

RAYS_AT_ONCE = 1 << 17  # bounds the memory of rays that are cast at once
ENGINES: tuple[Engine, ...] = ("bvh", "embree")


@dataclass
class Cost:
    """Cost of a method to compute visibility, summed over positions.

    Parameters
    ----------
    seen : int
        Visible pairs of pose and target.
    """

    expense: Expense = field(default_factory=Expense)
    rays: int = 0
    seen: int = 0

    def add(self, rays: int, visible: Boolean) -> None:
        """Add the rays and the visible pairs of one position."""
        self.rays += rays
        self.seen += int(visible.sum())


def sampled_poses(site: Site, samples: int) -> list[int]:
    """Return poses evenly spread over a site."""
    return sorted(set(np.linspace(0, len(site.candidates) - 1, samples).astype(int).tolist()))


def visibility_costs(
    site: Site, models: Mapping[str, LidarModel], settings: VisibilitySettings, samples: int
) -> dict[str, Cost]:
    """Compute visibility at sampled positions by full scans and lazily, with each ray caster.

    Parameters
    ----------
    samples : int
        Number of positions, evenly spread over the site.

    Returns
    -------
    dict of str to Cost
        Costs by method: ``full bvh``, ``lazy bvh``, ``full embree``, ``lazy embree``.

    Raises
    ------
    SeipError
        A lazy result differs from its full scan.
    """
    poses = sampled_poses(site, samples)
    costs: dict[str, Cost] = {}
    for engine in ENGINES:
        costs |= _full_and_lazy(site, models, settings, engine, poses)
    return costs


def _full_and_lazy(
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    engine: Engine,
    poses: Sequence[int],
) -> dict[str, Cost]:
    """Compute visibility of poses by full scans and lazily; the grids must be equal."""
    candidates = site.candidates
    surfaces = near_surfaces(site.triangles, site.targets.xyz, settings.delta, site.reflectivity)
    caster = make_ray_caster(site.triangles, engine)
    lazy_model = VisibilityModel(site.targets.xyz, site.reflectivity, settings, caster)
    full, lazy = Cost(), Cost()
    for pose in poses:
        used = models[str(candidates.sensor[pose])]
        yaw, tilt = float(candidates.yaw[pose]), float(candidates.tilt[pose])
        position = ScanPosition(caster, candidates.xyz[pose], yaw, used, settings, site.reflectivity)
        full_grid, rays = full.expense.time(partial(seen_by_tilted_full_scan, position, tilt, surfaces))
        full.add(rays, full_grid)
        lazy_grid, rays = lazy.expense.time(partial(seen_from, lazy_model, candidates, models, pose))
        lazy.add(rays, lazy_grid)
        if (full_grid != lazy_grid).any():
            raise SeipError(f"pose {pose}: the lazy {engine} grid differs from the full scan: a defect")
    return {f"full {engine}": full, f"lazy {engine}": lazy}


def seen_by_all_rays(position: ScanPosition, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find the targets that are seen by casting every ray: the reference."""
    pattern, delta = BeamPattern(position.model, position.yaw), position.settings.delta
    rays = np.arange(position.model.channels * position.model.azimuth_count)
    seen = np.zeros(len(surfaces.xyz), dtype=bool)
    for begin in range(0, len(rays), RAYS_AT_ONCE):
        directions = pattern.directions(rays[begin : begin + RAYS_AT_ONCE])
        distance, triangle = position.cast(directions)
        returns = np.flatnonzero(position.counting(directions, distance, triangle))
        directions, distance = directions[returns], distance[returns]
        # a return may see several targets, and the strength at borders depends on the target's surfaces: pairs of both
        ray, target = pairs_within(position.origin + distance[:, None] * directions, surfaces.xyz, delta)
        strong = position.counting_at_borders(surfaces, directions[ray], distance[ray], target)
        seen[target[strong]] = True
    return seen, len(rays)


def pairs_within(points: Float, targets: Float, delta: float) -> tuple[Integer, Integer]:
    """Return each of some points (n, 3) with each target (t, 3) that is nearer than δ to it, points ascending."""
    tree = shapely.STRtree(shapely.points(targets[:, :2]))
    point, target = tree.query(shapely.points(points[:, :2]), predicate="dwithin", distance=delta * (1 + 1e-6))
    near = is_within(squared_length(points[point] - targets[target]), delta)
    return point[near], target[near]


def seen_by_tilted_full_scan(position: ScanPosition, tilt: float, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find the targets that a sensor tilted by an angle (radians) sees, by casting every ray: the reference."""
    if tilt == 0:
        return seen_by_all_rays(position, surfaces)
    orientation = orientation_of(position.yaw, tilt)
    if is_upright(orientation):
        return seen_by_all_rays(replace(position, yaw=yaw_of(orientation)), surfaces)
    in_axes = rotated_surfaces(surfaces, position.origin, orientation)
    return seen_by_all_rays(position.in_sensor_axes(orientation), in_axes)
