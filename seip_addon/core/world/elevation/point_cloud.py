"""Laser surveys (LAS, LAZ), read with laspy if it is installed."""

import contextlib
import importlib
import os
import struct
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import Float, Integer
from ...base.errors import SeipError
from ...base.limits import ELEVATION, MAP_COORDINATE
from ...base.progress import Progress
from ...geometry.reference_systems import epsg_code

SURVEY_SUFFIXES = (".las", ".laz")
BYTES_PER_STEP = 64 << 20
MAX_POINTS = 40_000_000  # points at a place
_PROJECTED_KEY = 3072
_RECORD_BYTES = 54  # least size of a variable-length record
_MAX_PACKED_POINTS = 1_000  # per byte of LAZ: even flat ground measured evenly needs far more bytes
_LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}  # layers of each item of LASzip 3; extra bytes (14) have one each


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Points of a survey.

    Parameters
    ----------
    points : (n, 3) float64, metres
        Points in the survey's reference system.
    classes : (n,) int64
        Classes of the ASPRS: 2 ground, 3 to 5 vegetation, 6 building.
    """

    points: Float
    classes: Integer


def is_survey(path: Path) -> bool:
    """Return whether a file name is that of a survey."""
    return path.suffix.lower() in SURVEY_SUFFIXES


def survey_system(path: Path) -> tuple[int | None, Float]:
    """Return the EPSG code of a survey, None if it names none, and the centre of its points (1, 2).

    Raises
    ------
    SeipError
        The file cannot be read, or laspy is missing.
    """
    with _opened(path) as reader:
        return _code(reader.header), (np.array(reader.header.mins) + np.array(reader.header.maxs))[None, :2] / 2


def read_points(path: Path, low: Float, high: Float) -> Generator[Progress, None, PointCloud]:
    """Read the points of a survey between two corners in plan (2,), in its reference system.

    Raises
    ------
    SeipError
        The file is damaged, or has more than `MAX_POINTS` there.
    """
    points, classes, count, done = [], [], 0, 0
    with _opened(path) as reader:
        whole = int(reader.header.point_count)
        chunks = reader.chunk_iterator(max(1, BYTES_PER_STEP // reader.header.point_format.size))
        while done < whole:
            yield Progress(done, whole, f"reading {path.name}")
            with _errors_of(path):
                chunk = next(chunks)
                places = np.column_stack([np.asarray(chunk[axis], dtype=np.float64) for axis in ("x", "y", "z")])
                kinds = np.asarray(chunk.classification, dtype=np.int64)
                if fault := MAP_COORDINATE.fault(places):
                    raise ValueError(f"a coordinate {fault}")
            done += len(places)
            kept = ((places[:, :2] >= low) & (places[:, :2] <= high)).all(axis=1) & ELEVATION.each(places[:, 2])
            points.append(places[kept])
            classes.append(kinds[kept])
            count += int(kept.sum())
            if count > MAX_POINTS:
                raise SeipError(
                    f"{path.name} holds more than {MAX_POINTS:,} points at the place: thin it to a point each 20 cm "
                    "(pdal translate in.laz out.laz sample --filters.sample.radius=0.2)"
                )
    return PointCloud(np.concatenate([np.empty((0, 3)), *points]), np.concatenate([np.empty(0, np.int64), *classes]))


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a survey with laspy, after checking that its header fits the size of the file.

    Raises
    ------
    SeipError
        The file is missing or damaged, or laspy is not installed.
    """
    try:
        if path.suffix.lower() == ".laz":
            importlib.import_module("lazrs")
        laspy = importlib.import_module("laspy")
    except ModuleNotFoundError as error:
        cure = "which is not installed; pip install laspy lazrs"
        raise SeipError(f"reading {path.name} needs {error.name}, {cure}") from error
    if not path.is_file():
        raise SeipError(f"no such file: {path}; check its path")
    with _errors_of(path):
        size = path.stat().st_size
        with path.open("rb") as file:
            (records,) = struct.unpack_from("<I", file.read(104), 100)
        if records * _RECORD_BYTES > size:
            raise ValueError(f"it announces {records:,} variable-length records in {size:,} bytes")
        # One thread unpacks: with several, lazrs reserves memory for whole chunks of any announced size.
        reader = laspy.open(path, laz_backend=laspy.LazBackend.Lazrs, read_evlrs=False)
    with reader:
        with _errors_of(path):
            _check_size(path, reader.header, size)
        yield reader


