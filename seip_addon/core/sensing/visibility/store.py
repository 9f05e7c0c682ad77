"""On-disk cache of visibility grids, keyed by their inputs."""

from __future__ import annotations

import functools
import re
import shutil
from collections.abc import Generator, Mapping
from pathlib import Path

import numpy as np

from ...base.errors import SeipError
from ...base.progress import Progress
from ...site.site import Site
from ...storage.array_file import ArrayFile
from ..lidar.model import LidarModel
from .chunks import Rows
from .grid import VisibilityGrid, compute_visibility, visibility_key
from .ray_casting import engine_name
from .settings import Engine, VisibilitySettings

_CHUNK = ArrayFile(
    "seip.visibility-piece",
    1,
    "chunk of a visibility grid",
    "delete it and compute it again",
    {"packed": "u1", "rays": "i8"},
    compressed=False,
)
_GRID = re.compile(r"[0-9a-f]{32}\.(npz|pieces|returns\.npz)")


class CheckpointFolder:
    """Finished chunks of an incomplete grid, in a folder next to its file.

    Parameters
    ----------
    path : path
        File of the grid.
    key : str
        Key of the grid. Chunks with a different key are removed.
    """

    def __init__(self, path: Path, key: str) -> None:
        self._folder = path.with_name(f"{path.stem}.pieces")
        self._prefix = key[:16]
        for other in self._folder.glob("*.npz"):
            if not other.name.startswith(self._prefix):
                other.unlink(missing_ok=True)  # another process may remove it at the same time

    def load(self, number: int) -> Rows | None:
        """Return a chunk, or None if there is no usable one."""
        try:
            with _CHUNK.reading(self._file(number)) as (_, arrays):
                return Rows(arrays["packed"], int(arrays["rays"]))
        except SeipError:
            return None

    def save(self, number: int, rows: Rows) -> None:
        """Write a chunk."""
        _CHUNK.save(self._file(number), {}, {"packed": rows.packed, "rays": np.array(rows.rays)})

    def remove(self) -> None:
        """Remove the folder after the grid is complete."""
        shutil.rmtree(self._folder, ignore_errors=True)  # another process may remove it at the same time

    def _file(self, number: int) -> Path:
        return self._folder / f"{self._prefix}-{number:06d}.npz"


def stored_visibility(  # noqa: PLR0913, PLR0917  # the inputs of the grid, and how to compute it
    path: Path,
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    engine: Engine = "auto",
    scheduler: str | None = None,
    threads: int | None = None,
) -> Generator[Progress, None, VisibilityGrid]:
    """Return the grid of a file if it was computed from the same inputs; otherwise compute it and write the file.

    Chunks finished before an interruption are kept next to the file and not computed again.

    Parameters
    ----------
    path : path
        File of the grid, read and written.
    engine : {"auto", "bvh", "embree"}
        Ray-casting engine.
    scheduler : str, optional
        Address of a Dask scheduler whose workers compute the chunks; by default this process does.
    threads : int, optional
        Maximum number of threads in this process.

    Returns
    -------
    VisibilityGrid
        Grid for these inputs.
    """
    stored = read_visibility(path, site, models, settings, engine)
    checkpoint = CheckpointFolder(path, visibility_key(site, models, settings, engine_name(engine)))
    if stored is not None:
        checkpoint.remove()  # left by a process that was killed after it had written the grid
        yield Progress(len(site.candidates), len(site.candidates), "visibility, from an earlier run")
        return stored
    grid = yield from compute_visibility(site, models, settings, engine, checkpoint, scheduler, threads)
    grid.save(path)
    checkpoint.remove()
    return grid


def read_visibility(
    path: Path, site: Site, models: Mapping[str, LidarModel], settings: VisibilitySettings, engine: Engine = "auto"
) -> VisibilityGrid | None:
    """Return the grid of a file, or None if it is not one that was computed from the same inputs."""
    try:
        stored = VisibilityGrid.load(path)
    except SeipError:
        return None
    key, shape = visibility_key(site, models, settings, engine_name(engine)), (len(site.candidates), len(site.targets))
    return stored if stored.key == key and stored.shape == shape else None


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
        """Delete all grids and chunks of grids, and return their number.

        Raises
        ------
        SeipError
            A file or folder cannot be deleted.
        """
        entries = _grids(self._path)
        for entry in entries:
            try:
                shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
            except OSError as error:
                raise SeipError(f"cannot delete {entry}: {error.strerror}; delete it by hand") from error
        return len(entries)


def _grids(folder: Path) -> list[Path]:
    return sorted(entry for entry in folder.iterdir() if _GRID.fullmatch(entry.name)) if folder.is_dir() else []


@functools.lru_cache(maxsize=4)
def _megabytes(folder: Path, _changed: int) -> float:
    files = [file for entry in _grids(folder) for file in (entry.rglob("*") if entry.is_dir() else (entry,))]
    return sum(file.stat().st_size for file in files) / 1e6
