"""Which candidate pose sees which target.

V_ij = 1 if and only if some return of candidate i's full scan lies nearer than
δ to target j and, where a least intensity is asked for, is at least as strong.

The grid is exactly the full scan's, but only rays that can change it are cast:
those that pass within δ of a target (`beam_culling`), and of these first the one
per target that should end nearest to it; then, for targets still unseen, the rest.
"""

from __future__ import annotations

import json
import os
import zipfile
import zlib
from collections.abc import Callable, Generator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .beam_culling import near_rays
from .errors import SeipError
from .lidar import BeamPattern, LidarModel, find_models, return_intensity
from .progress import Progress
from .ray_casting import RayCaster
from .site import Site
from .storage import digest, whole_file
from .target_index import TargetIndex

Float = NDArray[np.float64]
Integer = NDArray[np.int64]
Boolean = NDArray[np.bool_]

SCHEMA = "seip.visibility"
SCHEMA_VERSION = 1

_RAYS_AT_ONCE = 1 << 17  # bounds the memory of a full scan


@dataclass(frozen=True)
class VisibilitySettings:
    """When a target counts as seen.

    Parameters
    ----------
    delta : float, metres
        A return nearer than this to a target sees it.
    min_intensity : float, 0 to 1
        Least intensity of such a return, for surfaces of reflectivity 1. At 0 every return counts.
    """

    delta: float = 1.0
    min_intensity: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.delta < np.inf:
            raise SeipError(f"delta must be a positive number of metres, not {self.delta}")
        if not 0 <= self.min_intensity <= 1:
            raise SeipError(f"the least intensity must lie between 0 and 1, not {self.min_intensity}")


