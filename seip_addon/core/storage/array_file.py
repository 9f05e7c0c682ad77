"""Files of named arrays with a header, validated before use."""

from __future__ import annotations

import io
import json
import math
import os
import re
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Literal, NoReturn

import numpy as np
from numpy.typing import NDArray

from ..errors import SeipError
from ..limits import Limits
from .files import digest, whole_file

MAX_BYTES = 1 << 32  # largest total size of the arrays of a file: 4 GiB
MAX_HEADER_BYTES = 1 << 27  # largest header, with four bytes for each character: 128 MiB
MAX_TEXT_LENGTH = 256  # largest number of characters of an entry in an array of text
_OLD_VERSION = 1  # version of files without a digest
_READ_AT_ONCE = 1 << 18  # bytes
_MAX_DEFLATE_RATIO = 1032  # bytes that one byte of DEFLATE can stand for (RFC 1951)

_NPY = re.compile(
    rb"\x93NUMPY\x01\x00.."
    rb"\{'descr': '([<|][a-zA-Z]\d{1,9})', 'fortran_order': (True|False), 'shape': \(([\d, ]*)\), \} *\n",
    re.DOTALL,
)
"""Header of an array as NumPy writes it, with its type and shape."""


class ContentError(ValueError):
    """Fault in the content of a file, as part of a sentence."""


@dataclass(frozen=True)
class ArrayRule:
    """Rule for an array of a file: type, shape and range.

    Parameters
    ----------
    dtype : str
        NumPy name of the type; ``U`` is text of any length up to `MAX_TEXT_LENGTH`.
    shape : tuple of int and str
        Length of each axis; a str is a variable with one value across all arrays of a file.
    limits : Limits, optional
        Allowed range of the values. Arrays of floating-point numbers always have one.
    """

    dtype: str
    shape: tuple[int | str, ...]
    limits: Limits | None = None

    def __post_init__(self) -> None:
        if self.limits is None and self.dtype.startswith("f"):
            raise ValueError("an array of floating-point numbers needs limits")

    def check(self, name: str, array: NDArray[Any]) -> None:
        """Raise `ContentError` if values lie outside the limits."""
        if self.limits is not None and not self.limits.allow(array):
            worst = array[~self.limits.each(array)].flat[0]
            raise ContentError(f"{name} has the value {worst:g}, not {self.limits}")


