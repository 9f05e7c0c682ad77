"""On-disk cache of visibility grids, keyed by their inputs."""

from __future__ import annotations

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
