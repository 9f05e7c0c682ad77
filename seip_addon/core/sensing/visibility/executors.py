"""Executors that compute chunks of the visibility grid: local threads or the workers of a Dask cluster."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from ...base.arrays import Boolean, Float, Integer
from ...base.errors import SeipError
from ...programs.dask_client import connected
from ...site.site import Site
from ..lidar.model import LidarModel
from .chunks import Rows, compute_rows
from .ray_casting import RayCaster, make_ray_caster
from .settings import Engine, VisibilitySettings
from .visibility_model import VisibilityModel

Submit = Callable[[Integer], Future[Rows]]
"""Submits the pose indices of a chunk, (n,) int64; the future holds their rows of the grid."""

_RAYS_BETWEEN_CHECKS = 1 << 15  # no more than a tenth of a second's work


@dataclass(frozen=True, eq=False)
class VisibilityTask:
    """Inputs of the rows of a visibility grid, picklable for workers.

    Parameters
    ----------
    engine : {"bvh", "embree"}
        Ray-casting engine.
    keep : (n,) bool
        Triangles of the site that can affect the grid; rays are cast against these only.
    """

    site: Site
    models: Mapping[str, LidarModel]
    settings: VisibilitySettings
    engine: Engine
    keep: Boolean

    def ray_caster(self) -> RayCaster:
        """Return a new ray caster of the site's triangles."""
        return make_ray_caster(self.site.triangles, self.engine, self.keep)

    def row_function(self, caster: RayCaster) -> Callable[[Integer], Rows]:
        """Return the function from pose indices (n,) to their rows of the grid."""
        model = VisibilityModel(self.site.targets.xyz, self.site.reflectivity, self.settings, caster)
        return lambda poses: compute_rows(model, self.site.candidates, self.models, poses)


@contextmanager
def thread_executor(task: VisibilityTask, threads: int | None = None) -> Iterator[Submit]:
    """Yield a function that submits chunks to threads of this process; leaving the block cancels unfinished chunks.

    Parameters
    ----------
    threads : int, optional
        Maximum number of threads; by default the number that the ray caster can use.
    """
    stop = threading.Event()
    caster = StoppableCaster(task.ray_caster(), stop)
    compute = task.row_function(caster)
    pool = ThreadPoolExecutor(min(caster.threads, threads or caster.threads))
    try:
        yield lambda poses: pool.submit(compute, poses)
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)


class StoppableCaster:
    """Ray caster that works in batches and can be stopped between them.

    Parameters
    ----------
    caster : RayCaster
        Ray caster for each batch.
    stop : Event
        Event after which casting raises `CancelledError`.
    """

    def __init__(self, caster: RayCaster, stop: threading.Event) -> None:
        self._caster, self._stop = caster, stop
        self.triangles, self.threads = caster.triangles, caster.threads

    def cast(self, origin: Float, directions: Float, max_range: float) -> tuple[Float, Integer]:
        """Cast rays; see `RayCaster.cast`."""
        hits = []
        for begin in range(0, max(len(directions), 1), _RAYS_BETWEEN_CHECKS):
            if self._stop.is_set():
                raise CancelledError
            batch = slice(begin, begin + _RAYS_BETWEEN_CHECKS)
            hits.append(self._caster.cast(origin if origin.ndim == 1 else origin[batch], directions[batch], max_range))
        distance, triangle = zip(*hits, strict=True)
        return np.concatenate(distance), np.concatenate(triangle)


@contextmanager
def dask_executor(task: VisibilityTask, address: str) -> Iterator[Submit]:
    """Yield a function that submits chunks to the workers of a Dask scheduler.

    Parameters
    ----------
    address : str
        Address of the scheduler, such as ``tcp://10.0.0.1:8786``, or ``tls://10.0.0.1:8786`` with the certificates
        from Dask's configuration. Its workers must be able to import this package.

    Raises
    ------
    SeipError
        Dask is not installed, the scheduler does not answer or has no workers, or several workers died on one chunk.
    """
    with connected(address) as client:
        from distributed import KilledWorker  # noqa: PLC0415 - an extra, which `connected` requires

        try:
            # submitted, not scattered: the scheduler recomputes it when the worker that holds it dies
            shared_task = client.submit(_identity, task, pure=False)
            with client.get_executor(pure=False) as executor:
                yield lambda poses: executor.submit(_compute_on_worker, shared_task, poses)
        except KilledWorker as error:
            raise SeipError(
                f"several workers of {address} died on one chunk of the work ({error}); give them more memory"
            ) from error


def _identity(task: VisibilityTask) -> VisibilityTask:
    return task


def _compute_on_worker(task: VisibilityTask, poses: Integer) -> Rows:
    return _worker_row_function(task)(poses)


@functools.lru_cache(maxsize=1)  # one visibility model per worker, for all chunks
def _worker_row_function(task: VisibilityTask) -> Callable[[Integer], Rows]:
    return task.row_function(task.ray_caster())
