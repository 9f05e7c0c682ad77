"""Full scans, which cast every ray: the reference for visibility."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from seip_addon.core.base.arrays import Boolean
from seip_addon.core.geometry.orientation import orientation as orientation_of
from seip_addon.core.sensing.visibility.near_surfaces import NearSurfaces, rotated_surfaces
from seip_addon.core.sensing.visibility.scanning import ScanPosition, seen_by_rays
from seip_addon.core.sensing.visibility.target_index import TargetIndex
from seip_addon.core.sensing.visibility.visibility_model import is_upright, yaw_of


def seen_by_all_rays(position: ScanPosition, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find the targets that are seen by casting every ray: the reference."""
    rays = np.arange(position.model.channels * position.model.azimuth_count)
    return seen_by_rays(position, rays, surfaces, TargetIndex(surfaces.xyz, position.settings.delta)), len(rays)


def seen_by_tilted_full_scan(position: ScanPosition, tilt: float, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find the targets that a sensor tilted by an angle (radians) sees, by casting every ray: the reference."""
    if tilt == 0:
        return seen_by_all_rays(position, surfaces)
    orientation = orientation_of(position.yaw, tilt)
    if is_upright(orientation):
        return seen_by_all_rays(replace(position, yaw=yaw_of(orientation)), surfaces)
    in_axes = rotated_surfaces(surfaces, position.origin, orientation)
    return seen_by_all_rays(position.in_sensor_axes(orientation), in_axes)
