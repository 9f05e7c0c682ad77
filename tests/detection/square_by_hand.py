"""A square with two vehicles and two sensors, simulated, not made up."""

from dataclasses import replace

import numpy as np
import shapely

from seip_addon.core.lidar import load_catalogue
from seip_addon.core.scans import MountedSensor, StaticScene, level_orientation
from seip_addon.core.traffic import Trajectories
from seip_addon.core.traffic.trajectories import RoadUser


def road():
    """A level square of 80 m, and a car and a van that drive east, one behind the other."""
    corners = np.array([[-40.0, -40, 0], [40, -40, 0], [40, 40, 0], [-40, 40, 0]])
    triangles = corners[[[0, 1, 2], [0, 2, 3]]]
    static = StaticScene(triangles, np.full(2, 0.3), shapely.box(-30, -30, 30, 30))
    users = (RoadUser("one", "car", 4.5, 1.8, 1.5), RoadUser("other", "van", 5.5, 2.0, 2.2))
    time = np.array([0.0, 4.0])
    trajectories = Trajectories(
        users=users,
        origin=np.zeros(3),
        first=np.array([0, 2, 4]),
        time=np.tile(time, 2),
        position=np.array([[-20.0, 2, 0], [20, 2, 0], [-30, 2, 0], [10, 2, 0]]),
        yaw=np.zeros(4),
        pitch=np.zeros(4),
        speed=np.full(4, 10.0),
    )
    return static, trajectories


def sensors():
    model = replace(load_catalogue()["type1"], dropoff_general=0.1)
    return tuple(
        MountedSensor(f"S{number}", model, np.array(place), level_orientation(0.3 * number))
        for number, place in enumerate([(-8.0, -6.0, 5.0), (12.0, 9.0, 6.0)])
    )
