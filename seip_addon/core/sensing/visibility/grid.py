"""The visibility grid: candidates × targets.

V_ij = 1 if and only if a return of candidate i's full scan lies nearer than δ to target j and has at least the minimum
intensity, if one is set.

The result equals that of full scans, but only rays that can affect it are cast (`scanning`), against triangles that can
affect it (`needed_triangles`).
"""

from __future__ import annotations

import os
from collections.abc import Generator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Boolean, Float, Integer
from ...base.errors import SeipError
from ...base.progress import Progress
from ...site.site import Site
from ...storage.array_file import ArrayFile
from ...storage.files import digest
from ...storage.source_digest import source_digest
from ..lidar.catalogue import find_models
from ..lidar.model import LidarModel
from .chunks import Checkpoint, chunks_of, compute_chunks
from .executors import VisibilityTask, dask_executor, thread_executor
from .ray_casting import engine_name
from .settings import Engine, VisibilitySettings
from .triangle_culling import needed_triangles

FILE = ArrayFile(
    "seip.visibility",
    2,
    "visibility grid",
    "delete it and compute it again",
    {"packed": "u1"},
)


@dataclass(frozen=True, eq=False)
class VisibilityGrid:
    """Visibility of t targets from c candidate poses.

    Parameters
    ----------
    packed : (c, ceil(t / 8)) uint8
        Bits of V, one row per pose, in the order of `numpy.packbits`.
    shape : tuple of int
        Numbers of poses and targets, c and t.
    key : str
        Digest of all inputs; see `visibility_key`.
    parameters : dict
        Provenance, for information: delta, min_intensity, detection, engine, sensors, numbers of rays and triangles.
    """

    packed: NDArray[np.uint8]
    shape: tuple[int, int]
    key: str
    parameters: dict[str, Any]

    @property
    def visible(self) -> Boolean:
        """V as (c, t) bool."""
        return np.unpackbits(self.packed, axis=1, count=self.shape[1]).astype(bool)

    def rows(self, poses: Integer | Sequence[int]) -> Boolean:
        """Return the rows of V for some poses, (n, t) bool, without unpacking the others."""
        packed = self.packed[np.asarray(poses, dtype=np.int64)]
        return np.unpackbits(packed, axis=1, count=self.shape[1]).astype(bool)

    def sees(self, pose: int) -> Boolean:
        """Return the targets that a pose sees, (t,) bool."""
        return np.unpackbits(self.packed[pose], count=self.shape[1]).astype(bool)

    def times_seen(self, poses: Integer) -> Integer:
        """Return the number of the given poses that see each target, (t,) int64."""
        times: Integer = self.rows(poses).sum(axis=0, dtype=np.int64)
        return times

    def coverage(self, poses: Integer, weight: Float | None = None) -> float:
        """Return the share of targets that at least one of the given poses sees, 0 to 1.

        Parameters
        ----------
        poses : (n,) int64
            Indices of the poses.
        weight : (t,) float64, optional
            Weights of the targets; equal by default.
        """
        seen = self.times_seen(poses) > 0
        return float(np.average(seen, weights=weight))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the grid as npz: the array ``packed`` and the text ``header`` (JSON)."""
        header = {"key": self.key, "shape": list(self.shape), "parameters": self.parameters}
        FILE.save(path, header, {"packed": self.packed})

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> VisibilityGrid:
        """Read a grid that `save` wrote.

        Raises
        ------
        SeipError
            The file is missing, damaged or not a visibility grid.
        """
        with FILE.reading(path) as (header, arrays):
            shape = (int(header["shape"][0]), int(header["shape"][1]))
            return cls(arrays["packed"], shape, str(header["key"]), dict(header["parameters"]))


def visibility_key(site: Site, models: Mapping[str, LidarModel], settings: VisibilitySettings, engine: str) -> str:
    """Return the digest of all inputs of a grid, including the source code but not names.

    A stored grid with this key can be used again. ``engine`` is ``bvh`` or ``embree``.
    """
    used = _used_models(site, models)
    model_index = np.array([list(used).index(key) for key in site.candidates.sensor], dtype=np.int64)
    inputs: list[NDArray[Any] | str | float] = [FILE.schema, source_digest(), engine]
    strengths = {model.key: settings.least_strength(model) for model in used.values()}
    inputs.append(float(settings.delta))
    inputs += [str((least, repr(used[key].law) if least > 0 else "")) for key, least in strengths.items()]
    if any(strengths.values()):
        inputs.append(site.reflectivity)
    inputs += [site.triangles, site.targets.xyz, site.candidates.xyz, site.candidates.yaw, model_index]
    for model in used.values():
        inputs += [model.elevations, model.azimuth_offsets, float(model.azimuth_count)]
        inputs += [float(model.min_range), float(model.max_range)]
        inputs += [] if model.all_round else [f"field of view {model.field_of_view!r}"]
        inputs += [] if model.rosette is None else ["rosette"]
    if site.candidates.tilt.any():
        inputs.append(site.candidates.tilt)
    return digest(*inputs)


def compute_visibility(  # noqa: PLR0913, PLR0917  # the inputs, and how to compute
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    engine: Engine = "auto",
    checkpoint: Checkpoint | None = None,
    scheduler: str | None = None,
    threads: int | None = None,
) -> Generator[Progress, None, VisibilityGrid]:
    """Compute the targets that each candidate pose sees, casting only rays that can affect the grid.

    Parameters
    ----------
    models : mapping of str to LidarModel
        Sensor types by catalogue key, those of all candidates included.
    engine : {"auto", "bvh", "embree"}
        Ray-casting engine.
    checkpoint : Checkpoint, optional
        Finished chunks of an interrupted run with the same key; chunks of this run are added.
    scheduler : str, optional
        Address of a Dask scheduler whose workers compute the chunks; by default this process does.
    threads : int, optional
        Maximum number of threads in this process.

    Yields
    ------
    Progress
        Progress ten times a second, and after each chunk.

    Returns
    -------
    VisibilityGrid
        Identical to that of full scans, which cast every ray, wherever it is computed.

    Raises
    ------
    SeipError
        A sensor is unknown, there are no poses or targets, a coordinate is not finite, or the engine or the scheduler
        is not available.
    """
    used = _used_models(site, models)
    _check_site(site)
    longest = max(model.max_range for model in used.values())
    needed = needed_triangles(site.triangles, site.candidates.xyz, site.targets.xyz, settings.delta, longest)
    task = VisibilityTask(site, used, settings, engine_name(engine), needed.keep)
    chunks = chunks_of(site)
    with thread_executor(task, threads) if scheduler is None else dask_executor(task, scheduler) as submit:
        rows = yield from compute_chunks(chunks, submit, checkpoint)
    packed = np.zeros((len(site.candidates), (len(site.targets) + 7) // 8), dtype=np.uint8)
    packed[np.concatenate(chunks)] = np.concatenate([row.packed for row in rows])
    parameters = {"triangles": needed.counts, "rays_cast": sum(row.rays for row in rows)}
    origin = {"engine": task.engine, "sensors": list(used), "rays_of_full_scan": _rays_of_full_scan(site, used)}
    key = visibility_key(site, used, settings, task.engine)
    shape = len(site.candidates), len(site.targets)
    return VisibilityGrid(packed, shape, key, {**asdict(settings), **origin, **parameters})


def _rays_of_full_scan(site: Site, used: Mapping[str, LidarModel]) -> int:
    return sum(used[key].channels * used[key].azimuth_count for key in site.candidates.sensor.tolist())


def _used_models(site: Site, models: Mapping[str, LidarModel]) -> dict[str, LidarModel]:
    return find_models(models, np.unique(site.candidates.sensor).tolist())


def _check_site(site: Site) -> None:
    if len(site.candidates) == 0:
        raise SeipError("there is no candidate pose to compute visibility for: add poles or candidate areas")
    if len(site.targets) == 0:
        raise SeipError("there is no target to be seen: let the region of interest overlap the roads")
    arrays = {
        "target": site.targets.xyz,
        "candidate": site.candidates.xyz,
        "candidate's yaw": site.candidates.yaw,
        "candidate's tilt": site.candidates.tilt,
    }
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise SeipError(f"the coordinates of a {name} are not finite; check the scene's meshes")
