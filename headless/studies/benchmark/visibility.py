"""Time of full scans and of the lazy engine, which must compute the same grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from headless.studies.benchmark.resource_usage import Expense

import numpy as np

from seip_addon.core.base.arrays import Boolean, Integer
from seip_addon.core.base.errors import SeipError
from seip_addon.core.geometry.orientation import orientation as orientation_of
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.visibility.chunks import compute_rows, sharing_rays
from seip_addon.core.sensing.visibility.near_surfaces import NearSurfaces, near_surfaces, rotated_surfaces
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.scanning import ScanPosition, seen_by_rays
from seip_addon.core.sensing.visibility.settings import Engine, VisibilitySettings
from seip_addon.core.sensing.visibility.target_index import TargetIndex
from seip_addon.core.sensing.visibility.visibility_model import VisibilityModel, is_upright, yaw_of
from seip_addon.core.site.site import Site

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


def sampled_positions(site: Site, samples: int) -> list[Integer]:
    """Return positions evenly spread over a site, each as its poses."""
    every = sharing_rays(site.candidates.xyz, site.candidates.yaw, site.candidates.tilt)
    return [every[number] for number in np.unique(np.linspace(0, len(every) - 1, samples).astype(int))]


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
    groups = sampled_positions(site, samples)
    costs: dict[str, Cost] = {}
    for engine in ENGINES:
        costs |= _full_and_lazy(site, models, settings, engine, groups)
    return costs


def _full_and_lazy(
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    engine: Engine,
    groups: Sequence[Integer],
) -> dict[str, Cost]:
    """Compute visibility of groups of poses, one position each, by full scans and lazily; the grids must be equal."""
    candidates = site.candidates
    surfaces = near_surfaces(site.triangles, site.targets.xyz, settings.delta, site.reflectivity)
    caster = make_ray_caster(site.triangles, engine)
    lazy_model = VisibilityModel(site.targets.xyz, site.reflectivity, settings, caster)
    full, lazy = Cost(), Cost()
    for poses in groups:
        first = poses[0]
        used = [models[key] for key in candidates.sensor[poses].tolist()]
        yaw, tilt = float(candidates.yaw[first]), float(candidates.tilt[first])
        position = ScanPosition(caster, candidates.xyz[first], yaw, used, settings, site.reflectivity)
        full_grid, rays = full.expense.time(partial(seen_by_tilted_full_scan, position, tilt, surfaces))
        full.add(rays, full_grid)
        rows = lazy.expense.time(partial(compute_rows, lazy_model, candidates, models, poses))
        lazy_grid = np.unpackbits(rows.packed, axis=1, count=lazy_model.targets).astype(bool)
        lazy.add(rows.rays, lazy_grid)
        if (full_grid != lazy_grid).any():
            raise SeipError(f"pose {first}: the lazy {engine} grid differs from the full scan: a defect")
    return {f"full {engine}": full, f"lazy {engine}": lazy}


def seen_by_all_rays(position: ScanPosition, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find the targets that are seen by casting every ray of every sensor: the reference."""
    index = TargetIndex(surfaces.xyz, position.settings.delta)
    rays = [np.arange(model.channels * model.azimuth_count) for model in position.models]
    seen = [
        seen_by_rays(position, model, own, surfaces, index) for model, own in zip(position.models, rays, strict=True)
    ]
    return np.array(seen), sum(map(len, rays))


def seen_by_tilted_full_scan(position: ScanPosition, tilt: float, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find the targets that sensors tilted by an angle (radians) see, by casting every ray: the reference."""
    if tilt == 0:
        return seen_by_all_rays(position, surfaces)
    orientation = orientation_of(position.yaw, tilt)
    if is_upright(orientation):
        return seen_by_all_rays(replace(position, yaw=yaw_of(orientation)), surfaces)
    in_axes = rotated_surfaces(surfaces, position.origin, orientation)
    return seen_by_all_rays(position.in_sensor_axes(orientation), in_axes)
