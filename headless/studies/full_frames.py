"""Frames in which every ray is cast against the whole scene: the reference for frames with cached returns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seip_addon.core.base.arrays import Integer
from seip_addon.core.geometry.orientation import rotations
from seip_addon.core.sensing.lidar.noisy_returns import return_chance
from seip_addon.core.sensing.scans.frame import STATIC_INSTANCE
from seip_addon.core.sensing.scans.scanner import ReflectiveSurface, Scan, Scanner
from seip_addon.core.sensing.scans.static_scene import StaticScene
from seip_addon.core.sensing.traffic.bodies import Body
from seip_addon.core.sensing.traffic.trajectories import Snapshot
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.settings import Engine

SLACK = 1e-4
"""Distance by which the same return may differ, metres."""

_RAYS_AT_ONCE = 1 << 17


def combined(
    static: StaticScene, bodies: Sequence[Body], snapshot: Snapshot, engine: Engine
) -> tuple[ReflectiveSurface, Integer]:
    """Return the surface of the static scene with an instant's road users, and the owner of each triangle."""
    placed = [
        position + bodies[user].triangles @ attitude.T
        for user, position, attitude in zip(
            snapshot.user, snapshot.position, rotations(snapshot.yaw, snapshot.pitch), strict=True
        )
    ]
    owner = [np.full(len(static.triangles), STATIC_INSTANCE)]
    owner += [np.full(len(bodies[user].triangles), user) for user in snapshot.user]
    reflectivity = [static.reflectivity, *(bodies[user].reflectivity for user in snapshot.user)]
    caster = make_ray_caster(np.concatenate([static.triangles, *placed]), engine)
    return ReflectiveSurface(caster, np.concatenate(reflectivity)), np.concatenate(owner)


def full_scan(scanner: Scanner, surface: ReflectiveSurface, owner: Integer, users: int) -> Scan:
    """Cast every ray of a sensor against the whole scene."""
    model, rays = scanner.sensor.model, len(scanner.directions)
    distance, intensity, reflected = np.full(rays, np.inf), np.zeros(rays), np.zeros(rays)
    instance = np.full(rays, STATIC_INSTANCE, dtype=np.int32)
    for begin in range(0, rays, _RAYS_AT_ONCE):
        directions = scanner.directions[begin : begin + _RAYS_AT_ONCE]
        far, triangle = surface.caster.cast(scanner.sensor.xyz, directions, model.max_range)
        hit = np.flatnonzero(triangle >= 0)
        distance[begin + hit] = far[hit]
        reflected[begin + hit] = surface.reflected(directions[hit], triangle[hit])
        intensity[begin + hit] = model.law.intensity(far[hit], reflected[begin + hit])
        instance[begin + hit] = owner[triangle[hit]]
    chance = return_chance(model, distance, reflected).astype(np.float32)
    nobody = np.zeros(users, dtype=np.int64)
    return Scan(distance, distance, intensity, chance, instance, nobody, nobody)


def differing(one: Scan, other: Scan) -> Integer:
    """Return the rays that do not end at the same distance on the same object."""
    hit, there = np.isfinite(one.distance), np.isfinite(other.distance)
    both = hit & there
    apart = hit != there
    apart[both] = np.abs(one.distance[both] - other.distance[both]) > SLACK
    return np.flatnonzero(apart | (one.instance != other.instance))
