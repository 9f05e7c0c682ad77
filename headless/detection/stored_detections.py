"""Detections with placements, kept on disk, so that a study that was stopped goes on."""

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.storage.array_file import ArrayFile

from .frame_results import EvaluatedBoxes, FrameResult, GroundTruth

TABLES = {"truth": GroundTruth, "detected": EvaluatedBoxes}
TYPES = {"category": "U", "points": "i8", "inside": "b1", "parked": "b1"}  # of columns; of others float64


def _types() -> dict[str, str]:
    types = {"run": "U", "time": "f8"}
    for table, kind in TABLES.items():
        types[f"{table}.count"] = "i8"
        types |= {f"{table}.{column.name}": TYPES.get(column.name, "f8") for column in fields(kind)}
    return types


FILE = ArrayFile("seip.detections", 1, "file of detections", "delete it, and it is made again", _types())


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