def _check_size(path: Path, header: Any, size: int) -> None:  # noqa: ANN401  # laspy has no types
    """Check the points that a header announces, and its bounds, before memory is reserved for them.

    Raises
    ------
    ValueError
        There are more points, or larger chunks, than the file of ``size`` bytes can hold, or a bound is implausible.
    """
    points = int(header.point_count)
    most = _MAX_PACKED_POINTS * size if header.are_points_compressed else size // header.point_format.size
    if points > most:
        raise ValueError(f"it announces {points:,} points in {size:,} bytes")
    if fault := MAP_COORDINATE.fault([*header.mins, *header.maxs]):
        raise ValueError(f"its bound {fault}")
    if header.are_points_compressed:
        _check_chunks(path, header, size)


def _check_chunks(path: Path, header: Any, size: int) -> None:  # noqa: ANN401  # as above
    """Check that the layers of each chunk of LAZ fit into it: lazrs reserves as much memory as they announce.

    Source: "LASzip specification", chunk table and layered compression (point formats 6 to 10).

    Raises
    ------
    ValueError
        A chunk reaches beyond the file, or a layer beyond its chunk.
    """
    lazrs = importlib.import_module("lazrs")
    (packing,) = header.vlrs.get("LasZipVlr")
    (count,) = struct.unpack_from("<H", packing.record_data, 32)
    items = [struct.unpack_from("<HHH", packing.record_data, 34 + 6 * number) for number in range(count)]
    layers = sum(_LAYERS.get(kind, item_bytes) for kind, item_bytes, _ in items if kind >= min(_LAYERS))
    begin = header.offset_to_point_data
    with path.open("rb") as file:
        file.seek(begin)
        (table,) = struct.unpack("<q", file.read(8))
        if table == -1:  # written by a program that could not go back
            file.seek(size - 8)
            (table,) = struct.unpack("<q", file.read(8))
        file.seek(table)
        _, chunks = struct.unpack("<II", file.read(8))
        if chunks > table - begin:
            raise ValueError(f"its chunk table announces {chunks:,} chunks in {table - begin:,} bytes")
        file.seek(begin)
        at = begin + 8
        for _, length in lazrs.read_chunk_table(file, lazrs.LazVlr(packing.record_data)):
            if layers:
                file.seek(at + sum(item_bytes for _, item_bytes, _ in items) + 4)
                if sum(struct.unpack(f"<{layers}I", file.read(4 * layers))) > length:
                    raise ValueError(f"a layer of its chunk at byte {at:,} reaches beyond the chunk")
            at += length
            if at > table:
                raise ValueError(f"a chunk reaches beyond its chunk table at byte {table:,}")


@contextlib.contextmanager
def _errors_of(path: Path) -> Iterator[None]:
    """Turn whatever a damaged file makes laspy and lazrs raise into one error."""
    try:
        with _without_stderr():
            yield
    except BaseException as error:
        if not isinstance(error, Exception) and type(error).__name__ != "PanicException":  # a panic of lazrs
            raise
        first = (str(error).strip().splitlines() or ["no reason given"])[0]
        raise SeipError(
            f"{path.name} is not a readable LAS or LAZ file ({first[:100]}); write or download it again"
        ) from error


@contextlib.contextmanager
def _without_stderr() -> Iterator[None]:
    """Keep what is written to the process's standard error away from it: a panic of lazrs prints a stack trace."""
    try:
        kept = os.dup(2)
    except OSError:  # Blender without a console
        yield
        return
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nothing)


def _code(header: Any) -> int | None:  # noqa: ANN401  # laspy has no types
    """Return the code of the horizontal system; a compound system has a separate code for heights."""
    for record in header.vlrs:
        text = getattr(record, "string", None)
        if isinstance(text, str) and (code := epsg_code(text)) is not None:
            return code
        for key in getattr(record, "geo_keys", []):
            if key.id == _PROJECTED_KEY and key.tiff_tag_location == 0:
                return int(key.value_offset)
    return None
