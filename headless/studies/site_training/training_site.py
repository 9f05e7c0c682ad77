"""Training site: runs of traffic, and scans of them by random placements."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace

from headless.detection.detection_area import DetectionArea
from headless.detection.frames import Recording
from headless.detection.recordings import MountedSensors, SampledRun, Simulator
from headless.studies.random_sites.companions import with_companions
from headless.studies.random_sites.varied_bodies import resized
from headless.studies.simulated_recordings import recorded

import numpy as np

from seip_addon.core.progress import Progress
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.site.candidates import Candidates
from seip_addon.core.site.scene_geometry import SceneGeometry

from .field_conditions import field_recording
from .random_placements import random_placement

SIZE_CHANGE = 0.15
"""Largest relative change of the dimensions of road users in field conditions."""


@dataclass(frozen=True, eq=False)
class TrainingSite:
    """A training site.

    Parameters
    ----------
    name : str
        Name in messages.
    candidates : Candidates
        Candidates from which random placements are drawn.
    models : mapping of str to LidarModel
        Sensor types of the candidates.
    runs : tuple of SampledRun
    """

    name: str
    geometry: SceneGeometry
    candidates: Candidates
    models: Mapping[str, LidarModel]
    runs: tuple[SampledRun, ...]
    simulator: Simulator

    def random_placement(self, number: int, random: np.random.Generator) -> MountedSensors:
        """Draw a placement; see `random_placements.random_placement`."""
        name = f"{self.name}, placement {number}"
        return random_placement(name, self.candidates, self.models, random)

    def scans(self, placements: int, random: np.random.Generator) -> list[Recording]:
        """Return the scans of each run by `placements` random placements, different ones for each run."""
        return [recorded(self.simulator, placed, run) for placed, run in self._drawn(placements, random)]

    def field_scans(
        self, placements: int, random: np.random.Generator, area: DetectionArea, seed: Sequence[int]
    ) -> list[Recording]:
        """Return the scans of `scans` with half of the frames as in field recordings; see `field_recording`."""
        return [
            field_recording(recorded(self.simulator, placed, run), area, placed.sensors, [*seed, number])
            for number, (placed, run) in enumerate(self._drawn(placements, random))
        ]

    def _drawn(self, placements: int, random: np.random.Generator) -> list[tuple[MountedSensors, SampledRun]]:
        return [
            (self.random_placement(number, random), run) for run in self.runs for number in range(1, placements + 1)
        ]


def field_runs(
    runs: Sequence[SampledRun], random: np.random.Generator
) -> Generator[Progress, None, tuple[SampledRun, ...]]:
    """Return runs with groups of pedestrians, half of them with other sizes of all road users (`SIZE_CHANGE`)."""
    varied = []
    for run in runs:
        seed, other_sizes = int(random.integers(1 << 31)), bool(random.integers(2))
        trajectories = yield from with_companions(run.trajectories, seed)
        if other_sizes:
            trajectories = yield from resized(trajectories, SIZE_CHANGE, seed)
        varied.append(replace(run, trajectories=trajectories))
    return tuple(varied)
