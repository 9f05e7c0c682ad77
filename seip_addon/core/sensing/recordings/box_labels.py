"""Labelled boxes of a sweep, in the format of OpenPCDet."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.arrays import Float, Text
from ...base.errors import SeipError
from ...base.limits import ROAD_USER_SIZE, SENSOR_COORDINATE, UNWRAPPED_ANGLE, Limits
from ...storage.array_file import READ_ERRORS
from ...storage.files import content_fault, read_small
from ..traffic.trajectories import CATEGORIES

_MAX_BYTES = 1 << 26
_CURE = "give the labels of one sweep as OpenPCDet has them"

_CATEGORY = {
    **{category: category for category in CATEGORIES},
    "cyclist": "bicycle",
    "motorcyclist": "motorcycle",
    "person": "pedestrian",
    "personsitting": "pedestrian",
}
"""Category of each class name, in lower case and without punctuation."""


@dataclass(frozen=True, eq=False)
class BoxLabels:
    """Labelled boxes of one sweep; those of other classes are left out.

    Parameters
    ----------
    boxes : (k, 7) float64
        x, y, z of the middle, length, width, height (metres), and yaw in [-π, π) counter-clockwise from +x (radians),
        in the axes of the file.
    category : (k,) str
        One of `CATEGORIES` for each box.
    """

    boxes: Float
    category: Text

    def __len__(self) -> int:
        return len(self.boxes)


def read_labels(path: Path) -> BoxLabels:
    """Read the labelled boxes of a sweep: lines ``x y z dx dy dz heading class``, which a score may follow.

    A file without content has no labels.

    Raises
    ------
    SeipError
        The file cannot be read, has another format or several frames, or a box is not one of a road user.
    """
    if path.is_file() and not path.stat().st_size:
        return BoxLabels(np.zeros((0, 7)), np.zeros(0, dtype=np.str_))
    text = read_small(path, _MAX_BYTES, _CURE).decode("utf-8-sig", "replace")
    try:
        return _labels([line.split() for line in text.splitlines() if line.strip()])
    except READ_ERRORS as error:
        raise SeipError(f"{path.name} has no readable labels ({content_fault(error)}); {_CURE}") from error


def _labels(lines: Sequence[Sequence[str]]) -> BoxLabels:
    rows, categories = [], []
    for words in lines:
        if not 8 <= len(words) <= 9:
            raise ValueError(f"a line has {len(words)} columns, not 8")
        category = _CATEGORY.get(re.sub(r"[\W_]", "", words[7].lower()))
        if category is not None:
            rows.append([float(word) for word in words[:7]])
            categories.append(category)
    table = np.array(rows, dtype=np.float64).reshape(-1, 7)
    checks = {
        "the middle of a box": (table[:, :3], SENSOR_COORDINATE),
        "its size": (table[:, 3:6], ROAD_USER_SIZE),
        "its yaw": (table[:, 6], UNWRAPPED_ANGLE),
    }
    if fault := Limits.first_fault(checks):
        raise ValueError(fault)
    table[:, 6] = np.mod(table[:, 6] + np.pi, 2 * np.pi) - np.pi
    return BoxLabels(table, np.array(categories, dtype=np.str_))
