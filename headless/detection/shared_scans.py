"""Detection with many placements that share poses: each pose scans a frame once, for all placements that have it."""

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.base.arrays import Boolean
from seip_addon.core.base.progress import Progress
from seip_addon.core.sensing.scans.frame import Frame
from seip_addon.core.sensing.scans.scanner import Scanner
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import Simulation, body_surfaces, prepare
from seip_addon.core.storage.array_file import ArrayFile
from seip_addon.core.storage.files import digest
from seip_addon.core.storage.source_digest import source_digest

from .detector import Detector
from .detector_evaluation import AT_ONCE, side_by_side
from .frame_results import EvaluatedBoxes, FrameResult, GroundTruth, frame_result
from .inference import detect
from .recordings import MountedSensors, SampledRun, Simulator, frames_key
from .training import make_deterministic

FOLDER = "detections"
POINT_FIELDS = ("points", "sensor", "delay", "intensity", "instance", "foreground")
"""Arrays of a frame with an entry for each point."""

TABLES = {"truth": GroundTruth, "detected": EvaluatedBoxes}
TYPES = {"category": "U", "points": "i8", "inside": "b1", "parked": "b1"}  # of columns; of others float64


def _types() -> dict[str, str]:
    types = {"run": "U", "time": "f8"}
    for table, kind in TABLES.items():
        types[f"{table}.count"] = "i8"
        types |= {f"{table}.{column.name}": TYPES.get(column.name, "f8") for column in fields(kind)}
    return types


FILE = ArrayFile("seip.detections", 1, "file of detections", "delete it, and it is made again", _types())


class SharedScans:
    """The sensors of several placements at a site, each of which casts its rays at the static scene once.

    Frames have the same bytes as those of `Simulator.frame`: what a sensor's rays meet does not depend on the other
    sensors, and noise and losses are drawn for each placement, by the sensor's place in it.

    Parameters
    ----------
    placements : sequence of MountedSensors
    """

    def __init__(self, simulator: Simulator, placements: Sequence[MountedSensors]) -> None:
        self.simulator, self.placements = simulator, placements
        mounted: dict[tuple[object, ...], MountedSensor] = {}
        keys = [[_key(sensor) for sensor in one.sensors] for one in placements]
        for one, own in zip(placements, keys, strict=True):
            mounted.update(zip(own, one.sensors, strict=True))
        numbers = {key: number for number, key in enumerate(mounted)}
        self._sensors = tuple(mounted.values())
        self._parts = [[numbers[key] for key in own] for own in keys]
        self._scanners: list[Scanner] = []

    def cast(self, run: SampledRun) -> Generator[Progress, None, None]:
        """Cast the rays at the static scene, before frames of any run are made."""
        if not self._scanners:
            static, settings = self.simulator.static, self.simulator.settings
            first = yield from prepare(static, self._sensors, run.trajectories, run.bodies, settings)
            self._scanners = list(first.scanners)

    def frames(self, run: SampledRun, numbers: Sequence[int], placements: Sequence[int]) -> Iterator[tuple[int, Frame]]:
        """Yield frames of a run with the number of their placement: of all placements at each instant in turn.

        Parameters
        ----------
        numbers : sequence of int
            Numbers of the frames in the run.
        placements : sequence of int
            Numbers of the placements.
        """
        static, settings = self.simulator.static, self.simulator.settings
        shapes = body_surfaces(run.bodies, settings.engine)

        def simulation(poses: Sequence[int]) -> Simulation:
            return Simulation(static, [self._scanners[pose] for pose in poses], run.trajectories, shapes, settings)

        used = sorted({pose for placement in placements for pose in self._parts[placement]})
        whole, parts = simulation(used), {placement: simulation(self._parts[placement]) for placement in placements}
        for number in numbers:
            snapshot = run.trajectories.at(float(run.times[number]))
            scans = dict(zip(used, whole.scans(snapshot), strict=True))
            for placement, part in parts.items():
                yield placement, part.measure(number, snapshot, [scans[pose] for pose in self._parts[placement]])


