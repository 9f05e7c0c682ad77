"""Files that are whole or absent, and digests of what went into them."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import SeipError


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary name beside ``path`` that becomes ``path`` once all is written.

    The temporary name keeps the suffix of ``path``, so that libraries which
    choose a format by suffix do the same for both. Nothing is left behind when
    the block raises, `KeyboardInterrupt` included.

    Parameters
    ----------
    path : path-like
        The file to write. Its folder is made when it is missing.

    Raises
    ------
    SeipError
        The folder or the file cannot be written.
    """
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=".", suffix=target.suffix, dir=target.parent)
    except OSError as error:
        raise _unwritable(target, error) from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(target)
    except OSError as error:
        raise _unwritable(target, error) from error
    finally:
        temporary.unlink(missing_ok=True)


def check_folder(folder: Path) -> None:
    """Make a folder for results and see that it can be written, before the work rather than after.

    Raises
    ------
    SeipError
        The folder cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        raise SeipError(f"cannot write to {folder}: {reason}; choose a folder that you may write to") from error


def save_json(path: str | os.PathLike[str], value: object) -> None:
    """Write a value as JSON for people and programs: indented, UTF-8, and without NaN or infinity.

    Raises
    ------
    ValueError
        The value holds a number that is not finite: JSON has no sign for it.
    SeipError
        The folder or the file cannot be written.
    """
    text = json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False)
    with whole_file(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


@dataclass(frozen=True)
class ArrayFile:
    """A kind of file that holds named arrays and a header: npz, with JSON as the text ``header``.

    Parameters
    ----------
    schema : str
        What the files are, for programs.
    version : int
        Of their layout; files of another version are refused.
    what : str
        What a file holds, for messages: "visibility grid".
    remedy : str
        How to get a new one, for messages: "delete it and compute it again".
    compressed : bool
        Not worth its time for arrays of measurements, whose noise does not compress.
    """

    schema: str
    version: int
    what: str
    remedy: str
    compressed: bool = True

    def save(self, path: str | os.PathLike[str], header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a header, whose values JSON knows, and arrays by their names."""
        full = {"schema": self.schema, "version": self.version, **header}
        text = json.dumps(full, ensure_ascii=False, allow_nan=False)
        write = np.savez_compressed if self.compressed else np.savez
        with whole_file(path) as temporary, temporary.open("wb") as file:
            write(file, header=np.array(text), **dict(arrays))

    @contextmanager
    def reading(self, path: str | os.PathLike[str]) -> Iterator[tuple[dict[str, Any], dict[str, NDArray[Any]]]]:
        """Yield the header and the arrays; what a block trips over in them is the file's fault.

        Raises
        ------
        SeipError
            The file is not there, damaged, something else, or of another version.
        """
        try:
            with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
            header = json.loads(str(arrays.pop("header")))
            known = (header["schema"], header["version"]) == (self.schema, self.version)
            if known:
                yield header, arrays
        except FileNotFoundError as error:
            raise SeipError(f"there is no {self.what} {path}; {self.remedy}") from error
        except _DAMAGE as error:
            raise SeipError(f"{path} is no {self.what}, or is damaged; {self.remedy}") from error
        if not known:
            raise SeipError(f"{path} is no {self.what} of this version; {self.remedy}")


_DAMAGE = (
    OSError,
    EOFError,
    AttributeError,
    ValueError,
    LookupError,
    TypeError,
    RecursionError,
    zipfile.BadZipFile,
    zlib.error,
)
"""What reading an npz, or taking from it what should be there, raises where the file is not what it should be."""


def digest(*parts: NDArray[Any] | str | bytes | float | None) -> str:
    """Return the SHA-256 of values, with the shape and type of each array among them.

    Parameters
    ----------
    *parts : ndarray, str, bytes, float, int or None
        What the digest stands for, in order.

    Returns
    -------
    str
        64 hexadecimal digits, the same on every platform.
    """
    state = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            array = np.ascontiguousarray(part)
            little = array.astype(array.dtype.newbyteorder("<"), copy=False)
            state.update(f"array{array.shape}{little.dtype.str};".encode())
            state.update(little.tobytes())
        else:
            raw = part if isinstance(part, bytes) else repr(part).encode()
            state.update(f"{type(part).__name__}{len(raw)};".encode())
            state.update(raw)
    return state.hexdigest()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _unwritable(path: Path, error: OSError) -> SeipError:
    reason = error.strerror or str(error)
    cure = "make room there" if error.errno == errno.ENOSPC else "choose a folder that you may write to"
    return SeipError(f"cannot write {path}: {reason}; {cure}")
