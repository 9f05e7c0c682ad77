"""A sweep: the returns of one sensor in one revolution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.limits import MAP_NUMBER, SENSOR_COORDINATE, SWEEP_POINTS, TIME
from ...geometry.orientation import rotated


@dataclass(frozen=True, eq=False)
class Sweep:
    """Returns of one sensor in one revolution.

    Parameters
    ----------
    time : float, seconds, optional
        Time of the sweep, if known.
    points : (n, 3) float32, metres
        Finite points in the sensor's axes (x forward, y left, z up), none of them (0, 0, 0).
    intensity : (n,) float32, optional
        Intensity in the unit of the file.
    viewpoint : (4, 4) float64, optional
        Pose of the sensor in the axes of the file, if the file states one that is not the identity.
    """

    time: float | None
    points: NDArray[np.float32]
    intensity: NDArray[np.float32] | None = None
    viewpoint: Float | None = None

    def __len__(self) -> int:
        return len(self.points)


def sweep_of(file: str, columns: dict[str, NDArray[Any]], viewpoint: Float | None = None) -> Sweep:
    """Return the sweep of a file without its missing returns, which are not finite or (0, 0, 0).

    Parameters
    ----------
    file : str
        Name of the file, for messages.
    columns : dict of str to (n,) array of numbers
        ``x``, ``y``, ``z`` in the axes of the file, and ``intensity`` and ``time`` if they are known. Others are
        ignored.
    viewpoint : (4, 4) float64, optional
        Pose of the sensor in the axes of the file; points are transformed into the sensor's axes.

    Raises
    ------
    SeipError
        There are too many points, or a number is out of range.
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
    chosen = {name: column[kept] for name, column in columns.items() if name not in {"x", "y", "z"}}
    for name, limits in (("intensity", MAP_NUMBER), ("time", TIME)):
        if name in chosen:
            limits.require(chosen[name], file, name)
    return Sweep(
        time=float(chosen["time"].min()) if len(chosen.get("time", ())) else None,
        points=points.astype(np.float32),
        intensity=chosen["intensity"].astype(np.float32) if "intensity" in chosen else None,
        viewpoint=viewpoint,
    )
