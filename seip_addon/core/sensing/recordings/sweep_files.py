"""Sweeps, and their readers: PCD, KITTI's binary files, and npz."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.limits import MAP_NUMBER, SENSOR_COORDINATE, SWEEP_POINTS
from ...geometry.orientation import rotated
from ...storage.array_file import read_npz
from ...storage.files import read_small
from .pcd_file import read_pcd

MAX_BYTES = 1 << 30  # largest size of the file of a sweep
_BIN_COLUMNS = (4, 5, 6)  # of a .bin: KITTI's four, and a ring and a time

Columns = dict[str, NDArray[Any]]

_CURE = "export the sweep again"
_INTENSITY = ("intensity", "i", "reflectivity")
"""Names of the column of intensities in files, the preferred one first."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """Returns of one sensor in one revolution.

    Parameters
    ----------
    points : (n, 3) float32, metres
        Finite points in the sensor's axes (x forward, y left, z up), none of them (0, 0, 0).
    intensity : (n,) float32, optional
        Intensity in the unit of the file.
    viewpoint : (4, 4) float64, optional
        Pose of the sensor in the axes of the file, if the file states one that is not the identity.
    """

    points: NDArray[np.float32]
    intensity: NDArray[np.float32] | None = None
    viewpoint: Float | None = None

    def __len__(self) -> int:
        return len(self.points)


def sweep_suffix(path: Path) -> str:
    """Return the suffix by which a file is a sweep, such as ``.pcd``, or ""."""
    name = path.name.lower()
    return next((suffix for suffix in _READERS if name.endswith(suffix)), "")


def read_sweep(path: Path) -> Sweep:
    """Read a sweep in the format of the file's suffix.

    ``.bin`` holds four to six float32 for each point, of which x, y, z and intensity are read (KITTI). Point clouds
    with named columns need ``x``, ``y`` and ``z``; the names of intensity are those of `_INTENSITY`.

    Raises
    ------
    SeipError
        The file cannot be read, has another format, or is damaged.
    """
    suffix = sweep_suffix(path)
    if not suffix:
        raise SeipError(f"{path.name} is not a sweep: give a file that ends in {', '.join(_READERS)}")
    try:
        columns, viewpoint = _READERS[suffix](path)
    except UnicodeDecodeError as error:
        raise SeipError(f"{path.name} is not a text file; {_CURE}") from error
    except ValueError as error:
        raise SeipError(f"{path.name} is damaged or not a sweep ({str(error)[:200]}); {_CURE}") from error
    return _sweep_of(path.name, columns, viewpoint)


def _sweep_of(file: str, columns: Columns, viewpoint: Float | None) -> Sweep:
    """Return the sweep of a file without its missing returns, which are not finite or (0, 0, 0).

    Columns are ``x``, ``y``, ``z`` in the axes of the file, and ``intensity`` if it is known. With a viewpoint, points
    are transformed into the sensor's axes.
    """
    SWEEP_POINTS.require(len(columns["x"]), file, "number of points", "export one revolution to a file")
    points = np.column_stack([columns[axis].astype(np.float64) for axis in "xyz"])
    kept = np.isfinite(points).all(axis=1) & points.any(axis=1)
    points = points[kept]
    if viewpoint is not None:
        with np.errstate(over="ignore", invalid="ignore"):  # what overflows is refused below
            points = rotated(points - viewpoint[:3, 3], viewpoint[:3, :3].T)
    if not SENSOR_COORDINATE.allow(points):
        raise SeipError(
            f"{file} has points more than 10 km from the sensor, which looks like map coordinates: export points "
            "in the sensor's axes"
        )
    intensity = columns["intensity"][kept] if "intensity" in columns else None
    if intensity is not None:
        MAP_NUMBER.require(intensity, file, "intensity")
        intensity = intensity.astype(np.float32)
    return Sweep(points.astype(np.float32), intensity, viewpoint)


def _pcd(path: Path) -> tuple[Columns, Float | None]:
    fields, viewpoint = read_pcd(read_small(path, MAX_BYTES, _CURE))
    return {name: fields[found] for name, found in _found(path, list(fields)).items()}, viewpoint


def _found(path: Path, names: Sequence[str]) -> dict[str, str]:
    """Return the name in the file of each column that it has.

    Raises
    ------
    SeipError
        A coordinate is missing.
    """
    missing = [axis for axis in "xyz" if axis not in names]
    if missing:
        raise SeipError(f"{path.name} has no {' and no '.join(missing)}: name the columns of the coordinates x, y, z")
    found = {axis: axis for axis in "xyz"}
    if name := next((name for name in _INTENSITY if name in names), None):
        found["intensity"] = name
    return found


def _kitti(path: Path) -> tuple[Columns, None]:
    """Read float32 points: x, y, z, intensity, and up to two further columns, which are ignored."""
    content = read_small(path, MAX_BYTES, _CURE)
    values = np.frombuffer(content[: len(content) // 4 * 4], "<f4")
    whole = [count for count in _BIN_COLUMNS if len(content) % (4 * count) == 0]
    if not whole:
        raise ValueError(
            f"{len(content):,} bytes are not whole points of {_BIN_COLUMNS[0]} to {_BIN_COLUMNS[-1]} float32"
        )
    # The file does not give the number of columns. With a wrong one, coordinates are taken for intensity, and some of
    # them are negative.
    count = next((count for count in whole if (values[3::count] >= 0.0).all()), whole[0])
    points = values.reshape(-1, count)
    return dict(zip(("x", "y", "z", "intensity"), points.T, strict=False)), None


def _npz(path: Path) -> tuple[Columns, None]:
    arrays = read_npz(path, MAX_BYTES)
    if "points" in arrays:
        points = arrays.pop("points")
        if points.ndim != 2 or not 3 <= points.shape[1] <= 6:
            raise ValueError(f"points has the shape {points.shape}, not (n, 3 to 6)")
        arrays |= dict(zip(("x", "y", "z", "intensity"), points.T, strict=False))
    columns = {name: arrays[found] for name, found in _found(path, list(arrays)).items()}
    count = columns["x"].size
    for name, column in columns.items():
        if column.dtype.kind not in "fiu" or column.shape != (count,):
            raise ValueError(f"{name} is not an array of numbers, one for each point")
    return columns, None


_READERS: dict[str, Callable[[Path], tuple[Columns, Float | None]]] = {
    ".pcd": _pcd,
    ".bin": _kitti,
    ".npz": _npz,
}
