"""Sensors, road users and ways made by hand, small enough to be scanned in a moment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from seip_addon.core.sensing.lidar.carla_dropoff import CarlaDropoff
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.scans.sensor import MountedSensor, level_orientation
from seip_addon.core.sensing.scans.static_scene import StaticScene
from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from tests.builders.small_junction import box_triangles, flat_triangles

REGION = shapely.box(-40, -40, 40, 40)


@dataclass(frozen=True, eq=False)
class Body:
    triangles: np.ndarray
    reflectivity: np.ndarray


def box_body(user: RoadUser, reflectivity: float = 0.5) -> Body:
    """Return a box of a road user's size, which says where it ends."""
    half = (user.length / 2, user.width / 2)
    triangles = box_triangles((-half[0], -half[1], 0.0), (half[0], half[1], user.height))
    return Body(triangles, np.full(len(triangles), reflectivity))


def make_model(**changes) -> LidarModel:
    figures = {
        "key": "test",
        "name": "Test",
        "manufacturer": "Test",
        "source": "Test",
        "elevations": np.radians([4.0, 0.0, -2.0, -4.0, -8.0, -16.0, -25.0]),
        "min_range": 0.0,
        "max_range": 100.0,
        "points_per_second": 7 * 720 * 10.0,
        "rotation_rate": 10.0,
        "price_range": (1.0, 2.0),
        "law": CarlaDropoff(attenuation=0.01, general=0.2),
    }
    return LidarModel(**figures | changes)


def make_sensor(xyz=(0.0, 0.0, 4.0), yaw=0.0, label="S1", **changes) -> MountedSensor:
    return MountedSensor(label, make_model(**changes), np.array(xyz, dtype=float), level_orientation(yaw))


def make_trajectories(*ways, users: Sequence[RoadUser] | None = None) -> Trajectories:
    """Return motions given as lists of (time, x, y, z, yaw, pitch)."""
    rows = np.array([sample for way in ways for sample in way], dtype=float).reshape(-1, 6)
    counts = [len(way) for way in ways]
    return Trajectories(
        users=tuple(users or (RoadUser(f"car {n}", "car", 4.0, 2.0, 1.5) for n in range(len(ways)))),
        origin=np.zeros(3),
        first=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        time=rows[:, 0],
        position=rows[:, 1:4],
        yaw=rows[:, 4],
        pitch=rows[:, 5],
        speed=np.full(len(rows), 3.0),
    )


def parked(*poses) -> Trajectories:
    """Return road users that stand at (x, y, z, yaw, pitch) for ten seconds."""
    return make_trajectories(*([(0.0, *pose), (10.0, *pose)] for pose in poses))


def ground(half: float = 60.0) -> np.ndarray:
    return flat_triangles((-half, -half, half, half))


def make_static(*parts: np.ndarray, reflectivity: float = 0.3) -> StaticScene:
    triangles = np.concatenate([np.empty((0, 3, 3)), *parts])
    return StaticScene(triangles, np.full(len(triangles), reflectivity), REGION)
