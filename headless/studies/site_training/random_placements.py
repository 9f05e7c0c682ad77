"""Random placements, to train detectors for any placement."""

from __future__ import annotations

from collections.abc import Mapping

from headless.detection.recordings import MountedSensors

import numpy as np

from seip_addon.core.errors import SeipError
from seip_addon.core.geometry.orientation import orientation
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.site.candidates import Candidates

MAX_SENSORS = 5  # of a random placement


def random_placement(
    name: str, candidates: Candidates, models: Mapping[str, LidarModel], random: np.random.Generator
) -> MountedSensors:
    """Return 1 to `MAX_SENSORS` sensors at different positions; positions, and then their poses, are equally likely.

    Half of the placements have sensors of only one type.

    Raises
    ------
    SeipError
        There are no candidates.
    """
    positions = np.unique(candidates.position_of)
    if not len(positions):
        raise SeipError("the site has no candidate position for a random sensor: see the warnings of the site")
    count = int(random.integers(1, min(MAX_SENSORS, len(positions)) + 1))
    types = sorted(models)
    if random.integers(2):
        types = [types[int(random.integers(len(types)))]]
    sensors = []
    for number, position in enumerate(random.choice(positions, count, replace=False).tolist(), 1):
        sensor_type = types[int(random.integers(len(types)))]
        here = candidates.position_of == position
        poses = np.flatnonzero(here & (candidates.sensor == sensor_type))
        if not len(poses):
            poses = np.flatnonzero(here)
        pose = int(poses[int(random.integers(len(poses)))])
        rotation = orientation(float(candidates.yaw[pose]), float(candidates.tilt[pose]))
        sensors.append(
            MountedSensor(f"S{number}", models[str(candidates.sensor[pose])], candidates.xyz[pose], rotation)
        )
    return MountedSensors(name, tuple(sensors))
