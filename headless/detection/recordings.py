"""Frames of runs of traffic for any sensor configuration, simulated on demand."""

from __future__ import annotations

import functools
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from seip_addon.core.base.arrays import Boolean, Float
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.limits import FRAMES, TIME_STEP
from seip_addon.core.base.progress import finish
from seip_addon.core.output.results.versions import versions
from seip_addon.core.sensing.scans.frame import Frame
from seip_addon.core.sensing.scans.run_folder import Run
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import ScanSettings, Simulation, prepare
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.traffic.bodies import Body, fitted_body
from seip_addon.core.sensing.traffic.trajectories import WARM_UP, Trajectories, parked_users
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.storage.files import digest

from .detection_area import area_of


@dataclass(frozen=True, eq=False)
class SampledRun:
    """A run of traffic with the instants of its frames.

    Parameters
    ----------
    trajectories : Trajectories
        Road users in the scene's local axes.
    times : (n,) float64, seconds
        Instants of the frames.
    """

    name: str
    trajectories: Trajectories
    times: Float

    @functools.cached_property
    def parked(self) -> Boolean:
        """Mask of the u road users that do not move during the run, (u,) bool."""
        return parked_users(self.trajectories)

    @functools.cached_property
    def bodies(self) -> tuple[Body, ...]:
        """Body of each road user."""
        return tuple(fitted_body(user) for user in self.trajectories.users)

    @property
    def key(self) -> str:
        """Digest of the trajectories, which does not depend on the name of their file."""
        return digest(self.trajectories.first, self.trajectories.time, self.trajectories.position)


@dataclass(frozen=True, eq=False)
class MountedSensors:
    """Sensors of any types with their poses, and a name for messages."""

    name: str
    sensors: tuple[MountedSensor, ...]

    @property
    def types(self) -> tuple[str, ...]:
        """Catalogue keys of the sensors' types, in alphabetical order."""
        return tuple(sorted({sensor.model.key for sensor in self.sensors}))

    @property
    def positions(self) -> Float:
        """Positions of the s sensors, (s, 3) in metres."""
        return np.array([sensor.xyz for sensor in self.sensors])


def sampled_runs(paths: Sequence[Path], origin: Float, every: float) -> tuple[SampledRun, ...]:
    """Read runs, and sample each in equal steps after `WARM_UP` seconds.

    Parameters
    ----------
    origin : (3,) float64, metres
        Origin of the scene's local axes.
    every : float, seconds
        Time between frames.

    Raises
    ------
    SeipError
        A run is too short or has too many frames, or the time between frames is out of its range.
    """
    if not TIME_STEP.allow(every):
        raise SeipError(f"the time between frames must be {TIME_STEP}, not {every:g} s")
    runs = []
    for path in paths:
        trajectories = Trajectories.load(path).moved_to(origin)
        begin, end = trajectories.span
        if not FRAMES.allow(max((end - begin) / every, 1.0)):
            raise SeipError(
                f"{path} lasts {end - begin:g} s, too long for a frame each {every:g} s: take {FRAMES} frames"
            )
        times = np.arange(begin + WARM_UP, end, every)
        if not len(times):
            raise SeipError(f"{path} is shorter than {WARM_UP:g} s: simulate more traffic")
        runs.append(SampledRun(path.stem, trajectories, times))
    return tuple(runs)


class Simulator:
    """Simulator of frames in one scene.

    The returns of the static scene are computed once for each configuration and run, and cached for the latest few. So
    request all frames of one configuration and run before the next, in at most one thread more than there are cores.

    Parameters
    ----------
    sensors : sequence of MountedSensor
        Objects beyond the range of all these sensors are left out; none are if no sensors are given.

    Attributes
    ----------
    area : callable
        Returns the `DetectionArea` of the scene for a width of pillars in metres.
    """

    def __init__(self, geometry: SceneGeometry, settings: ScanSettings, sensors: Sequence[MountedSensor] = ()) -> None:
        self.static, self.settings, self.site = static_scene(geometry, sensors), settings, geometry.name
        self.area = functools.cache(functools.partial(area_of, geometry))
        self._simulation = functools.lru_cache(maxsize=2 * ((os.cpu_count() or 1) + 1))(self._prepared)

    def forget(self) -> None:
        """Free the memory of the cached returns."""
        self._simulation.cache_clear()

    def frame(self, configuration: MountedSensors, run: SampledRun, number: int) -> Frame:
        """Simulate frame ``number`` of a run."""
        return self._simulation(configuration, run).frame(number, float(run.times[number]))

    def _prepared(self, configuration: MountedSensors, run: SampledRun) -> Simulation:
        return finish(prepare(self.static, configuration.sensors, run.trajectories, run.bodies, self.settings))


def poses_key(configuration: MountedSensors) -> str:
    """Return a digest of the sensors' types and poses."""
    return digest(*(part for one in configuration.sensors for part in (one.model.key, one.xyz, one.orientation)))


def frames_key(simulator: Simulator, configuration: MountedSensors, runs: Sequence[SampledRun]) -> str:
    """Return a digest of all inputs that determine the frames of runs."""
    scans = (
        Run(
            static=simulator.static,
            origin=run.trajectories.origin,
            sensors=configuration.sensors,
            trajectories=run.trajectories,
            bodies=run.bodies,
            times=run.times,
            settings=simulator.settings,
            versions=versions(),
        )
        for run in runs
    )
    return digest(*(scan.key for scan in scans))
