"""Full scans, which cast every ray: the reference for visibility."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from seip_addon.core.base.arrays import Boolean
from seip_addon.core.geometry.orientation import orientation as orientation_of
from seip_addon.core.sensing.lidar.beams import BeamPattern
from seip_addon.core.sensing.visibility.near_surfaces import NearSurfaces, rotated_surfaces
from seip_addon.core.sensing.visibility.scanning import ScanPosition
from seip_addon.core.sensing.visibility.target_index import TargetIndex
from seip_addon.core.sensing.visibility.visibility_model import is_upright, yaw_of

_RAYS_AT_ONCE = 1 << 17  # bounds the memory of rays that are cast at once


def seen_by_all_rays(position: ScanPosition, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find the targets that are seen by casting every ray: the reference."""
    pattern, index = BeamPattern(position.model, position.yaw), TargetIndex(surfaces.xyz, position.settings.delta)
    rays = np.arange(position.model.channels * position.model.azimuth_count)
    seen = np.zeros(len(surfaces.xyz), dtype=bool)
    for begin in range(0, len(rays), _RAYS_AT_ONCE):
        directions = pattern.directions(rays[begin : begin + _RAYS_AT_ONCE])
        seen[position.pairs_seen(directions, *position.cast(directions), surfaces, index)[1]] = True
    return seen, len(rays)


def seen_by_tilted_full_scan(position: ScanPosition, tilt: float, surfaces: NearSurfaces) -> tuple[Boolean, int]:
    """Find the targets that a sensor tilted by an angle (radians) sees, by casting every ray: the reference."""
    if tilt == 0:
        return seen_by_all_rays(position, surfaces)
    orientation = orientation_of(position.yaw, tilt)
    if is_upright(orientation):
        return seen_by_all_rays(replace(position, yaw=yaw_of(orientation)), surfaces)
    in_axes = rotated_surfaces(surfaces, position.origin, orientation)
    return seen_by_all_rays(position.in_sensor_axes(orientation), in_axes)
