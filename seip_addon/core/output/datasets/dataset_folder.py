"""A dataset's folder: samples run by run, and ``manifest.json`` with settings, counts and digests."""

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

from ...base.errors import SeipError
from ...base.progress import Progress
from ...sensing.scans.frame import Frame
from ...storage.files import digest, save_json, whole_file
from ...storage.json_dataclass import read_record
from ..results.versions import versions
from .formats import Format
from .sample import OUTCOMES, SPLITS, Sample, TrafficRun, make_sample, require_file_name

SCHEMA = "seip-dataset/1"
MANIFEST = "manifest.json"
Record = dict[str, Any]


@dataclass(frozen=True)
class _StoredSample:
    """Part of a sample in a manifest that is read."""

    name: str
    frame: str
    files: Mapping[str, str]


@dataclass(frozen=True)
class _StoredRun:
    """Part of a run in a manifest that is read."""

    name: str
    split: Literal["train", "val", "test"]
    key: str
    simulation_key: str
    finished: bool
    first: int
    frames: int
    samples: tuple[_StoredSample, ...]


@dataclass(frozen=True)
class _StoredDataset:
    """Part of a manifest that is read."""

    format: str
    settings: Mapping[str, object]
    classes: Mapping[str, str]
    runs: tuple[_StoredRun, ...]
    files: Mapping[str, str]


def write_dataset(
    kind: Format, frames: Iterable[tuple[str, Frame]], run: TrafficRun, folder: str | Path, *, min_points: int = 1
) -> Generator[Progress, None, Record]:
    """Write a traffic run into a dataset, and return its entry in the manifest; further calls append further runs.

    Labels are written that lie inside the region, have a class in the format, and ``min_points`` returns of all sensors
    together or more; the manifest counts the others by reason. The same frames give the same bytes. An interrupted call
    is resumed by the same call: existing files are kept.

    Parameters
    ----------
    frames : iterable of (str, Frame)
        The run's frames with their ids, in order of time.
    folder : path-like
        Folder of the dataset: new, empty, or with other runs in the same format.
    min_points : int
        1 leaves out what no sensor sees, which no detector can learn; 0 writes that as well.

    Raises
    ------
    SeipError
        The folder cannot be written or belongs to something else.
    """
    folder = Path(folder)
    manifest = _manifest_of(folder, kind, min_points)
    entry = _entry_of(manifest, run, kind, folder)
    paths = [*manifest["files"], *(path for sample in entry["samples"] for path in sample["files"])]
    if entry["finished"] and all((folder / path).is_file() for path in paths):
        return entry
    entry.update(finished=False, samples=[], labels=dict.fromkeys(OUTCOMES, 0) if kind.classes else {}, classes={})
    save_json(folder / MANIFEST, manifest)
    for done, (frame_id, frame) in enumerate(frames):
        _check(frame_id, frame, run, entry["samples"])
        sample = make_sample((entry["first"] + done, frame_id), run, frame, kind.classes, min_points)
        fates = Counter(sample.fates)
        entry["labels"] = {word: count + fates[word] for word, count in entry["labels"].items()}
        for name, count in sorted(Counter(sample.classes).items()):
            entry["classes"][name] = entry["classes"].get(name, 0) + count
        entry["samples"].append(_written(folder, kind, sample))
        yield Progress(done + 1, 0, f"writing {kind.name}")
    if not entry["samples"]:
        raise SeipError(f"the run '{run.name}' has no frames; simulate it again")
    entry.update(finished=True, frames=len(entry["samples"]))
    splits: dict[str, list[str]] = {split: [] for split in SPLITS}
    for each in manifest["runs"]:
        splits[each["split"]] += [sample["name"] for sample in each["samples"]]
    index = kind.index_files(folder, splits)
    manifest["files"] = {path: _write(folder / path, partial(bytes, content)) for path, content in index.items()}
    save_json(folder / MANIFEST, manifest)
    return entry


def load_manifest(folder: str | Path) -> Record:
    """Return the manifest of a dataset; raise `SeipError` if there is none, or it is damaged or of another version."""
    path = Path(folder) / MANIFEST
    try:
        content = path.read_bytes()
    except OSError as error:
        raise SeipError(f"there is no dataset in {folder}: it has no {MANIFEST}; write one") from error
    read_record(_StoredDataset, content, (SCHEMA,), str(path), "delete the folder and write the dataset again")
    return dict(json.loads(content))