@dataclass(frozen=True)
class ArrayFile:
    """A format for files of named arrays and a header: npz, with JSON as the text ``header``.

    The header contains a digest of itself and of the arrays, except in version 1.

    Parameters
    ----------
    schema : str
        Identifier of the format, written to the header.
    version : int
        Version of the format.
    what : str
        Kind of file for messages: "visibility grid".
    remedy : str
        Way to get a new file, for messages: "delete it and compute it again".
    arrays : mapping of str to ArrayRule
        All arrays of a file, by name.
    compressed : bool
        Whether arrays are deflated; noisy measurements hardly compress.
    undigested : bool
        Whether files of version 1 are read as well. Other versions are rejected.

    Examples
    --------
    >>> rules = {"heights": ArrayRule("f8", ("n",), Limits(0.0, 100.0))}
    >>> profile = ArrayFile("example.heights", 1, "profile of heights", "measure it again", rules)
    >>> profile.save("heights.npz", {"spacing": 4.0}, {"heights": np.array([0.0, 3.5, 8.0])})
    >>> with profile.reading("heights.npz") as (header, arrays):
    ...     print(header["spacing"], arrays["heights"].tolist())
    4.0 [0.0, 3.5, 8.0]
    """

    schema: str
    version: int
    what: str
    remedy: str
    arrays: Mapping[str, ArrayRule]
    compressed: bool = True
    undigested: bool = False

    def save(self, path: str | os.PathLike[str], header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a header with values that JSON supports, and the arrays by name."""
        typed = {
            name: np.asarray(arrays[name], dtype=None if rule.dtype == "U" else rule.dtype, order="C")
            for name, rule in self.arrays.items()
        }
        full = {"schema": self.schema, "version": self.version, **header}
        text = json.dumps({**full, "digest": _digest(full, typed)}, ensure_ascii=False, allow_nan=False)
        write = np.savez_compressed if self.compressed else np.savez
        content = io.BytesIO()  # written to memory first: NumPy leaves an archive open if the disk is full
        write(content, header=np.array(text), **typed)
        with whole_file(path) as temporary:
            temporary.write_bytes(content.getvalue())

    @contextmanager
    def reading(self, path: str | os.PathLike[str]) -> Iterator[tuple[dict[str, Any], dict[str, NDArray[Any]]]]:
        """Yield the header and the arrays; errors raised in the block are reported as a damaged file.

        Sizes are compared with the rules and with each other before any array is read.

        Raises
        ------
        SeipError
            The file does not exist, is damaged, or has a different format or version.
        """
        try:
            with Path(path).open("rb") as file, _archive(file) as archive:
                header = _read_header(archive)
                versions = (_OLD_VERSION, self.version) if self.undigested else (self.version,)
                known = header["schema"] == self.schema and header["version"] in versions
                if known:
                    yield header, self._read_arrays(archive, header)
        except FileNotFoundError as error:
            raise SeipError(f"there is no {self.what} {path}; {self.remedy}") from error
        except ContentError as error:
            raise SeipError(f"{path} is damaged or not a {self.what}: {error}; {self.remedy}") from error
        except READ_ERRORS as error:
            raise SeipError(f"{path} is damaged or not a {self.what}; {self.remedy}") from error
        if not known:
            raise SeipError(f"{path} is not a {self.what} of this version; {self.remedy}")

    def _read_arrays(self, archive: zipfile.ZipFile, header: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
        members = {f"{name}.npy": name for name in self.arrays}
        names = archive.namelist()
        if sorted(names) != sorted([*members, "header.npy"]):
            raise ContentError("it has missing or additional arrays")
        self._check_claims({members[name]: _claim(archive, name) for name in members})
        arrays = {name: _array(archive, member) for member, name in members.items()}
        content = {name: value for name, value in header.items() if name != "digest"}
        if (header["version"] != _OLD_VERSION or "digest" in header) and header["digest"] != _digest(content, arrays):
            raise ContentError("its content differs from its digest")
        for name, rule in self.arrays.items():
            rule.check(name, arrays[name])
        return arrays

    def _check_claims(self, claims: Mapping[str, _Claim]) -> None:
        """Check types and lengths against the rules, and that all arrays fit into memory."""
        lengths: dict[str, int] = {}
        for name, rule in self.arrays.items():
            dtype, shape = claims[name].dtype, claims[name].shape
            text = dtype.kind == rule.dtype == "U" and dtype.itemsize <= 4 * MAX_TEXT_LENGTH
            if not text and dtype != np.dtype(rule.dtype):
                raise ContentError(f"{name} is of the type {dtype}")
            if len(shape) != len(rule.shape):
                raise ContentError(f"{name} has {len(shape)} dimensions")
            for length, wanted in zip(shape, rule.shape, strict=True):
                other = wanted if isinstance(wanted, int) else lengths.setdefault(wanted, length)
                if length != other:
                    raise ContentError(f"{name} has the length {length} in place of {other}")
        if sum(claim.size for claim in claims.values()) > MAX_BYTES:
            raise ContentError(f"it holds more than {MAX_BYTES >> 30} GiB")


def read_npz(path: Path, most: int) -> dict[str, NDArray[Any]]:
    """Return all arrays of an npz file of another program, by name.

    Raises
    ------
    SeipError
        The file does not exist, is damaged, or holds more than ``most`` bytes of arrays.
    """
    try:
        with path.open("rb") as file, _archive(file) as archive:
            members = archive.namelist()
            if sum(_claim(archive, member).size for member in members) > most:
                raise ContentError(f"it holds more than {most / 1e6:,.0f} MB")
            return {member.removesuffix(".npy"): _array(archive, member) for member in members}
    except FileNotFoundError as error:
        raise SeipError(f"no such file: {path}; check its path") from error
    except READ_ERRORS as error:
        reason = f": {error}" if isinstance(error, ContentError) else ""
        raise SeipError(f"{path.name} is damaged or not an npz file{reason}; write it again") from error


def _archive(file: BinaryIO) -> zipfile.ZipFile:
    """Open an archive that starts at the first byte, as NumPy requires; zip archives may have other data before."""
    if file.read(4) != b"PK\x03\x04":
        raise ContentError("it does not begin with an array")
    return zipfile.ZipFile(file)


def _read_header(archive: zipfile.ZipFile) -> dict[str, Any]:
    claim = _claim(archive, "header.npy")
    if claim.dtype.kind != "U" or claim.shape != () or claim.size > MAX_HEADER_BYTES:
        raise ContentError("it has no header")
    text = str(_array(archive, "header.npy"))
    header = json.loads(text, parse_constant=_refuse_constant)
    if not isinstance(header, dict):
        raise ContentError("it has no header")
    return header


@dataclass(frozen=True)
class _Claim:
    """Type, shape and order of an array as claimed by its member of the archive, and the byte where it begins."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    order: Literal["C", "F"]
    begin: int

    @property
    def size(self) -> int:
        """Bytes of the array."""
        return math.prod(self.shape) * self.dtype.itemsize


def _claim(archive: zipfile.ZipFile, member: str) -> _Claim:
    """Return the claim of a member after checking it against the size of the member."""
    info = archive.getinfo(member)
    if info.flag_bits & 1 or info.compress_type not in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}:
        raise ContentError(f"{member} uses an unsupported compression method")
    with archive.open(info) as stream:
        begin = _NPY.match(stream.read(256))
    if begin is None:
        raise ContentError(f"{member} is not an array")
    shape = tuple(int(length) for length in begin[3].decode().split(",") if length.strip())
    claim = _Claim(np.dtype(begin[1].decode()), shape, "F" if begin[2] == b"True" else "C", begin.end())
    size = claim.begin + claim.size
    if size != info.file_size or size > _MAX_DEFLATE_RATIO * (info.compress_size + 1):
        raise ContentError(f"{member} claims {size:,} bytes, which differs from its size in the file")
    return claim


def _array(archive: zipfile.ZipFile, member: str) -> NDArray[Any]:
    """Read an array without NumPy, which parses the header as Python source: not thread-safe in older Pythons."""
    claim = _claim(archive, member)
    array = np.empty(math.prod(claim.shape), claim.dtype)
    rest = array.view(np.uint8).data
    with archive.open(member) as stream:
        stream.read(claim.begin)
        while rest:
            part = stream.read(min(len(rest), _READ_AT_ONCE))
            if not part:
                raise ContentError(f"{member} ends too early")
            rest[: len(part)] = part
            rest = rest[len(part) :]
    return array.reshape(claim.shape, order=claim.order)


def _digest(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> str:
    named = [part for name in sorted(arrays) for part in (name, arrays[name])]
    return digest(json.dumps(header, sort_keys=True), *named)


def _refuse_constant(name: str) -> NoReturn:
    raise ContentError(f"its header has the number {name}")


READ_ERRORS = (
    *(OSError, EOFError, ArithmeticError, AttributeError, ValueError, LookupError, TypeError, RuntimeError),
    *(MemoryError, zipfile.BadZipFile, zlib.error),
)
"""Exceptions raised by reading a damaged npz file, or by using its contents."""
