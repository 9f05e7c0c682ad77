"""The visibility grid: candidates × targets.

V_ij = 1 if and only if a return of candidate i's full scan lies nearer than δ to target j and has at least the minimum
intensity, if one is set.

The result equals that of full scans, but only rays that can affect it are cast (`scanning`).
"""

from __future__ import annotations

import os
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Boolean, Float, Integer
from ...base.errors import SeipError
from ...base.progress import Progress, each_in_threads
from ...site.candidates import Candidates
from ...site.site import Site
from ...storage.array_file import ArrayFile
from ...storage.files import digest
from ...storage.source_digest import source_digest
from ..lidar.catalogue import find_models
from ..lidar.model import LidarModel
from .ray_casting import engine_name, make_ray_caster
from .settings import Engine, VisibilitySettings
from .visibility_model import VisibilityModel

FILE = ArrayFile(
    "seip.visibility",
    2,
    "visibility grid",
    "delete it and compute it again",
    {"packed": "u1"},
)
PART = ArrayFile(
    "seip.visibility-part",
    1,
    "part of a visibility grid",
    "delete it and compute the grid again",
    {"poses": "i8", "packed": "u1", "rays": "i8"},
    compressed=False,
)
KEPT = 2_000  # poses after which those that are finished are written


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
        Provenance, for information: delta, min_intensity, detection, engine, sensors, numbers of rays.
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
    if site.candidates.tilt.any():
        inputs.append(site.candidates.tilt)
    return digest(*inputs)


def seen_from(
    model: VisibilityModel, candidates: Candidates, models: Mapping[str, LidarModel], pose: int
) -> tuple[Boolean, int]:
    """Compute the targets that a candidate pose sees, and the number of rays; see `VisibilityModel.scan`."""
    kind, xyz = models[str(candidates.sensor[pose])], candidates.xyz[pose]
    if candidates.tilt[pose] == 0:
        return model.scan_upright(kind, xyz, float(candidates.yaw[pose]))
    return model.scan(kind, xyz, candidates.orientation(pose))


def compute_visibility(
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    engine: Engine = "auto",
    threads: int | None = None,
    part: Path | None = None,
) -> Generator[Progress, None, VisibilityGrid]:
    """Compute the targets that each candidate pose sees, casting only rays that can affect the grid.

    Parameters
    ----------
    models : mapping of str to LidarModel
        Sensor types by catalogue key, those of all candidates included.
    engine : {"auto", "bvh", "embree"}
        Ray-casting engine.
    threads : int, optional
        Maximum number of threads; by default the number that the ray caster can use.
    part : path, optional
        File with the finished rows of an earlier computation that was ended; those of this one are kept there.

    Yields
    ------
    Progress
        Progress after each pose.

    Returns
    -------
    VisibilityGrid
        Identical to that of full scans, which cast every ray.

    Raises
    ------
    SeipError
        A sensor is unknown, there are no poses or targets, a coordinate is not finite, or the engine is not available.
    """
    used = _used_models(site, models)
    _check_site(site)
    name, candidates = engine_name(engine), site.candidates
    caster = make_ray_caster(site.triangles, name)
    model = VisibilityModel(site.targets.xyz, site.reflectivity, settings, caster)
    packed = np.zeros((len(candidates), (len(site.targets) + 7) // 8), dtype=np.uint8)
    rays = np.zeros(len(candidates), dtype=np.int64)

    key, shape = visibility_key(site, used, settings, name), (len(candidates), len(site.targets))
    left = np.arange(len(candidates)) if part is None else _restored(part, key, packed, rays)
    finished = np.ones(len(candidates), dtype=bool)
    finished[left] = False

    def compute(pose: int) -> None:
        seen, rays[pose] = seen_from(model, candidates, used, pose)
        packed[pose] = np.packbits(seen)
        finished[pose] = True

    steps = each_in_threads(compute, left.tolist(), min(caster.threads, threads or caster.threads), "visibility")
    yield from steps if part is None else _kept(steps, part, key, finished, packed, rays)
    origin = {"engine": name, "sensors": list(used), "rays_of_full_scan": _rays_of_full_scan(site, used)}
    parameters = {**asdict(settings), **origin, "rays_cast": int(rays.sum())}
    return VisibilityGrid(packed, shape, key, parameters)


def _restored(part: Path, key: str, packed: NDArray[np.uint8], rays: Integer) -> Integer:
    """Fill in finished rows (c, ceil(t / 8)) and their numbers of rays (c,); return the poses of the others."""
    left = np.arange(len(packed))
    try:
        with PART.reading(part) as (header, arrays):
            poses = arrays["poses"]
            if header["key"] != key or arrays["packed"].shape != (len(poses), packed.shape[1]):
                return left
            packed[poses], rays[poses] = arrays["packed"], arrays["rays"]
    except SeipError:  # there is none
        return left
    return np.setdiff1d(left, poses)


def _kept(
    steps: Generator[Progress, None, None],
    part: Path,
    key: str,
    finished: Boolean,
    packed: NDArray[np.uint8],
    rays: Integer,
) -> Generator[Progress, None, None]:
    """Take the steps of a computation, and write what is finished from time to time and where it is ended."""
    written = np.count_nonzero(finished)

    def save() -> int:
        poses = np.flatnonzero(finished)
        PART.save(part, {"key": key}, {"poses": poses, "packed": packed[poses], "rays": rays[poses]})
        return len(poses)

    with closing(steps):
        try:
            for step in steps:
                yield step
                if np.count_nonzero(finished) >= written + KEPT:
                    written = save()
        finally:
            if not finished.all() and np.count_nonzero(finished) > written:
                save()


def stored_visibility(
    path: Path,
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    engine: Engine = "auto",
    threads: int | None = None,
) -> Generator[Progress, None, VisibilityGrid]:
    """Return the grid of a file if it was computed from the same inputs; otherwise compute it and write the file.

    A computation that is ended leaves its finished rows next to the file, from which the next one goes on.
    """
    stored = read_visibility(path, site, models, settings, engine)
    if stored is not None:
        yield Progress(len(site.candidates), len(site.candidates), "visibility, from an earlier run")
        return stored
    part = path.with_name(f"{path.stem}.part.npz")
    grid = yield from compute_visibility(site, models, settings, engine, threads, part)
    grid.save(path)
    part.unlink(missing_ok=True)
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