def _manifest_of(folder: Path, kind: Format, min_points: int) -> Record:
    """Return the manifest that is there, or a new one where the folder is new or empty."""
    if (folder / MANIFEST).is_file():
        manifest = load_manifest(folder)
        there = (manifest["format"], manifest["settings"])
        if there != (kind.key, {"min_points": min_points}):
            settings = ", ".join(f"{name} {value}" for name, value in manifest["settings"].items())
            raise SeipError(
                f"{folder} holds a dataset in the format {manifest['format']} with {settings}; "
                "choose another folder, or the same format and settings"
            )
        return {**manifest, "versions": versions()}
    if folder.is_dir() and any(folder.iterdir()):
        raise SeipError(f"{folder} holds other things than a dataset; choose a new or an empty folder")
    return {
        "schema": SCHEMA,
        "format": kind.key,
        "settings": {"min_points": min_points},
        "classes": dict(kind.classes),
        "runs": [],
        "files": {},
        "versions": versions(),
    }


def _entry_of(manifest: Record, run: TrafficRun, kind: Format, folder: Path) -> Record:
    """Return the manifest's entry of a run: the one that is there, or a new one at the end."""
    new = _new_entry(run, kind)
    runs: list[Record] = manifest["runs"]
    for entry in runs:
        if entry["name"].casefold() == run.name.casefold():  # the same folder on many disks
            if entry["name"] != run.name or entry["key"] != new["key"] or entry["split"] != run.split:
                raise SeipError(
                    f"{folder} has a run '{entry['name']}' already, of other frames or in another split; "
                    "give this one another name, or choose another folder"
                )
            return entry
        if entry["simulation_key"] == run.key:
            raise SeipError(
                f"the runs '{run.name}' and '{entry['name']}' are the same frames, which would count twice or leak "
                "from one split into another; simulate one of them with another seed"
            )
    unfinished = next((entry["name"] for entry in runs if not entry["finished"]), None)
    if unfinished is not None:
        raise SeipError(f"the run '{unfinished}' in {folder} is half-written; write it again to its end first")
    new["first"] = sum(entry["frames"] for entry in runs)
    runs.append(new)
    return new


def _new_entry(run: TrafficRun, kind: Format) -> Record:
    sensors = []
    for one in run.sensors:
        places = {"local_m": one.xyz.tolist(), "map_m": (one.xyz + run.origin).tolist()}
        pose = {**places, "orientation": one.orientation.tolist()}
        sensors.append({"label": one.label, "model": one.model.name, **pose})
    parts = (part for one in run.sensors for part in (one.label, one.model.name, one.xyz, one.orientation))
    return {
        "name": run.name,
        "split": run.split,
        "finished": False,
        "key": digest(SCHEMA, kind.key, run.key, run.origin, *parts),
        "simulation_key": run.key,
        "simulation": dict(run.record),
        "origin_m": run.origin.tolist(),
        "sensors": sensors,
        "first": 0,
        "frames": 0,
        "labels": {},
        "classes": {},
        "samples": [],
    }


def _check(frame_id: str, frame: Frame, run: TrafficRun, samples: list[Record]) -> None:
    require_file_name(frame_id, "the frame", "call it something else")
    if samples and frame_id <= samples[-1]["frame"]:
        raise SeipError(f"frame '{frame_id}' of the run '{run.name}' comes after '{samples[-1]['frame']}'; sort them")
    count = len(run.sensors)
    if frame.labels.points.shape[1] != count or (len(frame) and int(frame.sensor.max()) >= count):
        raise SeipError(
            f"frame '{frame_id}' is of other sensors than the {count} of the run '{run.name}'; simulate it again"
        )


def _written(folder: Path, kind: Format, sample: Sample) -> Record:
    """Write the missing files of a sample and return its entry in the manifest."""
    contents = kind.sample_files(sample).items()
    return {
        "name": sample.name,
        "frame": sample.frame_id,
        "time_s": sample.frame.time,
        "points": len(sample.frame),
        "labels": len(sample.boxes),
        "files": {path: _write(folder / path, content, keep=True) for path, content in contents},
    }


def _write(path: Path, content: Callable[[], bytes], *, keep: bool = False) -> str:
    """Write a file, or keep one that is there, and return its SHA-256."""
    if keep and path.is_file():
        return hashlib.sha256(path.read_bytes()).hexdigest()
    written = content()
    with whole_file(path) as temporary:
        temporary.write_bytes(written)
    return hashlib.sha256(written).hexdigest()
