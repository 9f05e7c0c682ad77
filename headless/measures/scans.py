"""Frames of scans: static returns kept and vehicles cast in their own axes, against the whole scene cast anew."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seip_addon.core.arrays import Integer
from seip_addon.core.lidar import return_chance
from seip_addon.core.scans import StaticScene
from seip_addon.core.scans.frame import STATIC
from seip_addon.core.scans.motion import rotations
from seip_addon.core.scans.scanner import Scan, Scanner, Shape, Surface
from seip_addon.core.traffic import Snapshot
from seip_addon.core.visibility.ray_casting import Engine, make_ray_caster

_RAYS_AT_ONCE = 1 << 17
SAME = 1e-4
"""Metres by which the same return may differ."""


def combined(
    static: StaticScene, bodies: Sequence[Shape], snapshot: Snapshot, engine: Engine
) -> tuple[Surface, Integer]:
    """Put the road users of an instant among what stands still; return that, and which road user each triangle is."""
    placed = [
        position + bodies[user].triangles @ attitude.T
        for user, position, attitude in zip(
            snapshot.user, snapshot.position, rotations(snapshot.yaw, snapshot.pitch), strict=True
        )
    ]
    owner = [np.full(len(static.triangles), STATIC)]
    owner += [np.full(len(bodies[user].triangles), user) for user in snapshot.user]
    reflectivity = [static.reflectivity, *(bodies[user].reflectivity for user in snapshot.user)]
    caster = make_ray_caster(np.concatenate([static.triangles, *placed]), engine)
    return Surface(caster, np.concatenate(reflectivity)), np.concatenate(owner)


def full_scan(scanner: Scanner, surface: Surface, owner: Integer, users: int) -> Scan:
    """Cast every ray of a sensor against everything."""
    model, rays = scanner.sensor.model, len(scanner.directions)
    distance, intensity = np.full(rays, np.inf), np.zeros(rays)
    instance = np.full(rays, STATIC, dtype=np.int32)
    for begin in range(0, rays, _RAYS_AT_ONCE):
        directions = scanner.directions[begin : begin + _RAYS_AT_ONCE]
        far, triangle = surface.caster.cast(scanner.sensor.xyz, directions, model.max_range)
        hit = np.flatnonzero(triangle >= 0)
        distance[begin + hit] = far[hit]
        intensity[begin + hit] = surface.intensity(model, directions[hit], far[hit], triangle[hit])
        instance[begin + hit] = owner[triangle[hit]]
    nobody = np.zeros(users, dtype=np.int64)
    chance = return_chance(model, distance, intensity).astype(np.float32)
    return Scan(distance, intensity, chance, instance, nobody, nobody)


def differing(one: Scan, other: Scan) -> Integer:
    """Return the rays that do not end at the same place on the same thing."""
    hit, there = np.isfinite(one.distance), np.isfinite(other.distance)
    both = hit & there
    apart = hit != there
    apart[both] = np.abs(one.distance[both] - other.distance[both]) > SAME
    return np.flatnonzero(apart | (one.instance != other.instance))
