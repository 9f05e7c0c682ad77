"""Speed of simulated frames of traffic, with cached returns and by casting every ray."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

from headless.studies.benchmark.resource_usage import Expense
from headless.studies.benchmark.visibility import ENGINES

import numpy as np

from seip_addon.core.base.arrays import Float, Integer
from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.orientation import rotations
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.lidar.noisy_returns import return_chance
from seip_addon.core.sensing.scans.frame import STATIC_INSTANCE
from seip_addon.core.sensing.scans.scanner import ReflectiveSurface, Scan, Scanner
from seip_addon.core.sensing.scans.sensor import MountedSensor, level_orientation
from seip_addon.core.sensing.scans.simulation import ScanSettings, Simulation, prepare
from seip_addon.core.sensing.scans.static_scene import StaticScene
from seip_addon.core.sensing.traffic.bodies import Body, fitted_body
from seip_addon.core.sensing.traffic.trajectories import RoadUser, Snapshot, Trajectories
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.settings import Engine
from seip_addon.core.site.site import Site

SENSORS, ROAD_USERS = 4, 40
SLACK = 1e-4
"""Distance by which the same return may differ, metres."""

_RAYS_AT_ONCE = 1 << 17

_SIZES = (("car", 4.5, 1.8, 1.5), ("car", 3.9, 1.7, 1.5), ("van", 5.6, 2.0, 2.4), ("truck", 9.0, 2.5, 3.5))
_SPEED, _SECONDS, _GAP = 8.0, 10.0, 6.0  # metres per second, seconds, metres


@dataclass
class ScanCost:
    """Cost of simulated frames.

    Parameters
    ----------
    rays, differing : int
        Rays of all sensors in all frames, and those whose return differs from the full scan's.
    """

    expense: Expense = field(default_factory=Expense)
    rays: int = 0
    differing: int = 0


def scan_costs(site: Site, static: StaticScene, model: LidarModel, frames: int) -> dict[str, ScanCost]:
    """Simulate the same frames of four sensors and forty moving road users by both methods with each ray caster.

    Parameters
    ----------
    site : Site
        Site whose candidate positions, evenly spread, carry the sensors.

    Returns
    -------
    dict of str to ScanCost
        Cost of all frames by method and ray caster: ``full bvh``, ``cached bvh``, ``full embree``, ``cached embree``.
    """
    positions = site.candidates.xyz[np.linspace(0, len(site.candidates) - 1, SENSORS).astype(int)]
    sensors = [
        MountedSensor(f"S{number}", model, xyz, level_orientation(0.0)) for number, xyz in enumerate(positions, start=1)
    ]
    traffic = moving_traffic(site)
    bodies = [fitted_body(user) for user in traffic.users]
    costs: dict[str, ScanCost] = {}
    for engine in ENGINES:
        simulation = finish(prepare(static, sensors, traffic, bodies, ScanSettings(engine=engine)))
        full = costs[f"full {engine}"] = ScanCost()
        cached = costs[f"cached {engine}"] = ScanCost()
        for number in range(frames):
            snapshot = traffic.at(number / model.rotation_rate)
            cached.expense.time(partial(simulation.frame, number, snapshot.time))
            scans = full.expense.time(partial(_full_frame, simulation, static, bodies, number, snapshot, engine))
            for scan, reference in zip(simulation.scans(snapshot), scans, strict=True):
                cached.differing += len(differing(scan, reference))
        full.rays = cached.rays = frames * sum(len(scanner.directions) for scanner in simulation.scanners)
    return costs


def _full_frame(
    simulation: Simulation,
    static: StaticScene,
    bodies: Sequence[Body],
    number: int,
    snapshot: Snapshot,
    engine: Engine,
) -> list[Scan]:
    """Simulate a frame by casting every ray of it against the whole scene, and return the scans of its sensors."""
    surface, owner = combined(static, bodies, snapshot, engine)
    scans = [full_scan(scanner, surface, owner, len(bodies)) for scanner in simulation.scanners]
    simulation.measure(number, snapshot, scans)
    return scans


def moving_traffic(site: Site) -> Trajectories:
    """Return road users of several sizes that start at random targets of the site and drive straight ahead."""
    random = np.random.default_rng(0)
    start: list[Float] = []
    for xyz in random.permutation(site.targets.xyz):
        if len(start) < ROAD_USERS and all(math.dist(xyz[:2], other[:2]) > _GAP for other in start):
            start.append(xyz)
    yaw = random.uniform(-math.pi, math.pi, len(start))
    travel = _SPEED * _SECONDS * np.stack([np.cos(yaw), np.sin(yaw), np.zeros(len(yaw))], axis=1)
    users = [RoadUser(f"{number}", *_SIZES[number % len(_SIZES)]) for number in range(len(start))]
    return Trajectories(
        users=tuple(users),
        origin=site.origin,
        first=2 * np.arange(len(start) + 1),
        time=np.tile([0.0, _SECONDS], len(start)),
        position=np.stack([start, start + travel], axis=1).reshape(-1, 3),
        yaw=np.repeat(yaw, 2),
        pitch=np.zeros(2 * len(start)),
        speed=np.full(2 * len(start), _SPEED),
    )


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
