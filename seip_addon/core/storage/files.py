"""Atomic file writes, folder locks and digests."""

import errno
import functools
import hashlib
import json
import os
import re
import secrets
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from ..base.errors import SeipError

_UMASK = os.umask(0)  # read once at import, because reading changes it for all threads
os.umask(_UMASK)
_PREFIX = ".seip-"  # start of the names of unfinished files, followed by the id of the process that writes them
_MARK = secrets.token_hex(4)  # mark of this process: in a container an earlier one may have had the same id
_STALE_SECONDS = 86400.0  # age of abandoned unfinished files on systems where processes cannot be queried
_LOCK_NAME = ".seip-lock"  # start of the names of lock files: of a file, or of a folder that cannot be opened as a file
_LOCK_ERRORS = {errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK}
_SPACE_ERRORS = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary file next to ``path`` that is renamed to ``path`` after the block.

    The temporary name keeps the suffix of ``path``, for libraries that choose a format by suffix. If the block raises,
    even `KeyboardInterrupt`, neither the file nor an empty folder is left. Temporary files of killed processes in the
    folder are removed.

    Parameters
    ----------
    path : path-like
        File to write. Its folder is created if it is missing.

    Raises
    ------
    SeipError
        The folder or the file cannot be written.
    """
    target = Path(path)
    with _writing(target):
        made = _make_folder(target.parent)
        _remove_leftovers(target.parent.resolve())
    temporary = target.parent / f"{_own_prefix()}{secrets.token_hex(4)}{target.suffix}"
    try:
        with _writing(target):
            temporary.touch(0o600, exist_ok=False)  # in here, so that a signal leaves no file
            yield temporary
            temporary.chmod(0o666 & ~_UMASK)
            temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
        remove_empty(made)


def unfinished_name(folder: Path, name: str) -> Path:
    """Return a name for an unfinished file or folder, which a later run removes if this process is killed.

    Parameters
    ----------
    folder : Path
        Folder for it.
    name : str
        End of the name, for libraries that choose a format by suffix.

    Raises
    ------
    SeipError
        The folder cannot be created or read.
    """
    with _writing(folder / name):
        folder.mkdir(parents=True, exist_ok=True)
        _remove_leftovers(folder.resolve())
    return folder / f"{_own_prefix()}{name}"


def check_folder(folder: Path) -> tuple[Path, ...]:
    """Create a folder for results and check that it can be written.

    Returns
    -------
    tuple of path
        Folders that were created, to pass to `remove_empty` if no file is written to them.

    Raises
    ------
    SeipError
        The folder cannot be created or written, or Blender cannot read its name.
    """
    if "\\" in str(folder.absolute()) and os.sep == "/":
        raise SeipError(f"{folder} has a backslash in its path, which Blender takes for a slash: choose another folder")
    with _writing(folder):
        made = _make_folder(folder)
        try:
            tempfile.TemporaryFile(dir=folder).close()
        except OSError:
            remove_empty(made)
            raise
    return made


def remove_empty(folders: Iterable[Path]) -> None:
    """Remove the folders that are empty, innermost first."""
    for folder in sorted(folders, key=lambda one: -len(one.parts)):
        with suppress(OSError):  # it is not empty, or does not exist
            folder.rmdir()


def _make_folder(folder: Path) -> tuple[Path, ...]:
    """Create a folder and its parents; return those that were missing."""
    missing = tuple(one for one in (folder, *folder.parents) if not one.exists())
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        remove_empty(missing)
        raise
    return missing


@contextmanager
def locked(path: Path, *, folder: bool) -> Iterator[None]:
    """Lock a folder, or a file, against other processes while the block runs, or until this process ends in any way.

    The folder, or that of the file, is created if it is missing, and removed if it stays empty.

    Raises
    ------
    SeipError
        Another process holds the lock, or the folder cannot be written.
    """
    made = check_folder(path if folder else path.parent)
    lock = path / _LOCK_NAME if folder else path.parent / f"{_LOCK_NAME}-{digest(path.name)[:16]}"
    opened = folder and sys.platform != "win32"  # Windows cannot open folders as files
    handle = os.open(path, os.O_RDONLY) if opened else os.open(lock, os.O_RDWR | os.O_CREAT)
    try:
        _lock(handle)
    except OSError as error:
        if error.errno in _LOCK_ERRORS:  # otherwise it is a file system without locks
            os.close(handle)
            raise SeipError(
                f"another run is writing to {path}: wait until it has ended, or choose another name"
            ) from error
    try:
        yield
    finally:
        os.close(handle)
        if not opened:
            with suppress(OSError):  # another process has it by now
                lock.unlink()
        remove_empty(made)


def natural_order(path: Path) -> list[tuple[int, str]]:
    """Return the key that sorts file names by the numbers in them: ``2.pcd`` before ``10.pcd``."""
    parts = [*re.split(r"([0-9]+)", path.stem), path.suffix]  # the suffix last: "run.npz" is before "run-1.npz"
    return [(int(part), "") if part.isdecimal() else (0, part) for part in parts]


def read_small(path: Path, most: int, cure: str) -> bytes:
    """Return the content of a file of a user that has one to ``most`` bytes.

    Raises
    ------
    SeipError
        The file cannot be read, is empty, or is larger; ``cure`` ends the message of the last two.
    """
    check_regular(path)
    try:
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            content = file.read(most + 1) if size <= most else b""
    except FileNotFoundError as error:
        raise SeipError(f"no such file: {path}; check its path") from error
    except OSError as error:
        raise SeipError(f"cannot read {path}: {error.strerror or error}; check that it is a readable file") from error
    if size > most or len(content) > most:
        raise SeipError(f"{path.name} has more than {most / 1e6:,.0f} MB; {cure}")
    if not content:
        raise SeipError(f"{path.name} is empty; {cure}")
    return content


def check_regular(path: Path) -> None:
    """Raise SeipError if a path is a device or the like, which may never end."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise SeipError(f"{path} is not a regular file: name a file")


