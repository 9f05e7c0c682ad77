"""A run of traffic at the small junction: a car and a bus."""

import numpy as np

from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from tests.builders.small_junction import ORIGIN


def car_and_bus(y, seconds=8.0) -> Trajectories:
    """Return a car that drives along +x, and one that stands."""
    times = np.arange(int(seconds * 5)) / 5
    count = len(times)
    moving = np.column_stack([-30 + 6 * times, np.full(count, y), np.zeros(count)])
    standing = np.tile([10.0 + y, -y, 0.0], (count, 1))
    return Trajectories(
        users=(RoadUser("moving", "car", 4.5, 1.8, 1.5), RoadUser("standing", "bus", 12.0, 2.5, 3.2)),
        origin=np.zeros(3),
        first=np.array([0, count, 2 * count]),
        time=np.concatenate([times, times]),
        position=np.concatenate([moving, standing]) + ORIGIN,
        yaw=np.zeros(2 * count),
        pitch=np.zeros(2 * count),
        speed=np.concatenate([np.full(count, 6.0), np.zeros(count)]),
        source=f"by hand, {y}",
    )
