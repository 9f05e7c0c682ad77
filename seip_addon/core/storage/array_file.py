"""Files of named arrays: the program's own, with a header, and npz files of other programs."""

from __future__ import annotations

import io
import json
import os
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.errors import SeipError
from .files import whole_file

READ_ERRORS = (
    *(OSError, EOFError, ArithmeticError, AttributeError, ValueError, LookupError, TypeError, RuntimeError),
    *(MemoryError, zipfile.BadZipFile, zlib.error),
)
"""Exceptions raised by reading a damaged file, or by using its contents."""


@dataclass(frozen=True)
class ArrayFile:
    """A format of the program's own for files of named arrays: npz, with a header in JSON as the text ``header``.

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
    arrays : mapping of str to str
        NumPy type of each array, by name; ``U`` is text of any length.
    compressed : bool
        Whether arrays are deflated; noisy measurements hardly compress.

    Examples
    --------
    >>> profile = ArrayFile("example.heights", 1, "profile of heights", "measure it again", {"heights": "f8"})
    >>> profile.save("heights.npz", {"spacing": 4.0}, {"heights": np.array([0.0, 3.5, 8.0])})
    >>> with profile.reading("heights.npz") as (header, arrays):
    ...     print(header["spacing"], arrays["heights"].tolist())
    4.0 [0.0, 3.5, 8.0]
    """

    schema: str
    version: int
    what: str
    remedy: str
    arrays: Mapping[str, str]
    compressed: bool = True

    def save(self, path: str | os.PathLike[str], header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a header with values that JSON supports, and the arrays by name."""
        typed = {
            name: np.asarray(arrays[name], dtype=None if kind == "U" else kind, order="C")
            for name, kind in self.arrays.items()
        }
        text = json.dumps(
            {"schema": self.schema, "version": self.version, **header}, ensure_ascii=False, allow_nan=False
        )
        write = np.savez_compressed if self.compressed else np.savez
        content = io.BytesIO()  # written to memory first: NumPy leaves an archive open if the disk is full
        write(content, header=np.array(text), **typed)
        with whole_file(path) as temporary:
            temporary.write_bytes(content.getvalue())

    @contextmanager
    def reading(self, path: str | os.PathLike[str]) -> Iterator[tuple[dict[str, Any], dict[str, NDArray[Any]]]]:
        """Yield the header and the arrays; errors raised in the block are reported as a file that does not fit.

        Raises
        ------
        SeipError
            The file does not exist, cannot be read, or has a different format, version or type of array.
        """
        try:
            with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as content:
                header = json.loads(str(content["header"]))
                known = (header["schema"], header["version"]) == (self.schema, self.version)
                if known:
                    yield header, {name: _typed(content[name], kind) for name, kind in self.arrays.items()}
        except FileNotFoundError as error:
            raise SeipError(f"there is no {self.what} {path}; {self.remedy}") from error
        except READ_ERRORS as error:
            raise SeipError(f"{path} is damaged or not a {self.what}; {self.remedy}") from error
        if not known:
            raise SeipError(f"{path} is not a {self.what} of this version; {self.remedy}")


def _typed(array: NDArray[Any], kind: str) -> NDArray[Any]:
    if array.dtype.kind != "U" if kind == "U" else array.dtype != np.dtype(kind):
        raise TypeError(f"an array of {array.dtype} in place of {kind}")
    return array


def read_npz(path: Path, most: int) -> dict[str, NDArray[Any]]:
    """Return all arrays of an npz file of another program, by name.

    The sizes of its members are compared with the limit before any is read; NumPy reads no more of one than there is.

    Raises
    ------
    SeipError
        The file does not exist, is damaged, or holds more than ``most`` bytes of arrays.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as content:
            if sum(member.file_size for member in content.zip.infolist()) > most:
                raise ValueError(f"it holds more than {most / 1e6:,.0f} MB")
            return {name: content[name] for name in content.files}
    except FileNotFoundError as error:
        raise SeipError(f"no such file: {path}; check its path") from error
    except READ_ERRORS as error:
        reason = f" ({error})" if isinstance(error, ValueError) else ""
        raise SeipError(f"{path.name} is damaged or not an npz file{reason[:200]}; write it again") from error
