"""Poses of sensors in the axes of a site, from a JSON file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.limits import LOCAL_COORDINATE
from ...geometry.orientation import nearest_rotation
from ...storage.array_file import READ_ERRORS
from ...storage.files import content_fault, parse_json, read_small

Pose = Float
"""Transform (4, 4) float64 from a sensor's axes to those of the site."""

_MAX_BYTES = 1 << 22
_MAX_NAME = 100  # characters of a sensor's name
_CURE = 'give each sensor\'s name and a 4 × 4 matrix, as JSON: {"S1": [[…], …]}'


def read_poses(path: Path) -> dict[str, Pose]:
    """Read the pose of each sensor by name, ``{name: matrix}``; rotations that are off by rounding are made exact.

    Raises
    ------
    SeipError
        The file cannot be read, or a pose is not a rotation and a translation.
    """
    text = read_small(path, _MAX_BYTES, _CURE)
    try:
        matrices = dict(parse_json(text))
        if not matrices:
            raise ValueError("it names no sensor")
        return {name: _pose(name, matrix) for name, matrix in matrices.items()}
    except READ_ERRORS as error:
        raise SeipError(f"{path.name} has no readable poses ({content_fault(error)}); {_CURE}") from error


def _pose(name: str, matrix: Any) -> Pose:  # noqa: ANN401  # lists of numbers, if all is well
    if not 0 < len(name) <= _MAX_NAME or not name.isprintable():
        raise ValueError(f"the name {name[:40]!r} of a sensor does not have 1 to {_MAX_NAME} printable characters")
    pose = np.array(matrix, dtype=np.float64)
    if pose.size != 16 or not LOCAL_COORDINATE.allow(pose):
        raise ValueError(f"the pose of {name[:40]!r} does not have 16 numbers of at most 10,000 km")
    pose = pose.reshape(4, 4)
    if (pose[3] != (0.0, 0.0, 0.0, 1.0)).any():
        raise ValueError(f"the last row of the pose of {name[:40]!r} is not 0 0 0 1")
    pose[:3, :3] = nearest_rotation(pose[:3, :3])
    return pose
