"""Ray casting and visibility written plainly in float64: what the engines are held to."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.sensing.lidar.model import LidarModel

Float = NDArray[np.float64]


def first_hits(origin: Float, directions: Float, triangles: Float) -> Float:
    """Distance to the first triangle by Möller and Trumbore (1997), infinite on a miss, (n,)."""
    a = triangles[None, :, 0]
    ab, ac = triangles[None, :, 1] - a, triangles[None, :, 2] - a
    ray = directions[:, None, :]
    p = np.cross(ray, ac)
    determinant = (ab * p).sum(axis=2)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        to_origin = origin - a
        u = (to_origin * p).sum(axis=2) / determinant
        q = np.cross(to_origin, ab)
        v = (ray * q).sum(axis=2) / determinant
        t = (ac * q).sum(axis=2) / determinant
        hit = (determinant != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    return np.where(hit, t, np.inf).min(axis=1, initial=np.inf)


def scan_directions(model: LidarModel, yaw: float) -> Float:
    """One revolution or frame from sines and cosines of each ray's own angles, (n, 3)."""
    view, count = model.field_of_view, model.azimuth_count
    begin = 0.0 if view == 2 * math.pi else view / 2 / count - view / 2
    rays = [
        (
            math.cos(elevation) * math.cos(yaw + offset + begin + view * step / count),
            math.cos(elevation) * math.sin(yaw + offset + begin + view * step / count),
            math.sin(elevation),
        )
        for elevation, offset in zip(model.elevations, model.azimuth_offsets, strict=True)
        for step in range(count)
    ]
    return np.array(rays)


def nearest_return(origin: Float, yaw: float, model: LidarModel, triangles: Float, targets: Float) -> Float:
    """Distance from each target to the nearest return of the full scan, (t,)."""
    directions = scan_directions(model, yaw)
    distance = first_hits(origin, directions, triangles)
    returned = (distance >= model.min_range) & (distance <= model.max_range)
    points = origin + distance[returned, None] * directions[returned]
    return np.linalg.norm(points[None] - targets[:, None], axis=2).min(axis=1, initial=np.inf)
