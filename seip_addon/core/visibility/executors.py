"""Executors for chunks of the visibility grid: threads or a Dask cluster."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from ..arrays import Boolean, Float, Integer
from ..errors import SeipError
from ..lidar import LidarModel
from ..site.site import Site
from .chunks import Rows, compute_rows
from .ray_casting import Engine, RayCaster, make_ray_caster
from .settings import VisibilitySettings
from .visibility_model import VisibilityModel

Submit = Callable[[Integer], Future[Rows]]

_RAYS_BETWEEN_CHECKS = 1 << 15  # a tenth of a second's work or less
_ANSWER_SECONDS = 20
_MAX_LOST_WORKERS = 3  # so many die over one chunk before the chunk is held to be the cause


@dataclass(frozen=True, eq=False)
class VisibilityTask:
    """Inputs of rows of a visibility grid, to be sent to workers.

    Parameters
    ----------
    engine : {"bvh", "embree"}
    keep : (n,) bool
        Which triangles of the site rays are cast against.
    """

    site: Site
    models: Mapping[str, LidarModel]
    settings: VisibilitySettings
    engine: Engine
    keep: Boolean

    def ray_caster(self) -> RayCaster:
        """Return a new ray caster of the site's triangles."""
        return make_ray_caster(self.site.triangles, self.engine, self.keep)

    def rows_by(self, caster: RayCaster) -> Callable[[Integer], Rows]:
        """Return the function that computes the rows of poses."""
        model = VisibilityModel(self.site, self.settings, caster)
        return lambda poses: compute_rows(model, self.site.candidates, self.models, poses)


@contextmanager
def threads_of(task: VisibilityTask, threads: int | None = None) -> Iterator[Submit]:
    """Yield what starts the work on a chunk in a thread of this process; unfinished work ends with the block, soon.

    Parameters
    ----------
    threads : int, optional
        How many work at once at most.
    """
    stop = threading.Event()
    caster = StoppableCaster(task.ray_caster(), stop)
    rows = task.rows_by(caster)
    pool = ThreadPoolExecutor(min(caster.threads, threads or caster.threads))
    try:
        yield lambda poses: pool.submit(rows, poses)
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)


class StoppableCaster:
    """A ray caster that can be stopped: it casts some rays at a time.

    Parameters
    ----------
    caster : RayCaster
        That does it.
    stop : Event
        Casting raises `CancelledError` once this is set.
    """

    def __init__(self, caster: RayCaster, stop: threading.Event) -> None:
        self._caster, self._stop = caster, stop
        self.name, self.triangles, self.threads = caster.name, caster.triangles, caster.threads

    def cast(self, origin: Float, directions: Float, max_range: float) -> tuple[Float, Integer]:
        """Cast rays; see `RayCaster.cast`."""
        hits = []
        for begin in range(0, max(len(directions), 1), _RAYS_BETWEEN_CHECKS):
            if self._stop.is_set():
                raise CancelledError
            some = slice(begin, begin + _RAYS_BETWEEN_CHECKS)
            hits.append(self._caster.cast(origin if origin.ndim == 1 else origin[some], directions[some], max_range))
        distance, triangle = zip(*hits, strict=True)
        return np.concatenate(distance), np.concatenate(triangle)


@contextmanager
def cluster(address: str, task: VisibilityTask) -> Iterator[Submit]:
    """Yield what starts the work on a chunk at a worker of a Dask scheduler.

    Parameters
    ----------
    address : str
        Of the scheduler, like ``tcp://10.0.0.1:8786``, or ``tls://10.0.0.1:8786`` with the certificates that Dask's
        settings name. Its workers must be able to import this package.

    Raises
    ------
    SeipError
        Dask is not installed, no scheduler answers, it has no workers, or a chunk ended one worker after the other.
    """
    try:
        import dask  # noqa: PLC0415 - an extra that need not be installed
        from distributed import Client, KilledWorker  # noqa: PLC0415 - as above
    except ImportError as error:
        raise SeipError(
            "a scheduler needs Dask, which is not installed; install the group 'cluster' of pyproject.toml"
        ) from error
    try:
        client = Client(address, timeout=_ANSWER_SECONDS, set_as_default=False)
    except TypeError as error:  # what distributed raises on an address with TLS, and no certificates
        raise SeipError(
            f"{address} needs certificates: name them in Dask's settings distributed.comm.tls.ca-file, client.cert and "
            "client.key"
        ) from error
    except (OSError, ValueError) as error:
        raise SeipError(f"no Dask scheduler answers at {address}; start one, or check the address") from error
    with client:
        if not client.scheduler_info()["workers"]:
            raise SeipError(f"the Dask scheduler at {address} has no workers; start some where this package is")
        try:
            with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1TB"}):
                # a task, not scattered data: a scheduler computes it again where the worker that held it dies
                everywhere = client.submit(_same, task, pure=False)
            with client.get_executor(pure=False) as executor:
                yield lambda poses: executor.submit(_see, everywhere, poses)
        except KilledWorker as error:
            raise SeipError(f"workers of {address} died over one chunk of the work: {error}") from error


def _same(task: VisibilityTask) -> VisibilityTask:
    return task


def _see(task: VisibilityTask, poses: Integer) -> Rows:
    return _rows_by_worker(task)(poses)


@functools.lru_cache(maxsize=1)  # a worker holds one visibility model for all chunks
def _rows_by_worker(task: VisibilityTask) -> Callable[[Integer], Rows]:
    return task.rows_by(task.ray_caster())
