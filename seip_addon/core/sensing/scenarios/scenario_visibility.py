"""Visibility over scenarios: draws of pose errors, or instants of traffic."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Boolean, Integer
from ...base.progress import Progress, each_in_threads
from ...geometry.orientation import orientations
from ..visibility.ray_casting import engine_name, make_ray_caster, threads_of
from ..visibility.surroundings import Surroundings
from ..visibility.visibility_model import VisibilityModel
from .pose_errors import PoseErrors, draw_errors, out_of_objects
from .traffic_instants import TrafficObstacles


@dataclass(frozen=True, eq=False)
class ScenarioVisibility:
    """Visibility grids of s poses and t targets in each of n scenarios.

    Parameters
    ----------
    packed : (n, s, ceil(t / 8)) uint8
        Bits of V, in the order of `numpy.packbits`.
    targets : int
        Number of targets, t.
    """

    packed: NDArray[np.uint8]
    targets: int

    def __len__(self) -> int:
        return len(self.packed)

    def seen(self, number: int) -> Boolean:
        """Return V in one scenario, (s, t) bool."""
        return np.unpackbits(self.packed[number], axis=1, count=self.targets).view(bool)

    def seen_by_each(self, poses: Integer) -> NDArray[np.uint8]:
        """Return the targets that some poses see in each scenario, (n, s, t) uint8."""
        return np.unpackbits(self.packed[:, poses], axis=2, count=self.targets)

    def seen_by_any(self, poses: Integer) -> Boolean:
        """Return the targets that at least one of some poses sees in each scenario, (n, t) bool."""
        joined = np.bitwise_or.reduce(self.packed[:, poses], axis=1)
        return np.unpackbits(joined, axis=1, count=self.targets).view(bool)


def visibility_under_errors(
    around: Surroundings, poses: Integer, errors: PoseErrors, draws: int, seed: int
) -> Generator[Progress, None, ScenarioVisibility]:
    """Compute visibility from poses under draws of errors.

    No draw puts a sensor inside an object; see `out_of_objects`.

    Parameters
    ----------
    poses : (s,) int64
        Indices among the site's candidates.
    draws, seed : int
        Number of draws and their seed; see `draw_errors`.

    Yields
    ------
    Progress
        Progress after each pose of a draw.
    """
    site, models = around.site, around.models
    candidates = site.candidates
    keys, xyz = candidates.sensor[poses].tolist(), candidates.xyz[poses]
    yaw, tilt = candidates.yaw[poses], candidates.tilt[poses]
    caster = make_ray_caster(site.triangles, engine_name(around.engine))
    model = VisibilityModel(site.targets.xyz, site.reflectivity, around.sight, caster)
    packed = np.zeros((draws, len(poses), (len(site.targets) + 7) // 8), dtype=np.uint8)
    drawn = draw_errors(errors, candidates.position[candidates.position_of[poses]], draws, seed)
    drawn = out_of_objects(drawn, xyz, around.objects)
    rotations = orientations(yaw + drawn[..., 3], tilt + drawn[..., 4], drawn[..., 5])

    def compute(work: tuple[int, int]) -> None:
        draw, pose = work
        seen = model.see(models[keys[pose]], xyz[pose] + drawn[draw, pose, :3], rotations[draw, pose])
        packed[draw, pose] = np.packbits(seen)

    works = [(draw, pose) for draw in range(draws) for pose in range(len(poses))]
    yield from each_in_threads(compute, works, caster.threads, "computing visibility under pose errors")
    return ScenarioVisibility(packed, len(site.targets))


def visibility_in_traffic(
    around: Surroundings, poses: Integer, instants: Sequence[TrafficObstacles]
) -> Generator[Progress, None, ScenarioVisibility]:
    """Compute visibility from poses at instants of traffic, as with the vehicles in the scene.

    A return from a vehicle on a target, or next to it, sees the target as a return from the road does.

    Parameters
    ----------
    poses : (s,) int64
        Indices among the site's candidates.
    instants : sequence of TrafficObstacles
        Bodies of the vehicles present at each of n instants.

    Yields
    ------
    Progress
        Progress after each instant.
    """
    site, candidates, engine = around.site, around.site.candidates, engine_name(around.engine)
    packed = np.zeros((len(instants), len(poses), (len(site.targets) + 7) // 8), dtype=np.uint8)

    def compute(instant: int) -> None:
        present = instants[instant]
        caster = make_ray_caster(np.concatenate([site.triangles, present.triangles]), engine)
        reflectivity = np.concatenate([site.reflectivity, present.reflectivity])
        model = VisibilityModel(site.targets.xyz, reflectivity, around.sight, caster)
        for number, pose in enumerate(poses.tolist()):
            lidar = around.models[str(candidates.sensor[pose])]
            seen = model.see(lidar, candidates.xyz[pose], candidates.orientation(pose))
            packed[instant, number] = np.packbits(seen)

    yield from each_in_threads(compute, range(len(instants)), threads_of(engine), "computing visibility in traffic")
    return ScenarioVisibility(packed, len(site.targets))
