"""Recordings: scans of a scene's traffic by its sensors, written as a run and as datasets.

The panel and the command line both use this module.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..base.progress import Progress
from ..base.settings import setting
from ..output.datasets.dataset_folder import write_dataset
from ..output.datasets.formats import FORMATS
from ..output.datasets.sample import SPLITS, TrafficRun
from ..sensing.scans.run_folder import Record, Run, load_frames, write_run
from ..sensing.scans.sensor import MountedSensor
from ..sensing.scans.simulation import ScanSettings, Simulation, frame_times, prepare
from ..sensing.scans.static_scene import static_scene
from ..sensing.traffic.bodies import fitted_body
from ..sensing.traffic.trajectories import Trajectories
from ..sensing.visibility.ray_casting import engine_name
from ..site.scene_geometry import SceneGeometry

SAME_TIME_TOLERANCE = 1e-6
"""Seconds; times of Blender's timeline and of a run's frames that differ by less are the same."""


@dataclass(frozen=True)
class RecordingSettings:
    """Settings of a recording.

    Parameters
    ----------
    scan : ScanSettings
        Settings of the scans.
    start, duration, rate : float, optional
        Times of the frames in seconds, seconds and hertz; see `frame_times`.
    formats : tuple of str
        Keys of `FORMATS`: datasets to write in addition to the frames.
    dataset : path, optional
        Folder of the datasets; by default that of the run.
    split : str
        Split of the datasets, one of `SPLITS`.
    """

    scan: ScanSettings = field(default_factory=ScanSettings)
    start: float | None = setting(None, "time of the first frame (the traffic's first)", unit="s", metavar="S")
    duration: float | None = setting(None, "to the last frame (to the traffic's last)", unit="s", metavar="S")
    rate: float | None = setting(None, "frames a second (the slowest sensor's turns)", unit="Hz", metavar="HZ")
    formats: tuple[str, ...] = ()
    dataset: Path | None = setting(None, "folder of datasets (that of the run)", metavar="DIR")
    split: str = SPLITS[0]


def make_run(
    geometry: SceneGeometry,
    sensors: Sequence[MountedSensor],
    trajectories: Trajectories,
    settings: RecordingSettings,
    versions: Mapping[str, str],
) -> Run:
    """Return the run of a recording: all inputs of its frames.

    Parameters
    ----------
    trajectories : Trajectories
        Trajectories in the scene's axes.
    versions : mapping of str to str
        Versions of this program and of its dependencies.

    Raises
    ------
    SeipError
        Same as for `frame_times`.
    """
    return Run(
        static=static_scene(geometry, sensors),
        origin=geometry.origin,
        sensors=sensors,
        trajectories=trajectories,
        bodies=tuple(fitted_body(user) for user in trajectories.users),
        times=frame_times(trajectories, sensors, start=settings.start, duration=settings.duration, rate=settings.rate),
        settings=replace(settings.scan, engine=engine_name(settings.scan.engine)),
        versions=versions,
    )


def simulation_of(run: Run) -> Generator[Progress, None, Simulation]:
    """Prepare the simulation of a run; see `prepare`."""
    return prepare(run.static, run.sensors, run.trajectories, run.bodies, run.settings)


def frame_number(run: Run, time: float) -> tuple[int, float]:
    """Return the number of the frame nearest to a time, and the frame's time if both are the same, else the given time.

    Noise depends on the number, so that a scan at the time of one of the run's frames equals that frame.
    """
    number = int(np.abs(run.times - time).argmin())
    own = float(run.times[number])
    return number, own if abs(own - time) < SAME_TIME_TOLERANCE else time


def record(
    folder: Path, run: Run, simulation: Simulation, settings: RecordingSettings
) -> Generator[Progress, None, Record]:
    """Write a run's frames, a picture of the first one, and its datasets; existing frames are kept.

    Parameters
    ----------
    folder : path
        Folder of the run; its name is that of the run in datasets.
    simulation : Simulation
        Simulation of the run.

    Returns
    -------
    dict
        Manifest of the run.

    Raises
    ------
    SeipError
        Same as for `write_run` and `write_dataset`.
    """
    from ..output.pictures.scan_view import save_scan_view  # noqa: PLC0415  # matplotlib takes half a second to come

    manifest = yield from write_run(folder, run, simulation)
    save_scan_view(
        folder / "frame.png", next(load_frames(folder))[1], run.static.region, run.sensors, run.static.attribution
    )
    for key in settings.formats:
        name, sensors = folder.resolve().name, tuple(run.sensors)
        traffic = TrafficRun(name, settings.split, run.key, sensors, run.origin, run.record())
        yield from write_dataset(FORMATS[key], load_frames(folder), traffic, dataset_folder(folder, settings, key))
    return manifest


def dataset_folder(folder: Path, settings: RecordingSettings, key: str) -> Path:
    """Return the folder of the dataset of a format."""
    return (folder if settings.dataset is None else settings.dataset) / key
