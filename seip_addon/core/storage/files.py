"""Atomic file writes, folder locks and digests."""

import errno
import functools
import hashlib
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SeipError

_UMASK = os.umask(0)  # once: to read it is to change it, for all threads
os.umask(_UMASK)


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary name beside ``path`` that becomes ``path`` once all is written.

    The temporary name keeps the suffix of ``path``, so that libraries which choose a format by suffix do the same for
    both. Nothing is left behind when the block raises, `KeyboardInterrupt` included; what a killed process left in the
    folder is removed.

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
        _remove_leftovers(target.parent.resolve())
        prefix = f"{_PREFIX}{os.getpid()}-"
        handle, name = tempfile.mkstemp(prefix=prefix, suffix=target.suffix, dir=target.parent)
    except OSError as error:
        raise _unwritable(target, error) from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o666 & ~_UMASK)
        temporary.replace(target)
    except OSError as error:
        raise _unwritable(target, error) from error
    finally:
        temporary.unlink(missing_ok=True)


def check_folder(folder: Path) -> None:
    """Make a folder for results, and raise SeipError where it cannot be written.

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


def lock_folder(folder: Path) -> int:
    """Lock a folder against other processes until this one ends, however it ends.

    Parameters
    ----------
    folder : path
        It is there.

    Returns
    -------
    int
        What holds the lock: a file descriptor, whose closing opens it.

    Raises
    ------
    SeipError
        Another process holds the lock.
    """
    windows = sys.platform == "win32"  # which opens no folders as files
    handle = os.open(folder / ".seip-lock", os.O_RDWR | os.O_CREAT) if windows else os.open(folder, os.O_RDONLY)
    try:
        _lock(handle)
    except OSError as error:
        if error.errno not in _LOCK_ERRORS:  # a file system without locks
            return handle
        os.close(handle)
        raise SeipError(
            f"another run is writing to {folder}: wait until it has ended, or choose another folder"
        ) from error
    return handle


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


_PREFIX = ".seip-"  # how the names of unfinished files begin; the number of the process that writes them follows
_STALE_SECONDS = 86400.0  # seconds after which an unfinished file counts as abandoned where processes cannot be queried

_LOCK_ERRORS = {errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK}

if sys.platform == "win32":
    import msvcrt

    def _lock(file: int) -> None:
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(file: int) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


@functools.cache
def _remove_leftovers(folder: Path) -> None:
    """Remove unfinished files of processes that were killed, once in a process."""
    with os.scandir(folder) as entries:
        for entry in entries:
            number, dash, _ = entry.name.removeprefix(_PREFIX).partition("-")
            if entry.name.startswith(_PREFIX) and dash and number.isdecimal() and _is_nobodys(entry, int(number)):
                Path(entry).unlink(missing_ok=True)


def _is_nobodys(entry: os.DirEntry[str], process: int) -> bool:
    if sys.platform == "win32":  # asking for a process there means stopping it
        return time.time() - entry.stat().st_mtime > _STALE_SECONDS
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return True
    except PermissionError:  # somebody else's, alive
        return False
    return False


_SPACE_ERRORS = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


def _unwritable(path: Path, error: OSError) -> SeipError:
    reason = error.strerror or str(error)
    cure = "make room there" if error.errno in _SPACE_ERRORS else "choose a folder that you may write to"
    return SeipError(f"cannot write {path}: {reason}; {cure}")
