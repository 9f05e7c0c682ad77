"""Recordings of whole runs as training data."""

from headless.detection.frames import LazyFrames, Recording
from headless.detection.recordings import MountedSensors, SampledRun, Simulator, poses_key


def recorded(simulator: Simulator, configuration: MountedSensors, run: SampledRun) -> Recording:
    """Return the frames of a run, simulated on access."""
    frames = LazyFrames(len(run.times), lambda number: simulator.frame(configuration, run, number))
    name = f"{configuration.name} in {run.name}"
    return Recording(name, run.key, frames, configuration.types, simulator.site, poses_key(configuration))
