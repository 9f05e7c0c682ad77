"""Estimate of a visibility grid's run time, from some of its candidates.

The work before the first ray is done and timed. Then a sample of positions is computed, on the number of threads that
the whole grid would use. Positions differ by the number of rays that reach targets and by their surroundings; the
sample averages over both, so that its speed is that of the whole grid.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import Future, wait

import numpy as np

from ...arrays import Integer
from ...progress import REPORT_INTERVAL, Progress
from ...site.site import Site
from ..lidar.catalogue import find_models
from ..lidar.model import LidarModel
from .chunks import Rows, sharing_rays
from .executors import VisibilityTask, thread_executor
from .ray_casting import engine_name
from .settings import Engine, VisibilitySettings
from .triangle_culling import needed_triangles

SAMPLING_SECONDS = 0.8
"""Seconds for sampled positions beyond the first of each thread."""


def estimate_visibility(
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    engine: Engine = "auto",
    threads: int | None = None,
) -> Generator[Progress, None, float]:
    """Estimate the run time of `compute_visibility`.

    Parameters
    ----------
    engine : {"auto", "bvh", "embree"}
        Ray-casting engine.
    threads : int, optional
        Maximum number of threads.

    Yields
    ------
    Progress
        Progress of the sample.

    Returns
    -------
    float
        Run time, seconds.

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
    drawn = [everywhere[place] for place in _spread_lot(len(everywhere))]
    with thread_executor(task, threads) as submit:
        setting_up = time.perf_counter() - began
        yield Progress(1, 2, "sample for the estimate", counted=False)
        per_place = yield from _seconds_per_place(drawn, submit)
    return setting_up + per_place * len(everywhere)


def _spread_lot(count: int) -> list[int]:
    """Return the numbers below a count in an order of which every beginning is spread evenly.

    Places are in the order of positions, heights and tilts, so that an even sample has near and far, high and low,
    upright and tilted ones. Multiples of the golden ratio modulo 1 are spread evenly from any start.
    """
    spread = (0.5 + np.arange(2 * count) * ((math.sqrt(5) - 1) / 2)) % 1.0
    return list(dict.fromkeys((spread * count).astype(int).tolist()))


def _seconds_per_place(
    drawn: Sequence[Integer], submit: Callable[[Integer], Future[Rows]]
) -> Generator[Progress, None, float]:
    """Time visibility from the first few positions, then from others in the time that is left.

    If the second batch is the larger one, only it is used: the first one includes work that is done once.
    """
    per_place = yield from _timed(drawn[:_FIRST_POSITIONS], submit)
    more = math.floor(SAMPLING_SECONDS / per_place)
    rest = drawn[_FIRST_POSITIONS : _FIRST_POSITIONS + more]
    if len(rest) < _FIRST_POSITIONS:
        return per_place
    return (yield from _timed(rest, submit))


_FIRST_POSITIONS = 4  # at least one position for each thread


def _timed(some: Sequence[Integer], submit: Callable[[Integer], Future[Rows]]) -> Generator[Progress, None, float]:
    """Return the seconds that visibility from one position took on average."""
    began = time.perf_counter()
    pending = {submit(poses) for poses in some}
    while pending:
        finished, pending = wait(pending, REPORT_INTERVAL)
        for future in finished:
            future.result()  # an error ends the estimate
        yield Progress(1, 2, "sample for the estimate", counted=False)
    return (time.perf_counter() - began) / len(some)
