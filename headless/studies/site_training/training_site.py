"""Training site: runs of traffic, and scans of them by random placements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from headless.detection.frames import Recording
from headless.detection.recordings import MountedSensors, SampledRun, Simulator

import numpy as np

from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.site.candidates import Candidates
from seip_addon.core.site.scene_geometry import SceneGeometry

from .random_placements import random_placement


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
        return [
            self.simulator.record(self.random_placement(number, random), run)
            for run in self.runs
            for number in range(1, placements + 1)
        ]
