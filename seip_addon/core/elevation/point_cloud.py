"""Laser surveys (LAS, LAZ), read with laspy where that is installed."""

import importlib
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ..arrays import Float, Integer
from ..errors import SeipError
from ..opendrive.reference_systems import epsg_code
from ..progress import Progress

SURVEY_SUFFIXES = (".las", ".laz")
POINTS_PER_STEP = 2_000_000
MAX_POINTS = 40_000_000  # at a place
_PROJECTED_KEY = 3072


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Points of a survey.

    Parameters
    ----------
    points : (n, 3) float64, metres
        In the survey's own system.
    classes : (n,) int64
        As the ASPRS numbers them: 2 ground, 3 to 5 vegetation, 6 building.
    """

    points: Float
    classes: Integer


def is_survey(path: Path) -> bool:
    """Return whether a file is a survey by its name."""
    return path.suffix.lower() in SURVEY_SUFFIXES


def survey_system(path: Path) -> tuple[int | None, Float]:
    """Return the EPSG code of a survey, None where it names none, and the middle of its points (1, 2).

    Raises
    ------
    SeipError
        The file cannot be read, or laspy is missing.
    """
    with _opened(path) as reader:
        return _code(reader.header), (np.array(reader.header.mins) + np.array(reader.header.maxs))[None, :2] / 2


def read_points(path: Path, low: Float, high: Float) -> Generator[Progress, None, PointCloud]:
    """Read the points of a survey between two corners in plan (2,), metres of its own system.

    Raises
    ------
    SeipError
        The file is damaged, or holds more than `MAX_POINTS` there.
    """
    points, classes, count, done = [], [], 0, 0
    with _opened(path) as reader:
        whole = int(reader.header.point_count)
        chunks = reader.chunk_iterator(POINTS_PER_STEP)
        while done < whole:
            yield Progress(done, whole, f"reading {path.name}")
            try:
                chunk = next(chunks)
                places = np.column_stack([np.asarray(chunk[axis], dtype=np.float64) for axis in ("x", "y", "z")])
                kinds = np.asarray(chunk.classification, dtype=np.int64)
            except Exception as error:  # whatever a damaged file makes of laspy
                raise _damaged(path, error) from error
            done += len(places)
            kept = ((places[:, :2] >= low) & (places[:, :2] <= high)).all(axis=1) & np.isfinite(places[:, 2])
            points.append(places[kept])
            classes.append(kinds[kept])
            count += int(kept.sum())
            if count > MAX_POINTS:
                raise SeipError(
                    f"{path.name} holds more than {MAX_POINTS:,} points at the place: thin it to a point each 20 cm "
                    "(pdal translate in.laz out.laz sample --filters.sample.radius=0.2)"
                )
    return PointCloud(np.concatenate([np.empty((0, 3)), *points]), np.concatenate([np.empty(0, np.int64), *classes]))


def _opened(path: Path) -> Any:  # noqa: ANN401  # laspy has no types
    laspy = _laspy(path)
    if not path.is_file():
        raise SeipError(f"no such file: {path}; check its path")
    try:
        return laspy.open(path)
    except Exception as error:  # whatever a damaged file makes of laspy
        raise _damaged(path, error) from error


def _damaged(path: Path, error: Exception) -> SeipError:
    first = (str(error).strip().splitlines() or ["no reason given"])[0]
    return SeipError(f"{path.name} is no LAS or LAZ file that can be read ({first[:100]}); download it again")


def _laspy(path: Path) -> ModuleType:
    try:
        if path.suffix.lower() == ".laz":
            importlib.import_module("lazrs")
        return importlib.import_module("laspy")
    except ModuleNotFoundError as error:
        raise SeipError(
            f"reading {path.name} needs {error.name}, which is not here; pip install laspy lazrs"
        ) from error


def _code(header: Any) -> int | None:  # noqa: ANN401  # laspy has no types
    """Return the code of the system in plan: of a compound one there is another for heights."""
    for record in header.vlrs:
        text = getattr(record, "string", None)
        if isinstance(text, str) and (code := epsg_code(text)) is not None:
            return code
        for key in getattr(record, "geo_keys", []):
            if key.id == _PROJECTED_KEY and key.tiff_tag_location == 0:
                return int(key.value_offset)
    return None
