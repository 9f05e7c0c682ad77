"""Laser surveys (LAS, LAZ), read with laspy if it is installed."""

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Float, Integer
from ...errors import SeipError
from ...geometry.reference_systems import epsg_code
from ...limits import ELEVATION, MAP_COORDINATE
from ...progress import Progress
from ...storage.las_file import damaged_las, opened_las

SURVEY_SUFFIXES = (".las", ".laz")
POINTS_PER_STEP = 2_000_000
MAX_POINTS = 40_000_000  # points at a place
_PROJECTED_KEY = 3072


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
    with opened_las(path) as reader:
        return _code(reader.header), (np.array(reader.header.mins) + np.array(reader.header.maxs))[None, :2] / 2


def read_points(path: Path, low: Float, high: Float) -> Generator[Progress, None, PointCloud]:
    """Read the points of a survey between two corners in plan (2,), in its reference system.

    Raises
    ------
    SeipError
        The file is damaged, or has more than `MAX_POINTS` there.
    """
    points, classes, count, done = [], [], 0, 0
    with opened_las(path) as reader:
        whole = int(reader.header.point_count)
        chunks = reader.chunk_iterator(POINTS_PER_STEP)
        while done < whole:
            yield Progress(done, whole, f"reading {path.name}")
            try:
                chunk = next(chunks)
                places = np.column_stack([np.asarray(chunk[axis], dtype=np.float64) for axis in ("x", "y", "z")])
                kinds = np.asarray(chunk.classification, dtype=np.int64)
            except Exception as error:  # whatever a damaged file makes of laspy
                raise damaged_las(path, error) from error
            done += len(places)
            if fault := MAP_COORDINATE.fault(places):
                raise damaged_las(path, ValueError(f"a coordinate {fault}"))
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
