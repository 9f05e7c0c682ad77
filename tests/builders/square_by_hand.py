"""A square with a few vehicles and two sensors, simulated, not made up."""

from dataclasses import replace

import numpy as np
import shapely

from seip_addon.core.sensing.lidar.carla_dropoff import CarlaDropoff
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.sensor import MountedSensor, level_orientation
from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry


def road():
    """A level square of 80 m, a car and a van that drive east, one behind the other, and four parked cars."""
    corners = np.array([[-40.0, -40, 0], [40, -40, 0], [40, 40, 0], [-40, 40, 0]])
    triangles = corners[[[0, 1, 2], [0, 2, 3]]]
    surface = Mesh("road", triangles, np.full(2, 0.3))
    geometry = SceneGeometry("Square", np.zeros(3), (surface,), (), (), shapely.box(-30, -30, 30, 30))
    parked = tuple(RoadUser(f"parked {number}", "car", 4.5, 1.8, 1.5) for number in range(4))
    users = (RoadUser("one", "car", 4.5, 1.8, 1.5), RoadUser("other", "van", 5.5, 2.0, 2.2), *parked)
    driving = [[-20.0, 2, 0], [20, 2, 0], [-30, 2, 0], [10, 2, 0]]
    standing = [[x, -10.0, 0] for x in (-24, -12, 0, 12) for _ in range(2)]
    trajectories = Trajectories(
        users=users,
        origin=np.zeros(3),
        first=np.arange(0, 13, 2),
        time=np.tile([0.0, 4.0], 6),
        position=np.array(driving + standing),
        yaw=np.zeros(12),
        pitch=np.zeros(12),
        speed=np.repeat([10.0, 0.0], [4, 8]),
    )
    return geometry, trajectories


def sensors():
    model = replace(load_catalogue()["type1"], law=CarlaDropoff(general=0.1))
    return tuple(
        MountedSensor(f"S{number}", model, np.array(place), level_orientation(0.3 * number))
        for number, place in enumerate([(-8.0, -6.0, 5.0), (12.0, 9.0, 6.0)])
    )
