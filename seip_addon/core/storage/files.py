"""Atomic file writes, folder locks and digests."""

import errno
import functools
import hashlib
import json
import os
import secrets
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SeipError

_UMASK = os.umask(0)  # once: to read it is to change it, for all threads
os.umask(_UMASK)


@contextmanager
def locked_file(path: Path) -> Iterator[None]:
    """Lock a file that is to be written against other processes while the block runs.

    The lock is a file of its own next to ``path``, which is gone afterwards: ``path`` itself may not be there yet, and
    is replaced as a whole. What a killed process leaves of it locks nothing.

    Raises
    ------
    SeipError
        Another process holds the lock, or the folder cannot be written.
    """
    lock = path.parent / f".{path.name}.lock"
    with _writing(path):
        made = _make_folder(path.parent)
        handle = _locked(lock)
    if handle is None:
        raise SeipError(f"another run is writing {path}: wait until it has ended, or choose another name")
    try:
        yield
    finally:
        if sys.platform == "win32":  # which deletes no file that is open
            os.close(handle)
            lock.unlink(missing_ok=True)
        else:
            lock.unlink(missing_ok=True)
            os.close(handle)
        remove_empty(made)


def _locked(lock: Path) -> int | None:
    """Return an open file that is locked and still has its name, None where another process holds it."""
    while True:
        handle = os.open(lock, os.O_RDWR | os.O_CREAT)
        try:
            _lock(handle)
        except OSError as error:
            if error.errno in _LOCK_ERRORS:
                os.close(handle)
                return None
        try:
            if os.fstat(handle).st_ino == lock.stat().st_ino:
                return handle
        except FileNotFoundError:
            pass  # its last holder has removed it in the meantime
        os.close(handle)


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary name beside ``path`` that becomes ``path`` once all is written.

    The temporary name keeps the suffix of ``path``, so that libraries which choose a format by suffix do the same for
    both. Nothing is left behind when the block raises, `KeyboardInterrupt` included, no empty folder either; what a
    killed process left in the folder is removed.

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
    with _writing(target):
        made = _make_folder(target.parent)
        _remove_leftovers(target.parent.resolve())
        handle, name = tempfile.mkstemp(prefix=_own_prefix(), suffix=target.suffix, dir=target.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        with _writing(target):
            yield temporary
            temporary.chmod(0o666 & ~_UMASK)
            temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
        remove_empty(made)


def unfinished_name(folder: Path, name: str) -> Path:
    """Return a name in a folder for an unfinished file or folder, which a later run removes if this process is killed.

    Parameters
    ----------
    name : str
        With which it ends, so that libraries which choose a format by suffix choose the same.

    Raises
    ------
    SeipError
        The folder cannot be made or read.
    """
    with _writing(folder / name):
        folder.mkdir(parents=True, exist_ok=True)
        _remove_leftovers(folder.resolve())
    return folder / f"{_own_prefix()}{name}"


def check_folder(folder: Path) -> tuple[Path, ...]:
    """Make a folder for results, and raise SeipError where it cannot be written.

    Returns
    -------
    tuple of path
        The folders that were made: for `remove_empty`, should nothing be written to them.

    Raises
    ------
    SeipError
        The folder cannot be made or written.
    """
    made: tuple[Path, ...] = ()
    try:
        made = _make_folder(folder)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        remove_empty(made)
        reason = error.strerror or str(error)
        raise SeipError(f"cannot write to {folder}: {reason}; choose a folder that you may write to") from error
    return made


def remove_empty(folders: Iterable[Path]) -> None:
    """Remove the folders that are empty, the innermost first; those that hold something are kept."""
    for folder in sorted(folders, key=lambda one: -len(one.parts)):
        with suppress(OSError):  # it holds something, or is gone
            folder.rmdir()


def _make_folder(folder: Path) -> tuple[Path, ...]:
    """Make a folder and its parents; return those that were missing."""
    missing = tuple(one for one in (folder, *folder.parents) if not one.exists())
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        remove_empty(missing)
        raise
    return missing


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
    handle = os.open(folder / _LOCK_NAME, os.O_RDWR | os.O_CREAT) if windows else os.open(folder, os.O_RDONLY)
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


def unlock_folder(folder: Path, lock: int) -> None:
    """End the lock that `lock_folder` returned."""
    os.close(lock)
    if sys.platform == "win32":
        with suppress(OSError):  # another process has it by now
            (folder / _LOCK_NAME).unlink()


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
_MARK = secrets.token_hex(4)  # of this process: in a container another one may have had the same number before
_STALE_SECONDS = 86400.0  # seconds after which an unfinished file counts as abandoned where processes cannot be queried

_LOCK_NAME = ".seip-lock"  # in a folder, where folders cannot be opened as files
_LOCK_ERRORS = {errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK}

if sys.platform == "win32":
    import msvcrt

    def _lock(file: int) -> None:
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(file: int) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _own_prefix() -> str:
    return f"{_PREFIX}{os.getpid()}-{_MARK}-"


@functools.cache
def _remove_leftovers(folder: Path) -> None:
    """Remove unfinished files of processes that were killed, once in a process."""
    with os.scandir(folder) as entries:
        for entry in entries:
            number, dash, _ = entry.name.removeprefix(_PREFIX).partition("-")
            if entry.name.startswith(_PREFIX) and dash and number.isdecimal() and _is_nobodys(entry, int(number)):
                if entry.is_dir(follow_symlinks=False):
                    shutil.rmtree(entry, ignore_errors=True)
                else:
                    Path(entry).unlink(missing_ok=True)


def _is_nobodys(entry: os.DirEntry[str], process: int) -> bool:
    if process == os.getpid():
        return not entry.name.startswith(_own_prefix())
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


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Report an error of the operating system in the block as one of writing a file."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        cure = "make room there" if error.errno in _SPACE_ERRORS else "choose a folder that you may write to"
        raise SeipError(f"cannot write {path}: {reason}; {cure}") from error
