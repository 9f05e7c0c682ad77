"""Files that are whole or absent, and digests of what went into them."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
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
