"""Poses of sensors in the axes of a site, from calibration files."""

from __future__ import annotations

import re
from collections.abc import Mapping
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
_CURE = "give each sensor's name and a 4 × 4 matrix, as JSON"
_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?(?![\w.])")
_CAMERA_TO_SITE = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""From a camera's axes (x right, y down, z forward) to those of a site whose x points forward."""


def read_poses(path: Path) -> dict[str, Pose]:
    """Read the pose of each sensor by name; rotations that are off by rounding are made exact.

    - JSON, or YAML with one name for each matrix: ``{name: matrix}``.
    - JSON: ``{"sensors": [{"name" or "id": name, "pose": matrix}]}``.
    - JSON of DAIR-V2X with ``rotation`` and ``translation``. The sensor has the name of the file.
    - KITTI's calibration: ``Tr_velo_to_world``, or else ``Tr_velo_to_cam`` or ``Tr`` with the site at the camera, x
      forward and z up, as in datasets of this program. The sensor has the name of the file.

    Raises
    ------
    SeipError
        The file cannot be read, or a pose is not a rotation and a translation.
    """
    text = read_small(path, _MAX_BYTES, _CURE).decode("utf-8-sig", "replace")
    try:
        if text.lstrip().startswith(("{", "[")):
            matrices = _of_json(parse_json(text), path.stem)
        elif re.search(r"^Tr\w*[ \t]*:", text, re.MULTILINE):
            matrices = {path.stem: _of_kitti(text)}
        else:
            matrices = _of_yaml(text)
        if not matrices:
            raise ValueError("it names no sensor")
        return {name: _pose(name, matrix) for name, matrix in matrices.items()}
    except READ_ERRORS as error:
        raise SeipError(f"{path.name} has no readable poses ({content_fault(error)}); {_CURE}") from error


def _of_json(content: Any, name: str) -> Mapping[str, Any]:  # noqa: ANN401  # any JSON
    if "rotation" in content and "translation" in content:
        position = np.reshape(np.array(content["translation"], dtype=np.float64), (3, 1))
        return {name: np.vstack([np.hstack([content["rotation"], position]), [0.0, 0.0, 0.0, 1.0]])}
    if "sensors" in content:
        named = [(str(sensor.get("name", sensor.get("id"))), sensor["pose"]) for sensor in content["sensors"]]
        if len(dict(named)) < len(named):
            raise ValueError("two sensors have one name")
        return dict(named)
    return dict(content)


def _of_yaml(text: str) -> Mapping[str, Any]:
    """Return the numbers after each name that begins a line, which is all of YAML that matrices need."""
    text = re.sub(r"(?:^|(?<=\s))#.*|^---.*", "", text, flags=re.MULTILINE)
    first, *parts = re.split(r"^[\"']?([\w. -]*\w)[\"']?[ \t]*:", text, flags=re.MULTILINE)
    names, bodies = parts[::2], parts[1::2]
    others = [first, *(_NUMBER.sub("", body) for body in bodies)]
    if len(set(names)) < len(names) or any(other.strip("[], \r\n\t-") for other in others):
        raise ValueError("it is neither JSON nor YAML with one name for each matrix: convert it to JSON")
    return {name: _NUMBER.findall(body) for name, body in zip(names, bodies, strict=True)}


def _of_kitti(text: str) -> Float:
    lines = {key.strip(): numbers for key, _, numbers in (line.partition(":") for line in text.splitlines())}
    key = next((key for key in ("Tr_velo_to_world", "Tr_velo_to_cam", "Tr") if key in lines), None)
    if key is None:
        raise ValueError("it has none of Tr_velo_to_world, Tr_velo_to_cam and Tr")
    pose = np.vstack([np.array(lines[key].split(), dtype=np.float64).reshape(3, 4), [0.0, 0.0, 0.0, 1.0]])
    if key != "Tr_velo_to_world" and np.isfinite(pose).all():  # products warn of other numbers, which are refused later
        pose = _CAMERA_TO_SITE @ pose
    return pose


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
