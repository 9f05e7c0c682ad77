"""Recordings: a scene's sensors scan its traffic, written as a run and as datasets.

Panel and batch both go this way.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..output.datasets.dataset_folder import write_dataset
from ..output.datasets.formats import FORMATS
from ..output.datasets.sample import SPLITS, TrafficRun
from ..progress import Progress
from ..sensing.scans.run_folder import Record, Run, load_frames, write_run
from ..sensing.scans.sensor import MountedSensor
from ..sensing.scans.simulation import ScanSettings, Simulation, frame_times, prepare
from ..sensing.scans.static_scene import static_scene
from ..sensing.traffic.bodies import fitted_body
from ..sensing.traffic.trajectories import Trajectories
from ..sensing.visibility.ray_casting import engine_name
from ..settings import setting
from ..site.scene_geometry import SceneGeometry

SAME_TIME_TOLERANCE = 1e-6
"""Seconds between two times that are one: of frames of Blender's timeline, and of a run."""


@dataclass(frozen=True)
class RecordingSettings:
    """Settings of a recording.

    Parameters
    ----------
    start, duration, rate : float, optional
        Seconds, seconds, hertz; see `frame_times`.
    formats : tuple of str
        Keys of `FORMATS`: datasets to write beside the frames.
    dataset : path, optional
        Folder of the datasets; that of the run if not given.
    split : str
        One of `SPLITS`.
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
    """Gather the inputs of a recording's frames.

    Parameters
    ----------
    trajectories : Trajectories
        In the scene's axes.
    versions : mapping of str to str
        Of this program and what it stands on.

    Raises
    ------
    SeipError
        As for `frame_times`.
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
        geo_reference=geometry.geo_reference,
    )


def simulation_of(run: Run) -> Generator[Progress, None, Simulation]:
    """Make a run's sensors ready to scan; see `prepare`."""
    return prepare(run.static, run.sensors, run.trajectories, run.bodies, run.settings)


def frame_number(run: Run, time: float) -> tuple[int, float]:
    """Return which frame of a run a time is next to, and its time where that is the same one, else the time given.

    Noise follows from the number: at a time of the run's own a scan is the run's frame.
    """
    number = int(np.abs(run.times - time).argmin())
    own = float(run.times[number])
    return number, own if abs(own - time) < SAME_TIME_TOLERANCE else time


def record(
    folder: Path, run: Run, simulation: Simulation, settings: RecordingSettings
) -> Generator[Progress, None, Record]:
    """Write a run's frames, a picture of its first, and its datasets; what is there already is kept.

    Parameters
    ----------
    folder : path
        Of the run; its name is the run's in datasets.
    simulation : Simulation
        Of the run.

    Returns
    -------
    dict
        The run's manifest.

    Raises
    ------
    SeipError
        As for `write_run` and `write_dataset`.
    """
    from ..output.pictures.scan_view import save_scan_view  # noqa: PLC0415  # matplotlib takes half a second to come

    manifest = yield from write_run(folder, run, simulation)
    save_scan_view(
        folder / "frame.png", next(load_frames(folder))[1], run.static.region, run.sensors, run.static.attribution
    )
    for key in settings.formats:
        target = dataset_folder(folder, settings, key)
        yield from write_dataset(FORMATS[key], load_frames(folder), _traffic_run(folder, run, settings), target)
    return manifest


def _traffic_run(folder: Path, run: Run, settings: RecordingSettings) -> TrafficRun:
    return TrafficRun(
        name=folder.resolve().name,
        split=settings.split,
        key=run.key,
        sensors=tuple(run.sensors),
        origin=run.origin,
        geo_reference=run.geo_reference,
        record=run.record(),
    )


def dataset_folder(folder: Path, settings: RecordingSettings, key: str) -> Path:
    """Return where the dataset of a format is written."""
    return (folder if settings.dataset is None else settings.dataset) / key
