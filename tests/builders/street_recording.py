"""Recordings of spinning LiDARs, simulated without the project's scanner: plain formulas for rays and surfaces."""

from dataclasses import dataclass

import numpy as np

from seip_addon.core.sensing.lidar.beams import BeamPattern
from seip_addon.core.sensing.recordings.sweep_files import Sweep

CANYON = ((0, 35.0), (0, -25.0), (1, 12.0), (1, -28.0))
"""Walls of a square: axis and its coordinate, metres from the sensor."""


@dataclass(frozen=True)
class MemoryRecord:
    """Sweeps in memory, in place of a `SensorRecording`."""

    name: str
    sweeps: tuple
    times: np.ndarray

    def __len__(self):
        return len(self.sweeps)

    def sweep(self, number):
        return self.sweeps[number]


def memory_record(name, clouds, rate=10.0, intensities=None):
    """Return the record of clouds (n, 3) in the sensor's axes."""
    intensities = intensities or [None] * len(clouds)
    sweeps = tuple(Sweep(cloud, intensity) for cloud, intensity in zip(clouds, intensities, strict=True))
    return MemoryRecord(name, sweeps, np.arange(len(clouds)) / rate)


def canyon_sweeps(model, count=6, seed=0, *, jitter=0.0, half_at=None, twice=False):
    """Return sweeps between walls 12 m high, from a sensor 5 m above the ground, and which rays meet anything.

    ``jitter`` is the spread of azimuths in steps; ``half_at`` rounds the coordinates to half precision in axes whose
    origin is so many metres from the sensor; ``twice`` gives each ray a second return.
    """
    random = np.random.default_rng(seed)
    rays = BeamPattern(model).directions(np.arange(model.channels * model.azimuth_count))
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = [np.where(rays[:, 2] < 0, -5.0 / rays[:, 2], np.inf)]
        for axis, at in CANYON:
            met = at / rays[:, axis]
            reach.append(np.where(met > 0, met, np.inf))
    distance = np.minimum.reduce(reach)
    hit = (distance < min(model.max_range, 80.0)) & (distance * rays[:, 2] < 12.0)
    chance = np.where(hit, np.clip(1.2 - distance / 100.0, 0.2, 0.95), 0.0)
    sweeps = []
    for _ in range(count):
        one = np.flatnonzero(random.random(len(rays)) < chance)
        one = np.repeat(one, 2) if twice else one
        measured = distance[one] + random.normal(0, 0.02, len(one))
        angle = random.normal(0, jitter * model.azimuth_step, len(one)) if jitter else np.zeros(len(one))
        x, y, z = rays[one].T
        turned = np.column_stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, z])
        points = turned * measured[:, None]
        if half_at is not None:
            origin = np.array([half_at, 0.0, 0.0])
            points = (points + origin).astype(np.float16).astype(np.float64) - origin
        sweeps.append(points.astype(np.float32))
    return sweeps, hit.reshape(model.channels, -1)
