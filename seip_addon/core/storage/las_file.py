"""LAS and LAZ files, opened with laspy if it is installed, after a check of their headers."""

import importlib
import struct
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, BinaryIO

from ..errors import SeipError
from ..limits import MAP_COORDINATE, Limits

_HEADER_BYTES, _HEADER_BYTES_1_4 = 227, 375  # headers of LAS 1.0 to 1.2, and of 1.4
_RECORD_BYTES, _EXTENDED_RECORD_BYTES = 54, 60  # before the content of a variable-length record
_LASZIP_USER, _VARIABLE_CHUNKS = b"laszip encoded", 2**32 - 1
_PACKED = 0x80  # bit of the point format that LAZ sets
_MAX_PACKED_POINTS = 1_000  # per byte of LAZ: even flat ground measured evenly needs far more bytes
_SCALE = Limits(1e-9, 1e3, "m")


def opened_las(path: Path) -> Any:  # noqa: ANN401  # laspy has no types
    """Return a reader of laspy for a file whose header fits its size.

    Raises
    ------
    SeipError
        The file is missing or damaged, or laspy is not installed.
    """
    laspy = laspy_for(f"reading {path.name}", compressed=path.suffix.lower() == ".laz")
    if not path.is_file():
        raise SeipError(f"no such file: {path}; check its path")
    try:
        _check_header(path)
        return laspy.open(path)
    except Exception as error:  # whatever a damaged file makes of laspy
        raise damaged_las(path, error) from error


def _check_header(path: Path) -> None:
    """Check the header of a survey against the size of the file, because laspy trusts it.

    Fields and sizes are those of the ASPRS LAS specification 1.4 R15, sections 2.4 to 2.7.

    Raises
    ------
    ValueError
        The file is too short for its header, or a scale, offset or bound is not a plausible number.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        header = file.read(_HEADER_BYTES_1_4)
        if len(header) < _HEADER_BYTES or not header.startswith(b"LASF"):
            raise ValueError("it does not begin as a LAS file")
        minor = header[25]
        length, data, records = struct.unpack_from("<HII", header, 94)
        kind, point_bytes, points = struct.unpack_from("<BHI", header, 104)
        extended, extended_records = 0, 0
        if minor >= 4 and len(header) == _HEADER_BYTES_1_4:
            extended, extended_records, points_1_4 = struct.unpack_from("<QIQ", header, 235)
            points = points_1_4 or points
        if not _HEADER_BYTES <= length <= data <= size:
            raise ValueError(f"its points begin at byte {data:,} of {size:,}")
        packing = _check_records(file, records, length, data, _RECORD_BYTES)
        if extended_records:
            _check_records(file, extended_records, extended, size, _EXTENDED_RECORD_BYTES)
        packed = bool(kind & _PACKED)
        if packed:
            _check_packing(file, packing, data, size, points, point_bytes)
    if not packed and points * point_bytes > size - data:
        raise ValueError(f"it announces {points:,} points of {point_bytes} bytes in {size - data:,} bytes")
    if packed and points > _MAX_PACKED_POINTS * (size - data):
        raise ValueError(f"it announces {points:,} points in {size - data:,} packed bytes")
    scales, offsets, bounds = (
        struct.unpack_from(f"<{count}d", header, at) for count, at in ((3, 131), (3, 155), (6, 179))
    )
    for what, limits, values in (
        ("scale", _SCALE, scales),
        ("offset", MAP_COORDINATE, offsets),
        ("bound", MAP_COORDINATE, bounds),
    ):
        if fault := limits.fault(values):
            raise ValueError(f"its {what} {fault}")


def _check_records(file: BinaryIO, count: int, begin: int, end: int, header_bytes: int) -> list[bytes]:
    """Check that variable-length records follow each other between two bytes of a file; return those of LASzip.

    Raises
    ------
    ValueError
        A record reaches beyond the end.
    """
    at, extended = begin, header_bytes == _EXTENDED_RECORD_BYTES
    found: list[bytes] = []
    if count * header_bytes > end - begin:
        raise ValueError(f"it announces {count:,} variable-length records in {max(end - begin, 0):,} bytes")
    for _ in range(count):
        file.seek(at)
        header = file.read(header_bytes)
        if len(header) < header_bytes:
            raise ValueError("a variable-length record ends beyond the file")
        (length,) = struct.unpack_from("<Q" if extended else "<H", header, 20)
        if at + header_bytes + length > end:
            raise ValueError("a variable-length record reaches beyond its place")
        if header[2:18].rstrip(b"\0") == _LASZIP_USER:
            found.append(file.read(length))
        at += header_bytes + length
    return found


def _check_packing(
    file: BinaryIO, records: Sequence[bytes], data: int, size: int, points: int, point_bytes: int
) -> None:
    """Check the description of packed points in LAZ: LASzip 1.4, header and chunk table.

    Parameters
    ----------
    records : sequence of bytes
        LASzip records of the file.
    data, size : int
        Byte at which the packed points begin, and bytes of the file.

    Raises
    ------
    ValueError
        The items are not those of the points, or the chunk table does not fit into the file.
    """
    if len(records) != 1 or len(records[0]) < 34:
        raise ValueError("it has no LASzip record, or several")
    _, _, _, _, _, _, chunk, _, _, items = struct.unpack_from("<HHBBHIIqqH", records[0])
    if len(records[0]) < 34 + 6 * items:
        raise ValueError(f"its LASzip record announces {items} items and ends before them")
    sizes = [struct.unpack_from("<HHH", records[0], 34 + 6 * number)[1] for number in range(items)]
    if sum(sizes) != point_bytes:
        raise ValueError(f"its packed items have {sum(sizes)} bytes and its points {point_bytes}")
    file.seek(data)
    (table,) = struct.unpack("<q", file.read(8).ljust(8, b"\xff"))
    if table == -1:  # written by a program that could not go back
        file.seek(max(size - 8, 0))
        (table,) = struct.unpack("<q", file.read(8).ljust(8, b"\xff"))
    if not data + 8 <= table <= size - 8:
        raise ValueError(f"its chunk table begins at byte {table:,} of {size:,}")
    file.seek(table)
    _, chunks = struct.unpack("<II", file.read(8))
    fixed = 0 < chunk < _VARIABLE_CHUNKS
    if (
        chunk == 0
        or chunks > table - data
        or (fixed and not chunk * (chunks - 1) < points + (points == 0) <= chunk * chunks + 1)
    ):
        raise ValueError(f"its chunk table announces {chunks:,} chunks of {chunk:,} points for {points:,} points")


def damaged_las(path: Path, error: Exception) -> SeipError:
    """Return the error of a damaged file from what laspy raised."""
    first = (str(error).strip().splitlines() or ["no reason given"])[0]
    return SeipError(f"{path.name} is not a readable LAS or LAZ file ({first[:100]}); write or download it again")


def laspy_for(work: str, *, compressed: bool) -> ModuleType:
    """Return laspy; ``work`` that needs it, such as "reading a.las", is for messages.

    Raises
    ------
    SeipError
        It is not installed, or lazrs is not, which it needs for LAZ (``compressed``).
    """
    try:
        if compressed:
            importlib.import_module("lazrs")
        return importlib.import_module("laspy")
    except ModuleNotFoundError as error:
        raise SeipError(f"{work} needs {error.name}, which is not installed; pip install laspy lazrs") from error
