"""Estimate of a visibility grid's run time and memory, from its first candidates.

The work before the first ray is done and timed. Then a random sample of positions is computed, on the number of threads
that the whole grid would use. Positions differ by the number of rays that reach targets and by their surroundings; the
sample averages over both, so that its speed is that of the whole grid.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import Future, wait
from dataclasses import dataclass

import numpy as np

from ...arrays import Integer
from ...progress import REPORT_INTERVAL, Progress
from ...site.site import Site
from ..lidar.catalogue import find_models
from ..lidar.model import LidarModel
from .chunks import Rows, sharing_rays
from .executors import VisibilityTask, thread_executor
from .ray_casting import Engine, engine_name
from .settings import VisibilitySettings
from .triangle_culling import needed_triangles

SAMPLING_SECONDS = 0.8
"""Seconds for sampled positions beyond the first of each thread."""

_BYTES_PER_TRIANGLE = {"embree": 750, "bvh": 1100}
"""Peak memory, while the ray caster is built; measured on a street of a million triangles."""
_BYTES_PER_RAY_AND_POSITION = 160
"""Memory of a position in work: directions, points, triangles and bundles."""


@dataclass(frozen=True)
class Estimate:
    """Estimated run time and memory of a visibility grid.

    Parameters
    ----------
    places, poses, targets, triangles : int
        Numbers of each. Poses at one place differ only in the sensor; triangles are those that rays are cast against.
    rays : int
        Number of rays to cast.
    seconds : float
        Run time.
    memory : int, bytes
        Memory in addition to that of the scene.
    """

    places: int
    poses: int
    targets: int
    triangles: int
    rays: int
    seconds: float
    memory: int


def estimate_visibility(
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    engine: Engine = "auto",
    threads: int | None = None,
    seed: int = 0,
) -> Generator[Progress, None, Estimate]:
    """Estimate the run time and memory of `compute_visibility`.

    Parameters
    ----------
    engine : {"auto", "bvh", "embree"}
        Ray-casting engine.
    threads : int, optional
        Maximum number of threads.
    seed : int
        Seed of the random sample.

    Yields
    ------
    Progress
        Progress of the sample.

    Returns
    -------
    Estimate
        Run time, memory and numbers of rays.

    Raises
    ------
    SeipError
        Same as for `compute_visibility`.
    """
    yield Progress(0, 2, "triangles for the estimate", counted=False)
    began = time.perf_counter()
    poses = site.candidates
    used = find_models(models, np.unique(poses.sensor).tolist())
    longest = max(model.max_range for model in used.values())
    needed = needed_triangles(site.triangles, poses.xyz, site.targets.xyz, settings.delta, longest)
    task = VisibilityTask(site, used, settings, engine_name(engine), needed.keep)
    everywhere = sharing_rays(poses.xyz, poses.yaw, poses.tilt)
    drawn = [everywhere[place] for place in _spread_lot(len(everywhere), seed)]
    with thread_executor(task, threads) as submit:
        setting_up = time.perf_counter() - began
        yield Progress(1, 2, "sample for the estimate", counted=False)
        sample = yield from _compute_from(drawn, submit)
    per_place = sample.seconds / sample.places
    rays = sample.rays / sample.places
    return Estimate(
        places=len(everywhere),
        poses=len(poses),
        targets=len(site.targets),
        triangles=int(needed.keep.sum()),
        rays=round(rays * len(everywhere)),
        seconds=setting_up + per_place * len(everywhere),
        memory=_memory(task, rays, len(poses)),
    )


def _spread_lot(count: int, seed: int) -> list[int]:
    """Return the numbers below a count in a random order of which every beginning is spread evenly.

    Places are in the order of positions, heights and tilts, so that an even sample has near and far, high and low,
    upright and tilted ones. Multiples of the golden ratio modulo 1 are spread evenly from any start.
    """
    start = np.random.default_rng(seed).random()
    spread = (start + np.arange(2 * count) * ((math.sqrt(5) - 1) / 2)) % 1.0
    return list(dict.fromkeys((spread * count).astype(int).tolist()))


@dataclass(frozen=True)
class _Sample:
    places: int
    seconds: float
    rays: int


def _compute_from(
    drawn: Sequence[Integer], submit: Callable[[Integer], Future[Rows]]
) -> Generator[Progress, None, _Sample]:
    """Compute visibility from the first few positions, then from others in the time that is left.

    If the second batch is the larger one, only it is used: the first one includes work that is done once.
    """
    first = yield from _timed(drawn[:_FIRST_POSITIONS], submit)
    more = math.floor(SAMPLING_SECONDS / first.seconds * first.places)
    rest = drawn[_FIRST_POSITIONS : _FIRST_POSITIONS + more]
    if len(rest) < _FIRST_POSITIONS:
        return first
    return (yield from _timed(rest, submit))


_FIRST_POSITIONS = 4  # at least one position for each thread


def _timed(some: Sequence[Integer], submit: Callable[[Integer], Future[Rows]]) -> Generator[Progress, None, _Sample]:
    began = time.perf_counter()
    futures = [submit(poses) for poses in some]
    pending = set(futures)
    while pending:
        pending = wait(pending, REPORT_INTERVAL).not_done
        yield Progress(1, 2, "sample for the estimate", counted=False)
    return _Sample(len(some), time.perf_counter() - began, sum(future.result().rays for future in futures))


def _memory(task: VisibilityTask, rays_per_place: float, poses: int) -> int:
    triangles = len(task.keep) * _BYTES_PER_TRIANGLE[task.engine]
    under_way = rays_per_place * _BYTES_PER_RAY_AND_POSITION * _FIRST_POSITIONS
    grid = poses * len(task.site.targets) * (1 + 1 / 8)  # as bits, and unpacked for the placement
    return math.ceil(triangles + under_way + grid)
