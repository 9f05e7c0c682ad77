"""A folder of frames: ``frames/000123.npz``, and ``manifest.json`` with the inputs of the run."""

from __future__ import annotations

import json
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.progress import Progress
from ...storage.files import digest, parse_json, save_json
from ...storage.folder_contents import MANIFEST, check_no_placement
from ...storage.json_dataclass import from_json
from ...storage.source_digest import source_digest
from ..lidar.model import LidarModel
from ..traffic.bodies import Body
from ..traffic.trajectories import Trajectories
from .frame import Frame
from .sensor import MountedSensor
from .simulation import ScanSettings, Simulation
from .static_scene import StaticScene

SCHEMA = "seip-run/1"
FRAMES = "frames"
Record = dict[str, Any]


@dataclass(frozen=True)
class _StoredRun:
    """Part of a manifest that is read."""

    key: str
    complete: bool
    sensors: tuple[Mapping[str, object], ...]
    trajectories: Mapping[str, object]
    frames: tuple[Mapping[str, object], ...]


@dataclass(frozen=True, eq=False)
class Run:
    """All inputs of the frames of a run.

    Parameters
    ----------
    origin : (3,) float64, metres
        Map coordinates of the local origin.
    trajectories : Trajectories
        Trajectories in local axes.
    bodies : sequence of Body
        Body of each road user.
    times : (n,) float64, seconds
        Times of the frames.
    settings : ScanSettings
        Settings of the scans, with the engine's name instead of ``auto``.
    versions : mapping of str to str
        Versions of this program and of its dependencies.
    """

    static: StaticScene
    origin: Float
    sensors: Sequence[MountedSensor]
    trajectories: Trajectories
    bodies: Sequence[Body]
    times: Float
    settings: ScanSettings
    versions: Mapping[str, str]

    @property
    def key(self) -> str:
        """Digest of all inputs: runs with the same key have the same frames."""
        trajectories = self.trajectories
        users = json.dumps([asdict(user) for user in trajectories.users])
        motion = [getattr(trajectories, name) for name in ("first", "time", "position", "yaw", "pitch", "speed")]
        sensors = [part for sensor in self.sensors for part in (sensor.label, sensor.xyz, sensor.orientation)]
        models = [part for sensor in self.sensors for part in _parts(sensor.model)]
        bodies = {id(body): digest(body.triangles, body.reflectivity) for body in self.bodies}
        return digest(
            SCHEMA,
            self.versions["seip"],
            source_digest(),
            json.dumps(asdict(self.settings)),
            *(self.static.triangles, self.static.reflectivity, self.static.region.wkb, self.origin, self.times),
            *(users, *motion, *sensors, *models),
            *(bodies[id(body)] for body in self.bodies),
        )

    def record(self, frames: Sequence[Mapping[str, Any]] = ()) -> Record:
        """Return the contents of the manifest."""
        return {
            "schema": SCHEMA,
            "key": self.key,
            "complete": len(frames) == len(self.times),
            "settings": _listed({name: value for name, value in asdict(self.settings).items() if name != "seed"}),
            "seeds": {"returns": self.settings.seed},
            "origin_m": self.origin.tolist(),
            "sensors": [_sensor_record(sensor) for sensor in self.sensors],
            "trajectories": {"source": self.trajectories.source, "road_users": len(self.trajectories)},
            "versions": dict(self.versions),
            "frames": list(frames),
        }


def write_run(folder: Path, run: Run, simulation: Simulation) -> Generator[Progress, None, Record]:
    """Write the missing frames of a run, and then the manifest that lists all.

    Parameters
    ----------
    folder : path
        Folder that is new, empty, or contains frames of this run from an interrupted start.
    simulation : Simulation
        Simulation of the run.

    Yields
    ------
    Progress
        Number of frames done.

    Returns
    -------
    dict
        The manifest.

    Raises
    ------
    SeipError
        The folder contains something else, or cannot be written.
    """
    check_run_folder(folder, run)
    if not (folder / MANIFEST).exists():
        save_json(folder / MANIFEST, run.record())
    frames: list[Record] = []
    for number, time in enumerate(run.times.tolist()):
        yield Progress(number, len(run.times), "frames")
        path = frame_path(folder, number)
        if path.exists():
            frame = Frame.load(path)
        else:
            frame = simulation.frame(number, time)
            frame.save(path)
        frames.append(_frame_record(number, frame))
    record = run.record(frames)
    save_json(folder / MANIFEST, record)
    yield Progress(len(run.times), len(run.times), "frames")
    return record


def check_run_folder(folder: Path, run: Run) -> None:
    """Raise SeipError if a folder contains something other than frames of this run."""
    check_no_placement(folder)
    if (folder / MANIFEST).exists():
        if load_manifest(folder)["key"] != run.key:
            raise SeipError(
                f"{folder} contains a run with a different scene, traffic or settings: choose another folder, or "
                "delete that one"
            )
    elif (folder / FRAMES).exists():
        raise SeipError(f"{folder} contains frames without a {MANIFEST}: delete them, or choose another folder")


def load_manifest(folder: Path) -> Record:
    """Return the manifest of a run.

    Raises
    ------
    SeipError
        The manifest is missing, damaged or of another version.
    """
    path = folder / MANIFEST
    try:
        record = parse_json(path.read_bytes())
        known = record["schema"] == SCHEMA
        if known:
            from_json(_StoredRun, record)
    except FileNotFoundError as error:
        raise SeipError(f"{folder} does not contain a run of scans: make one with seip simulate") from error
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise SeipError(f"{path} is damaged: delete the folder and simulate again") from error
    if not known:
        raise SeipError(f"{path} was written by another version: delete the folder and simulate again")
    return dict(record)


def load_frames(folder: Path) -> Iterator[tuple[str, Frame]]:
    """Yield the frames of a finished run with their names, in the order of time.

    Raises
    ------
    SeipError
        There is no run, or it was not finished.
    """
    record = load_manifest(folder)
    if not record["complete"]:
        raise SeipError(f"the run in {folder} was stopped half-way: run the same simulation again to finish it")
    for number in range(len(record["frames"])):
        path = frame_path(folder, number)
        yield path.stem, Frame.load(path)


def frame_path(folder: Path, number: int) -> Path:
    """Return the path of a frame."""
    return folder / FRAMES / f"{number:06d}.npz"


def _frame_record(number: int, frame: Frame) -> Record:
    return {
        "name": f"{number:06d}",
        "time_s": frame.time,
        "points": len(frame),
        "road_users": len(frame.labels),
    }


def _sensor_record(sensor: MountedSensor) -> Record:
    law = {"model": sensor.model.law.model, **asdict(sensor.model.law)}
    model = {name: np.asarray(value).tolist() for name, value in _fields(sensor.model)} | {"law": law}
    return {
        "label": sensor.label,
        "sensor": sensor.model.key,
        "local_m": sensor.xyz.tolist(),
        "orientation": sensor.orientation.tolist(),
        "model": model,
    }


def _listed(record: Mapping[str, Any]) -> Record:
    """Return a record with lists in place of tuples, as JSON reads it back."""
    return {name: list(value) if isinstance(value, tuple) else value for name, value in record.items()}


def _fields(model: LidarModel) -> list[tuple[str, Any]]:
    return [(part.name, getattr(model, part.name)) for part in fields(model)]


def _parts(model: LidarModel) -> list[Any]:
    """Return the figures of a model that scans depend on, without names and sources."""
    unused = {"name", "manufacturer", "source", "price_source", "assumed_beams", "assumed_law"}
    return [repr(value) if name == "law" else value for name, value in _fields(model) if name not in unused]