@dataclass(frozen=True, eq=False)
class VisibilityGrid:
    """Which of c candidate poses sees which of t targets.

    Parameters
    ----------
    packed : (c, ceil(t / 8)) uint8
        Bits of V, one row per pose, as `numpy.packbits` packs them.
    shape : tuple of int
        c and t.
    key : str
        Digest of everything that the grid follows from; see `visibility_key`.
    parameters : dict
        What made it, for people: delta, min_intensity, engine, sensors, numbers of rays.
    """

    packed: NDArray[np.uint8]
    shape: tuple[int, int]
    key: str
    parameters: dict[str, Any]

    @property
    def visible(self) -> Boolean:
        """V as (c, t) bool."""
        return np.unpackbits(self.packed, axis=1, count=self.shape[1]).astype(bool)

    def times_seen(self, poses: Integer) -> Integer:
        """Return by how many of the given poses each target is seen, (t,) int64."""
        rows = np.unpackbits(self.packed[poses], axis=1, count=self.shape[1])
        times: Integer = rows.sum(axis=0, dtype=np.int64)
        return times

    def coverage(self, poses: Integer, weight: Float | None = None) -> float:
        """Return the share of targets that at least one of the given poses sees, 0 to 1.

        Parameters
        ----------
        poses : (n,) int64
        weight : (t,) float64, optional
            Importance of the targets; all alike if not given.
        """
        seen = self.times_seen(poses) > 0
        return float(np.average(seen, weights=weight))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the grid as npz: the array ``packed`` and the text ``header`` (JSON with a schema version)."""
        header = {
            "schema": SCHEMA,
            "version": SCHEMA_VERSION,
            "key": self.key,
            "shape": list(self.shape),
            "parameters": self.parameters,
        }
        with whole_file(path) as temporary, temporary.open("wb") as file:
            np.savez_compressed(file, packed=self.packed, header=np.array(json.dumps(header)))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> VisibilityGrid:
        """Read a grid that `save` wrote.

        Raises
        ------
        SeipError
            The file is not there, damaged, or something else.
        """
        try:
            with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as arrays:
                header = json.loads(str(arrays["header"]))
                packed = arrays["packed"]
            known = header["schema"] == SCHEMA and header["version"] == SCHEMA_VERSION
            shape = (int(header["shape"][0]), int(header["shape"][1]))
            grid = cls(packed, shape, str(header["key"]), dict(header["parameters"]))
        except FileNotFoundError as error:
            raise SeipError(f"there is no visibility grid {path}; compute it first") from error
        except (
            OSError,
            EOFError,
            ValueError,
            KeyError,
            IndexError,
            TypeError,
            zipfile.BadZipFile,
            zlib.error,
        ) as error:
            raise SeipError(f"{path} is not a visibility grid or is damaged; delete it and compute it again") from error
        if not known or packed.dtype != np.uint8 or packed.shape != (shape[0], (shape[1] + 7) // 8):
            raise SeipError(f"{path} is not a visibility grid of this version; delete it and compute it again")
        return grid


def visibility_key(
    site: Site, models: Mapping[str, LidarModel], settings: VisibilitySettings, caster: RayCaster
) -> str:
    """Return the digest of all that a grid follows from, names left out.

    A stored grid with this key needs no computing again.
    """
    used = _models_of(site, models)
    patterns = [
        part
        for model in used.values()
        for part in (
            *(model.elevations, model.azimuth_offsets, float(model.azimuth_count)),
            *(float(model.min_range), float(model.max_range), float(model.attenuation)),
        )
    ]
    which = np.array([list(used).index(key) for key in site.candidates.sensor], dtype=np.int64)
    return digest(
        *(SCHEMA, SCHEMA_VERSION, caster.name, float(settings.delta), float(settings.min_intensity)),
        *(site.triangles, site.targets.xyz, site.candidates.xyz, site.candidates.yaw, which),
        *patterns,
    )


def compute_visibility(
    site: Site, models: Mapping[str, LidarModel], settings: VisibilitySettings, caster: RayCaster
) -> Generator[Progress, None, VisibilityGrid]:
    """Find which pose sees which target, casting only rays that can matter.

    Parameters
    ----------
    site : Site
    models : mapping of str to LidarModel
        At least those that the candidates name.
    settings : VisibilitySettings
    caster : RayCaster
        Of the site's triangles.

    Yields
    ------
    Progress
        After each pose.

    Returns
    -------
    VisibilityGrid
        The same, bit for bit, as `full_scan_visibility`.

    Raises
    ------
    SeipError
        A sensor is unknown, or there is no pose or target, or a coordinate is not finite.
    """
    return _visibility(site, models, settings, caster, _seen_by_near_rays)


def full_scan_visibility(
    site: Site, models: Mapping[str, LidarModel], settings: VisibilitySettings, caster: RayCaster
) -> Generator[Progress, None, VisibilityGrid]:
    """Find which pose sees which target by casting every ray: the reference for `compute_visibility`."""
    return _visibility(site, models, settings, caster, _seen_by_all_rays)


@dataclass(frozen=True, eq=False)
class _Scan:
    """One sensor at one pose.

    Parameters
    ----------
    caster : RayCaster
    model : LidarModel
    origin : (3,) float64, metres
    yaw : float, radians
    settings : VisibilitySettings
    """

    caster: RayCaster
    model: LidarModel
    origin: Float
    yaw: float
    settings: VisibilitySettings

    def returns(self, rays: Integer) -> Float:
        """Cast rays and return the points, (n, 3) float64, of those returns that count."""
        directions = BeamPattern(self.model, self.yaw).directions(rays)
        distance, triangle = self.caster.cast(self.origin, directions, self.model.max_range)
        counts = np.isfinite(distance) & (distance >= self.model.min_range)
        if self.settings.min_intensity > 0:
            counts[counts] = self._intensity(distance[counts], directions[counts], triangle[counts]) >= (
                self.settings.min_intensity
            )
        points: Float = self.origin + distance[counts, None] * directions[counts]
        return points

    def _intensity(self, distance: Float, directions: Float, triangle: Integer) -> Float:
        corners = self.caster.triangles[triangle]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        cos_incidence = (normal * directions).sum(axis=1) / np.linalg.norm(normal, axis=1)
        return return_intensity(self.model, distance, cos_incidence)


def _seen_by_near_rays(scan: _Scan, targets: Float) -> tuple[Boolean, int]:
    """Which targets are seen, (t,) bool, and how many rays that took."""
    delta = scan.settings.delta
    near = near_rays(scan.model, scan.yaw, targets - scan.origin, delta)
    seen = np.zeros(len(targets), dtype=bool)
    likeliest = near.likeliest_rays(within=delta)
    _see(scan, likeliest, targets, seen)
    rest = near.rays(~seen)
    rest[likeliest] = False
    rays = np.flatnonzero(rest)
    _see(scan, rays, targets, seen)
    return seen, len(likeliest) + len(rays)


def _seen_by_all_rays(scan: _Scan, targets: Float) -> tuple[Boolean, int]:
    index = TargetIndex(targets, scan.settings.delta)
    seen = np.zeros(len(targets), dtype=bool)
    total = scan.model.channels * scan.model.azimuth_count
    for begin in range(0, total, _RAYS_AT_ONCE):
        rays = np.arange(begin, min(begin + _RAYS_AT_ONCE, total))
        seen[index.within_delta(scan.returns(rays))] = True
    return seen, total


def _see(scan: _Scan, rays: Integer, targets: Float, seen: Boolean) -> None:
    """Cast rays and add the targets that they see to ``seen``."""
    unseen = np.flatnonzero(~seen)
    if len(rays) and len(unseen):
        points = scan.returns(rays)
        seen[unseen[TargetIndex(targets[unseen], scan.settings.delta).within_delta(points)]] = True


def _visibility(
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    caster: RayCaster,
    seen_by: Callable[[_Scan, Float], tuple[Boolean, int]],
) -> Generator[Progress, None, VisibilityGrid]:
    used = _models_of(site, models)
    _require_finite(site)
    targets, poses = site.targets.xyz, site.candidates
    packed = np.zeros((len(poses), (len(targets) + 7) // 8), dtype=np.uint8)
    cast = 0
    for pose, key in enumerate(poses.sensor.tolist()):
        yield Progress(pose, len(poses), "visibility")
        scan = _Scan(caster, used[key], poses.xyz[pose], float(poses.yaw[pose]), settings)
        seen, rays = seen_by(scan, targets)
        packed[pose] = np.packbits(seen)
        cast += rays
    yield Progress(len(poses), len(poses), "visibility")
    parameters = {
        **asdict(settings),
        "engine": caster.name,
        "sensors": list(used),
        "triangles": len(site.triangles),
        "triangles_without_area": caster.dropped,
        "rays_of_full_scan": sum(used[key].channels * used[key].azimuth_count for key in poses.sensor.tolist()),
        "rays_cast": cast,
    }
    key = visibility_key(site, models, settings, caster)
    return VisibilityGrid(packed, (len(poses), len(targets)), key, parameters)


def _models_of(site: Site, models: Mapping[str, LidarModel]) -> dict[str, LidarModel]:
    return find_models(models, np.unique(site.candidates.sensor).tolist())


def _require_finite(site: Site) -> None:
    if len(site.candidates) == 0:
        raise SeipError("there is no candidate pose to compute visibility for")
    if len(site.targets) == 0:
        raise SeipError("there is no target to be seen")
    arrays = {"target": site.targets.xyz, "candidate": site.candidates.xyz, "candidate's yaw": site.candidates.yaw}
    for what, array in arrays.items():
        if not np.isfinite(array).all():
            raise SeipError(f"the coordinates of a {what} are not finite; check the scene's meshes")