def parse_json(text: str | bytes) -> Any:  # noqa: ANN401  # any JSON
    """Return the content of a JSON text; raise `ValueError` or `RecursionError` if it is damaged or has NaN."""

    def refuse(name: str) -> NoReturn:
        raise ValueError(f"it has the number {name}")

    try:
        return json.loads(text, parse_constant=refuse)
    except UnicodeDecodeError as error:
        raise ValueError("it is not in UTF-8") from error


def content_fault(error: Exception) -> str:
    """Return the reason for which the content of a file cannot be used, from what parsing or using it raised."""
    if isinstance(error, KeyError):
        return f"it has no {error}"
    return str(error)[:200] if isinstance(error, ValueError) else "its structure is another one"


def save_json(path: str | os.PathLike[str], value: object) -> None:
    """Write a value as JSON: indented, UTF-8, without NaN or infinity.

    Raises
    ------
    ValueError
        The value contains a number that is not finite, which JSON cannot represent.
    SeipError
        The folder or the file cannot be written.

    Examples
    --------
    >>> save_json("out/run.json", {"coverage": 0.89, "sensors": ["type1", "type3"]})
    >>> parse_json(Path("out/run.json").read_bytes())["coverage"]
    0.89
    >>> [path.name for path in Path("out").iterdir()]  # no unfinished file is left
    ['run.json']
    """
    text = json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False)
    with whole_file(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def digest(*parts: NDArray[Any] | str | bytes | float | None) -> str:
    """Return the SHA-256 of values, including the shape and type of arrays.

    Parameters
    ----------
    *parts : ndarray, str, bytes, float, int or None
        Values to digest, in order.

    Returns
    -------
    str
        64 hexadecimal digits, the same on every platform.
    """
    state = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            array = np.ascontiguousarray(part)
            # Fixed byte order, and a prefix with type and length: equal content gives equal digests on every platform,
            # and ("ab", "c") differs from ("a", "bc").
            little = array.astype(array.dtype.newbyteorder("<"), copy=False)
            state.update(f"array{array.shape}{little.dtype.str};".encode())
            state.update(little.tobytes())
        else:
            raw = part if isinstance(part, bytes) else repr(part).encode()
            state.update(f"{type(part).__name__}{len(raw)};".encode())
            state.update(raw)
    return state.hexdigest()


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
    """Remove unfinished files of killed processes; cached, so that each folder is searched once in a process."""
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
    if sys.platform == "win32":  # on Windows os.kill would stop the process instead of querying it
        return time.time() - entry.stat().st_mtime > _STALE_SECONDS
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return True
    except PermissionError:  # somebody else's, alive
        return False
    return False


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Convert an OSError in the block to a SeipError about writing a file."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        cure = "make room there" if error.errno in _SPACE_ERRORS else "choose a folder that you may write to"
        raise SeipError(f"cannot write to {path}: {reason}; {cure}") from error