def detect_with_all(
    shared: SharedScans,
    runs: Sequence[SampledRun],
    detector: Detector,
    folder: Path,
    *,
    placements: Sequence[int] | None = None,
    instants: slice = slice(None),
) -> Generator[Progress, None, list[list[FrameResult]]]:
    """Detect road users in frames of some runs with each placement; return the frames' results by placement.

    What was detected in a run with a placement is kept in a folder, under a digest of all that it follows from, so that
    work that was stopped goes on, and what other work has detected before is read. Densities and points of detections
    are those of the foreground.

    Parameters
    ----------
    placements : sequence of int, optional
        Numbers of the placements; by default all.
    instants : slice
        Of the frames of each run.
    """
    chosen = range(len(shared.placements)) if placements is None else placements
    sampled = [(run, numbers) for run in runs if (numbers := range(len(run.times))[instants])]
    paths = [{one: _path(folder, shared, run, numbers, one, detector) for one in chosen} for run, numbers in sampled]
    missing = [{one: path for one, path in files.items() if not path.exists()} for files in paths]
    if any(missing):
        yield from shared.cast(runs[0])
        works = [
            _detect_in_run(shared, run, numbers, files, detector)
            for (run, numbers), files in zip(sampled, missing, strict=True)
            if files
        ]
        make_deterministic(1)
        yield from side_by_side(works, AT_ONCE if detector.device.type == "cpu" else 1)
    return [[frame for files in paths for frame in load_frames(files[one])] for one in chosen]


def _path(
    folder: Path, shared: SharedScans, run: SampledRun, numbers: Sequence[int], placement: int, detector: Detector
) -> Path:
    """Return the file of what is detected in frames of a run with a placement."""
    scans = frames_key(shared.simulator, shared.placements[placement], [run])
    key = digest(source_digest("headless.detection"), scans, str(list(numbers)), detector.key)
    return folder / FOLDER / f"{key[:32]}.npz"


def _detect_in_run(
    shared: SharedScans, run: SampledRun, numbers: Sequence[int], files: Mapping[int, Path], detector: Detector
) -> Generator[Progress, None, None]:
    """Detect road users in frames of a run with the placements that have a file, and write the files."""
    found: dict[int, list[FrameResult]] = {placement: [] for placement in files}
    total = len(numbers) * len(files)
    for done, (placement, frame) in enumerate(shared.frames(run, numbers, list(files))):
        yield Progress(done, total, f"detect in {run.name}")
        boxes = detect(detector, shared.simulator.area(detector.settings.pillar), frame)
        found[placement].append(
            frame_result(
                some_points(frame, frame.foreground),
                boxes,
                region=shared.simulator.static.region,
                sensors=shared.placements[placement].positions,
                run=run.name,
                parked=run.parked,
            )
        )
    for placement, path in files.items():
        save_frames(path, found[placement])
    yield Progress(total, total, f"detect in {run.name}")


def some_points(frame: Frame, kept: Boolean) -> Frame:
    """Return the frame with the points of a mask (n,); the counts in its labels are those of all points."""
    return replace(frame, **{name: getattr(frame, name)[kept] for name in POINT_FIELDS})


def _key(sensor: MountedSensor) -> tuple[object, ...]:
    return (sensor.model.key, *sensor.xyz.tolist(), *sensor.orientation.ravel().tolist())


def save_frames(path: Path, frames: Sequence[FrameResult]) -> None:
    """Write the results of frames, one after the other."""
    arrays: dict[str, NDArray[Any]] = {
        "run": np.array([frame.run for frame in frames], dtype=np.str_),
        "time": np.array([frame.time for frame in frames]),
    }
    for table, kind in TABLES.items():
        parts = [getattr(frame, table) for frame in frames]
        arrays[f"{table}.count"] = np.array([len(part) for part in parts])
        arrays |= {
            f"{table}.{column.name}": np.concatenate([getattr(part, column.name) for part in parts])
            for column in fields(kind)
        }
    FILE.save(path, {}, arrays)


def load_frames(path: Path) -> list[FrameResult]:
    """Read what `save_frames` wrote.

    Raises
    ------
    SeipError
        The file is damaged, or something else.
    """
    with FILE.reading(path) as (_, arrays):
        tables = {table: _split(table, arrays) for table in TABLES}
        return [
            FrameResult(str(run), float(time), truth, detected)
            for run, time, truth, detected in zip(
                arrays["run"], arrays["time"], tables["truth"], tables["detected"], strict=True
            )
        ]


def _split(table: str, arrays: dict[str, NDArray[Any]]) -> list[Any]:
    """Return the rows of each frame of a table."""
    kind = TABLES[table]
    ends = np.cumsum(arrays[f"{table}.count"])
    columns = {column.name: arrays[f"{table}.{column.name}"] for column in fields(kind)}
    split = {name: np.split(values, ends[:-1]) for name, values in columns.items()}
    return [kind(**{name: parts[frame] for name, parts in split.items()}) for frame in range(len(ends))]
