"""Recordings of whole runs as training data, and digests of all that their frames follow from."""

from collections.abc import Sequence

from headless.detection.frames import LazyFrames, Recording
from headless.detection.recordings import MountedSensors, SampledRun, Simulator

from seip_addon.core.output.results.versions import versions
from seip_addon.core.sensing.scans.run_folder import Run
from seip_addon.core.sensing.traffic.bodies import fitted_body
from seip_addon.core.storage.files import digest


def recorded(simulator: Simulator, configuration: MountedSensors, run: SampledRun) -> Recording:
    """Return the frames of a run, simulated on access."""
    frames = LazyFrames(len(run.times), lambda number: simulator.frame(configuration, run, number))
    name = f"{configuration.name} in {run.name}"
    return Recording(name, run.key, frames, configuration.types, simulator.site, poses_key(configuration))


def poses_key(configuration: MountedSensors) -> str:
    """Return a digest of the sensors' types and poses."""
    return digest(*(part for one in configuration.sensors for part in (one.model.key, one.xyz, one.orientation)))


def frames_key(simulator: Simulator, configuration: MountedSensors, runs: Sequence[SampledRun]) -> str:
    """Return a digest of all that the frames of some runs follow from."""
    scans = (
        Run(
            static=simulator.static,
            origin=run.trajectories.origin,
            sensors=configuration.sensors,
            trajectories=run.trajectories,
            bodies=[fitted_body(user) for user in run.trajectories.users],
            times=run.times,
            settings=simulator.settings,
            versions=versions(),
        )
        for run in runs
    )
    return digest(*(scan.key for scan in scans))
