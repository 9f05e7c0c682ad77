"""Reader of Point Cloud Data files: ASCII and binary.

Source: Point Cloud Library, "The PCD (Point Cloud Data) file format", version 0.7.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float
from ...base.limits import MAP_COORDINATE, SWEEP_POINTS
from ...geometry.orientation import quaternion_rotation

_MAX_HEADER_BYTES = 1 << 16
_MAX_POINT_BYTES = 1 << 12
_TYPES = {*("F4", "F8"), *(f"{kind}{size}" for kind in "IU" for size in (1, 2, 4, 8))}
_HEADER_END = re.compile(rb"^DATA[ \t]+(ascii|binary|binary_compressed)[ \t]*\r?\n", re.MULTILINE)


def read_pcd(content: bytes) -> tuple[dict[str, NDArray[Any]], Float | None]:
    """Return the fields of a PCD file by lower-case name, (n,) each, and the viewpoint (4, 4) float64.

    Fields with several values for each point are left out. The viewpoint is None if it is the identity.

    Raises
    ------
    ValueError
        The file is damaged or contradicts itself.
    """
    end = _HEADER_END.search(content, 0, _MAX_HEADER_BYTES)
    if end is None:
        raise ValueError("it has no PCD header")
    lines = (line.split() for line in content[: end.start()].decode("ascii").splitlines())
    header = {line[0]: line[1:] for line in lines if line}
    point = _point_type(header)
    count = _whole(header, "WIDTH") * _whole(header, "HEIGHT")
    if _whole(header, "POINTS", default=count) != count:
        raise ValueError(f"its POINTS differ from WIDTH × HEIGHT, {count:,}")
    body = content[end.end() :]
    if end[1] == b"ascii":
        fields = _ascii_fields(body, point, count)
    elif end[1] == b"binary_compressed":
        raise ValueError("it is compressed; write it as binary, with pcl_convert_pcd_ascii_binary IN OUT 1")
    else:
        if len(body) != count * point.itemsize:
            raise ValueError(f"it announces {count:,} points of {point.itemsize} bytes in {len(body):,} bytes")
        points = np.frombuffer(body, point)
        fields = [points[name] for name in point.names or ()]
    named = zip(header["FIELDS"], fields, strict=True)
    return {name.lower(): values for name, values in named if values.ndim == 1}, _viewpoint(header)


def _point_type(header: Mapping[str, Sequence[str]]) -> np.dtype[Any]:
    """Return the structured type of a point; its fields are numbered, because names may repeat."""
    kinds, sizes = header.get("TYPE", []), header.get("SIZE", [])
    counts = header.get("COUNT", ["1"] * len(kinds))
    if not 0 < len(header.get("FIELDS", [])) == len(kinds) == len(sizes) == len(counts):
        raise ValueError("its FIELDS, SIZE, TYPE and COUNT differ in length")
    types: list[Any] = []
    for number, (kind, size, count) in enumerate(zip(kinds, sizes, counts, strict=True)):
        if f"{kind}{size}" not in _TYPES or not re.fullmatch("[0-9]{1,4}", count):
            raise ValueError(f"it has a field of the unknown type {kind[:9]} {size[:9]} {count[:9]}")
        types.append((str(number), f"<{kind.lower()}{size}", () if int(count) == 1 else (int(count),)))
    point = np.dtype(types)
    if point.itemsize > _MAX_POINT_BYTES:
        raise ValueError(f"its points have more than {_MAX_POINT_BYTES:,} bytes each")
    return point


def _whole(header: Mapping[str, Sequence[str]], key: str, default: int | None = None) -> int:
    text = " ".join(header.get(key, [] if default is None else [str(default)]))
    if not re.fullmatch("[0-9]{1,9}", text) or int(text) > SWEEP_POINTS.most:
        raise ValueError(f"its {key} is not a whole number up to {SWEEP_POINTS.most:,}")
    return int(text)


def _viewpoint(header: Mapping[str, Sequence[str]]) -> Float | None:
    numbers = np.array(header.get("VIEWPOINT", [0, 0, 0, 1, 0, 0, 0]), dtype=np.float64)
    if numbers.shape != (7,) or not MAP_COORDINATE.allow(numbers):
        raise ValueError("its VIEWPOINT does not have seven numbers: position, and quaternion w x y z")
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = quaternion_rotation(numbers[3:]), numbers[:3]
    return None if (pose == np.eye(4)).all() else pose


def _ascii_fields(body: bytes, point: np.dtype[Any], count: int) -> list[NDArray[Any]]:
    ends = np.cumsum([math.prod(point[name].shape) for name in point.names or ()])
    table = number_table(body.decode("ascii"), None, range(int(ends[-1])))
    if len(table) != count:
        raise ValueError(f"it announces {count:,} points and has {len(table):,} lines")
    return [part[:, 0] if part.shape[1] == 1 else part for part in np.split(table, ends[:-1], axis=1)]


def number_table(text: str, delimiter: str | None, columns: Sequence[int]) -> Float:
    """Return columns of a text, (lines, columns) float64; blank lines are skipped.

    Raises
    ------
    ValueError
        A cell is missing or not a number.
    """
    if not text.strip():  # NumPy would warn
        return np.empty((0, len(columns)))
    return np.loadtxt(text.splitlines(), delimiter=delimiter, comments=None, ndmin=2, usecols=columns)
