"""Returns grid: expected returns of each candidate pose from each road user."""

from __future__ import annotations

import os
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...base.errors import SeipError
from ...base.progress import Progress, each_in_threads
from ...site.site import Site
from ...storage.array_file import ArrayFile
from ...storage.files import digest
from ...storage.source_digest import source_digest
from ..lidar.catalogue import find_models
from ..lidar.model import LidarModel
from ..visibility.ray_casting import engine_name, make_ray_caster
from ..visibility.settings import Engine
from .expected_returns import expected_returns
from .road_users import RoadUsers

FILE = ArrayFile(
    "seip.returns",
    1,
    "returns grid",
    "delete it and compute it again",
    {"returns": "f4"},
)


@dataclass(frozen=True, eq=False)
class ReturnsGrid:
    """Expected returns of c candidate poses from m road users.

    Parameters
    ----------
    returns : (c, m) float32
        R: expected number of returns in one revolution or frame.
    key : str
        Digest of all inputs; see `returns_key`.
    """

    returns: NDArray[np.float32]
    key: str

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the grid as npz: the array ``returns`` and the text ``header`` (JSON)."""
        FILE.save(path, {"key": self.key}, {"returns": self.returns})

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> ReturnsGrid:
        """Read a grid that `save` wrote.

        Raises
        ------
        SeipError
            The file is missing, damaged or not a returns grid.
        """
        with FILE.reading(path) as (header, arrays):
            return cls(arrays["returns"], str(header["key"]))


def returns_key(site: Site, users: RoadUsers, models: Mapping[str, LidarModel], engine: str) -> str:
    """Return the digest of all inputs of a returns grid, the source code included.

    Parameters
    ----------
    engine : {"bvh", "embree"}
        Ray-casting engine.
    """
    candidates = site.candidates
    used = find_models(models, np.unique(candidates.sensor).tolist())
    inputs: list[NDArray[np.generic] | str | float] = [FILE.schema, source_digest(), engine]
    inputs += [site.triangles, users.xyz, users.body, candidates.xyz, candidates.yaw, candidates.tilt]
    inputs.append(np.array([list(used).index(key) for key in candidates.sensor], dtype=np.int64))
    for model in used.values():
        inputs += [model.beams_key, repr(model.law), float(model.min_range), float(model.max_range)]
    return digest(*inputs)


def compute_returns(
    site: Site,
    users: RoadUsers,
    models: Mapping[str, LidarModel],
    engine: Engine = "auto",
    threads: int | None = None,
) -> Generator[Progress, None, ReturnsGrid]:
    """Compute the expected returns of all candidate poses of a site from road users.

    Parameters
    ----------
    models : mapping of str to LidarModel
        Sensor types by catalogue key, those of all candidates included.
    engine : {"auto", "bvh", "embree"}
        Ray-casting engine.
    threads : int, optional
        Maximum number of threads.

    Returns
    -------
    ReturnsGrid
        Grid with the same bits for any number of threads.

    Raises
    ------
    SeipError
        A sensor type is unknown, or the engine is not available.
    """
    name = engine_name(engine)
    caster = make_ray_caster(site.triangles, name)
    candidates = site.candidates
    used = find_models(models, np.unique(candidates.sensor).tolist())
    returns = np.zeros((len(candidates), len(users)), dtype=np.float32)

    def compute(pose: int) -> None:
        model, origin = used[str(candidates.sensor[pose])], candidates.xyz[pose]
        returns[pose] = expected_returns(caster, origin, candidates.orientation(pose), model, users)[0]

    at_once = min(caster.threads, threads or caster.threads)
    yield from each_in_threads(compute, range(len(candidates)), at_once, "returns from road users")
    return ReturnsGrid(returns, returns_key(site, users, used, name))


def stored_returns(
    path: Path | None,
    site: Site,
    users: RoadUsers,
    models: Mapping[str, LidarModel],
    engine: Engine = "auto",
    threads: int | None = None,
) -> Generator[Progress, None, ReturnsGrid]:
    """Return the grid of a file if it was computed from the same inputs; otherwise compute it and write the file.

    Parameters
    ----------
    path : path, optional
        File of the grid, read and written.
    """
    if path is None:
        return (yield from compute_returns(site, users, models, engine, threads))
    key = returns_key(site, users, models, engine_name(engine))
    try:
        stored = ReturnsGrid.load(path)
    except SeipError:
        stored = None
    if stored is not None and stored.key == key and stored.returns.shape == (len(site.candidates), len(users)):
        yield Progress(len(site.candidates), len(site.candidates), "returns, from an earlier run")
        return stored
    grid = yield from compute_returns(site, users, models, engine, threads)
    grid.save(path)
    return grid
