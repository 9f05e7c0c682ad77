"""Reader of Point Cloud Data files: ASCII, binary and compressed.

Source: Point Cloud Library, "The PCD (Point Cloud Data) file format", version 0.7.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float
from ...base.limits import MAP_COORDINATE, SWEEP_POINTS
from ...geometry.orientation import quaternion_rotation

_MAX_HEADER_BYTES = 1 << 16
_MAX_POINT_BYTES = 1 << 12
_MAX_LZF_RATIO = 88  # a reference of three bytes stands for 264 bytes
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
    elif end[1] == b"binary":
        if len(body) != count * point.itemsize:
            raise ValueError(f"it announces {count:,} points of {point.itemsize} bytes in {len(body):,} bytes")
        points = np.frombuffer(body, point)
        fields = [points[name] for name in point.names or ()]
    else:
        fields = _compressed_fields(body, point, count)
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


def _compressed_fields(body: bytes, point: np.dtype[Any], count: int) -> list[NDArray[Any]]:
    """Return the fields of a compressed body, in which all values of a field stand together."""
    packed, unpacked = struct.unpack_from("<II", body.ljust(8, b"\xff"))
    size = count * point.itemsize
    if packed > len(body) - 8 or unpacked != size or size > _MAX_LZF_RATIO * packed:
        raise ValueError(f"it announces {packed:,} bytes for {count:,} points in {len(body):,} compressed bytes")
    content = body[8 : 8 + packed]
    try:
        content = lzf_decompressed(content, size)
    except ValueError:
        if packed != size:  # some writers store bytes that LZF does not make shorter
            raise
    kinds = [point[name] for name in point.names or ()]
    parts = np.split(np.frombuffer(content, np.uint8), np.cumsum([count * kind.itemsize for kind in kinds])[:-1])
    return [part.view(kind.base).reshape(count, *kind.shape) for part, kind in zip(parts, kinds, strict=True)]


def lzf_decompressed(packed: bytes, size: int) -> bytes:
    """Return the ``size`` bytes that LZF has compressed.

    A control byte below 32 precedes that number of literal bytes, and one more. All others are references: three bits
    of length (7: another byte follows) and 13 bits of distance. Source: M. Lehmann, LibLZF, ``lzf_d.c``.

    Raises
    ------
    ValueError
        The compressed bytes are damaged.
    """
    result, at = bytearray(), 0
    try:
        while at < len(packed) and len(result) <= size:
            control = packed[at]
            at += 1
            if control < 32:
                result += packed[at : at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += packed[at]
                at += 1
            length += 2
            begin = len(result) - ((control & 31) << 8) - packed[at] - 1
            at += 1
            if begin < 0:
                raise ValueError("its compressed bytes refer to bytes before their beginning")
            part = result[begin : begin + length]
            # a reference may overlap with what it appends: then the bytes between repeat
            result += part if len(part) == length else (part * (length // len(part) + 1))[:length]
    except IndexError as error:
        raise ValueError("its compressed bytes end too early") from error
    if len(result) != size or at != len(packed):
        raise ValueError(f"its compressed bytes do not stand for {size:,} bytes")
    return bytes(result)
