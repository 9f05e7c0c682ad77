"""Folder of stored visibility grids, named by their keys."""

from __future__ import annotations

import functools
import re
from pathlib import Path

from ...base.errors import SeipError

_GRID = re.compile(r"[0-9a-f]{32}\.(npz|returns\.npz)")


class GridFolder:
    """A folder of grids, named by their keys; other files in it are left alone."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def megabytes(self) -> float:
        """Return the size of all grids; it is cached while the folder does not change, for panels that draw often."""
        try:
            return _megabytes(self._path, self._path.stat().st_mtime_ns)
        except OSError:  # there is no such folder
            return 0.0

    def empty(self) -> int:
        """Delete all grids, and return their number.

        Raises
        ------
        SeipError
            A file cannot be deleted.
        """
        entries = _grids(self._path)
        for entry in entries:
            try:
                entry.unlink()
            except OSError as error:
                raise SeipError(f"cannot delete {entry}: {error.strerror}; delete it by hand") from error
        return len(entries)


def _grids(folder: Path) -> list[Path]:
    return sorted(entry for entry in folder.iterdir() if _GRID.fullmatch(entry.name)) if folder.is_dir() else []


@functools.lru_cache(maxsize=4)
def _megabytes(folder: Path, _changed: int) -> float:
    return sum(file.stat().st_size for file in _grids(folder)) / 1e6
