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

MAX_BYTES = 1 << 32  # bytes of all arrays of a file together at most: 4 GiB
MAX_HEADER_BYTES = 1 << 27  # bytes of the header, four for each of its characters: 128 MiB
MAX_TEXT_LENGTH = 256  # characters of an entry of an array of text at most
_OLD_VERSION = 1  # the version of files that hold no digest
_READ_AT_ONCE = 1 << 18  # bytes
_MAX_DEFLATE_RATIO = 1032  # bytes that one byte of DEFLATE can stand for (RFC 1951)

_NPY = re.compile(
    rb"\x93NUMPY\x01\x00.."
    rb"\{'descr': '([<|][a-zA-Z]\d{1,9})', 'fortran_order': (True|False), 'shape': \(([\d, ]*)\), \} *\n",
    re.DOTALL,
)
"""How NumPy begins an array in a file, with its type and shape."""


class ContentError(ValueError):
    """What is wrong with the content of a file, as a part of a sentence."""


@dataclass(frozen=True)
class ArrayRule:
    """Rule for an array of a file: type, shape and range.

    Parameters
    ----------
    dtype : str
        NumPy's name of its type; ``U`` is text of any length up to `MAX_TEXT_LENGTH`.
    shape : tuple of int and str
        Length of each axis; a text is a variable that has one value across all arrays of a file.
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
        """Raise `ContentError` where values lie outside the limits."""
        if self.limits is not None and not self.limits.allow(array):
            worst = array[~self.limits.each(array)].flat[0]
            raise ContentError(f"{name} has the value {worst:g}, not {self.limits}")


@dataclass(frozen=True)
class ArrayFile:
    """A kind of file that holds named arrays and a header: npz, with JSON as the text ``header``.

    The header holds a digest of itself and of the arrays; that of version 1 holds none.

    Parameters
    ----------
    schema : str
        Identifier of the format, written to the header.
    version : int
        Version of the format.
    what : str
        What a file holds, for messages: "visibility grid".
    remedy : str
        How to get a new one, for messages: "delete it and compute it again".
    arrays : mapping of str to ArrayRule
        All arrays of a file, by name.
    compressed : bool
        Whether arrays are deflated; noisy measurements hardly compress.
    undigested : bool
        Whether files of version 1 are read as well. Those of other versions are refused.
    """

    schema: str
    version: int
    what: str
    remedy: str
    arrays: Mapping[str, ArrayRule]
    compressed: bool = True
    undigested: bool = False

    def save(self, path: str | os.PathLike[str], header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a header, whose values JSON knows, and the arrays by their names."""
        typed = {
            name: np.asarray(arrays[name], dtype=None if rule.dtype == "U" else rule.dtype, order="C")
            for name, rule in self.arrays.items()
        }
        full = {"schema": self.schema, "version": self.version, **header}
        text = json.dumps({**full, "digest": _digest(full, typed)}, ensure_ascii=False, allow_nan=False)
        write = np.savez_compressed if self.compressed else np.savez
        content = io.BytesIO()  # NumPy leaves an archive unclosed that the disk had no room for
        write(content, header=np.array(text), **typed)
        with whole_file(path) as temporary:
            temporary.write_bytes(content.getvalue())

    @contextmanager
    def reading(self, path: str | os.PathLike[str]) -> Iterator[tuple[dict[str, Any], dict[str, NDArray[Any]]]]:
        """Yield the header and the arrays; what a block trips over in them is the file's fault.

        Sizes are compared with the rules and with each other before any array is read.

        Raises
        ------
        SeipError
            The file is not there, damaged, something else, or of another version.
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
            raise SeipError(f"{path} is no {self.what}, or is damaged: {error}; {self.remedy}") from error
        except READ_ERRORS as error:
            raise SeipError(f"{path} is no {self.what}, or is damaged; {self.remedy}") from error
        if not known:
            raise SeipError(f"{path} is no {self.what} of this version; {self.remedy}")

    def _read_arrays(self, archive: zipfile.ZipFile, header: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
        members = {f"{name}.npy": name for name in self.arrays}
        names = archive.namelist()
        if sorted(names) != sorted([*members, "header.npy"]):
            raise ContentError("other arrays than these belong into it")
        self._check_claims({members[name]: _claim(archive, name) for name in members})
        arrays = {name: _array(archive, member) for member, name in members.items()}
        content = {name: value for name, value in header.items() if name != "digest"}
        if (header["version"] != _OLD_VERSION or "digest" in header) and header["digest"] != _digest(content, arrays):
            raise ContentError("its content is not what was written")
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


def _archive(file: BinaryIO) -> zipfile.ZipFile:
    """Open an archive that begins with the file, as NumPy asks for: others may have anything before it."""
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
    """What a member says of its array, and at which byte that begins."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    order: Literal["C", "F"]
    begin: int

    @property
    def size(self) -> int:
        """Bytes of the array."""
        return math.prod(self.shape) * self.dtype.itemsize


def _claim(archive: zipfile.ZipFile, member: str) -> _Claim:
    """Return what a member claims, once its size bears it out."""
    info = archive.getinfo(member)
    if info.flag_bits & 1 or info.compress_type not in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}:
        raise ContentError(f"{member} is packed as NumPy packs none")
    with archive.open(info) as stream:
        begin = _NPY.match(stream.read(256))
    if begin is None:
        raise ContentError(f"{member} is no array")
    shape = tuple(int(length) for length in begin[3].decode().split(",") if length.strip())
    claim = _Claim(np.dtype(begin[1].decode()), shape, "F" if begin[2] == b"True" else "C", begin.end())
    size = claim.begin + claim.size
    if size != info.file_size or size > _MAX_DEFLATE_RATIO * (info.compress_size + 1):
        raise ContentError(f"{member} claims {size:,} bytes and has none of them")
    return claim


def _array(archive: zipfile.ZipFile, member: str) -> NDArray[Any]:
    """Read an array. NumPy parses the claim as a source, which older Pythons cannot do in two threads at once."""
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
    raise ContentError(f"its header holds the number {name}")


READ_ERRORS = (
    *(OSError, EOFError, ArithmeticError, AttributeError, ValueError, LookupError, TypeError, RuntimeError),
    *(MemoryError, zipfile.BadZipFile, zlib.error),
)
"""What reading an npz, or taking from it what should be there, raises where the file is not what it should be."""
