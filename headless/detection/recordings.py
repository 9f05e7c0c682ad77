"""Simulated recordings of traffic for each sensor configuration, made on demand."""

import functools
from dataclasses import dataclass
from typing import Protocol

from headless.coverage_study.cells import Case

import numpy as np

from seip_addon.core.arrays import Boolean, Float
from seip_addon.core.progress import finish
from seip_addon.core.scans import Frame, MountedSensor, ScanSettings, Simulation, prepare, static_scene
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.storage.files import digest
from seip_addon.core.traffic import Trajectories
from seip_addon.core.traffic.bodies import fitted_body
from seip_addon.core.traffic.parked import parked_users

from .detection_area import area_of
from .frames import LazyFrames, Recording


@dataclass(frozen=True, eq=False)
class SampledRun:
    """A run of traffic with the instants of its frames.

    Parameters
    ----------
    trajectories : Trajectories
        In the scene's local axes.
    times : (n,) float64, seconds
    """

    name: str
    trajectories: Trajectories
    times: Float

    @functools.cached_property
    def parked(self) -> Boolean:
        """Whether each of the road users stands in all of the run, (u,) bool."""
        return parked_users(self.trajectories)

    @property
    def key(self) -> str:
        """Identifier of the run of traffic, whatever its file is called."""
        return digest(self.trajectories.first, self.trajectories.time, self.trajectories.position)


class Placement(Protocol):
    """Sensors that recordings are made with."""

    @property
    def name(self) -> str:
        """For people."""

    @property
    def sensors(self) -> tuple[MountedSensor, ...]:
        """The sensors where they hang."""

    @property
    def types(self) -> tuple[str, ...]:
        """Catalogue keys of the sensors' types."""

    def __hash__(self) -> int:
        """Tell it from others."""


@dataclass(frozen=True, eq=False)
class SensorConfiguration:
    """A number of sensors of one type, placed where they cover most."""

    case: Case

    @property
    def name(self) -> str:
        """For people: ``2 × type1``."""
        return f"{self.case.count} × {self.case.sensor}"

    @property
    def sensors(self) -> tuple[MountedSensor, ...]:
        """The sensors where they hang."""
        return tuple(
            MountedSensor(sensor.label, sensor.model, sensor.xyz, sensor.orientation)
            for sensor in self.case.deployment.sensors
        )

    @property
    def types(self) -> tuple[str, ...]:
        """Catalogue keys of the sensors' types."""
        return (self.case.sensor,)

    @property
    def places(self) -> Float:
        """Positions of the sensors, (s, 3) in metres."""
        return np.array([sensor.xyz for sensor in self.sensors])


class Simulator:
    """A scene in which runs of traffic are recorded.

    What stands still is cast against once for a configuration and a run, and
    kept until another is asked for: ask for the frames of one after the other.

    Attributes
    ----------
    area : callable
        From the width of a pillar in metres to the `DetectionArea` of the scene.
    """

    def __init__(self, geometry: SceneGeometry, settings: ScanSettings) -> None:
        self.static, self.settings, self.site = static_scene(geometry), settings, geometry.name
        self.area = functools.cache(functools.partial(area_of, geometry))
        self._simulation = functools.lru_cache(maxsize=1)(self._prepared)

    def record(self, configuration: Placement, run: SampledRun) -> Recording:
        """Return the frames of a run, to be simulated when they are asked for."""
        frames = LazyFrames(len(run.times), lambda number: self.frame(configuration, run, number))
        name = f"{configuration.name} in {run.name}"
        return Recording(name, run.key, frames, configuration.types, self.site)

    def frame(self, configuration: Placement, run: SampledRun, number: int) -> Frame:
        """Simulate a frame of a run."""
        return self._simulation(configuration, run).frame(number, float(run.times[number]))

    def _prepared(self, configuration: Placement, run: SampledRun) -> Simulation:
        bodies = [fitted_body(user) for user in run.trajectories.users]
        return finish(prepare(self.static, configuration.sensors, run.trajectories, bodies, self.settings))
