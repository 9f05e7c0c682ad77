"""Workers of a network: the processes of a Dask cluster, and the tasks that they are given."""

from __future__ import annotations

import asyncio
import importlib.util
import logging
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

from seip_addon.core.base.errors import SeipError
from seip_addon.scene.interrupts import held_signals

MEMORY = 4 << 30
"""Bytes that a worker of this machine may use: ten times what a typical site needs. Dask ends one that needs more."""
_CONNECT_TIMEOUT = 20  # seconds
_CLOSE_TIMEOUT = 0.5  # seconds that a worker has to end by itself: Dask would wait 4 s for each to finish its task
_PRELOAD = (
    "import os, signal; signal.signal(signal.SIGINT, signal.SIG_IGN); os.dup2(os.open(os.devnull, os.O_WRONLY), 1)"
)
"""Run by each worker of this machine: Ctrl-C reaches all processes of a terminal, and the command ends its workers
itself; and Blender reports each file that it saves."""

Client = Any
"""`distributed.Client`, which has no types."""


def check_dask() -> None:
    """Raise SeipError if Dask is not installed."""
    if importlib.util.find_spec("distributed") is None:
        raise SeipError(
            "a network needs Dask, which is not installed; install the extra 'cluster' in the project's folder: "
            "pip install '.[cluster]'"
        )


def usual_workers() -> int:
    """Return the number of workers for which this machine, or the container, has cores and memory."""
    check_dask()
    from dask.system import CPU_COUNT  # noqa: PLC0415 - an extra
    from distributed.system import MEMORY_LIMIT  # noqa: PLC0415 - as above

    return max(1, min(CPU_COUNT, MEMORY_LIMIT // MEMORY))


@contextmanager
def connected(address: str | None, workers: int = 1) -> Iterator[Client]:
    """Yield a client of a Dask scheduler, and close it at the end.

    Parameters
    ----------
    address : str or None
        Address of the scheduler, such as ``tcp://10.0.0.1:8786``, or ``tls://10.0.0.1:8786`` with the certificates from
        Dask's configuration. Its workers must be able to import this package. None starts a cluster on this machine.
    workers : int
        Number of processes of a cluster on this machine.

    Raises
    ------
    SeipError
        Dask is not installed, or the scheduler does not answer or has no workers.
    """
    check_dask()
    import dask  # noqa: PLC0415 - an extra that need not be installed
    from distributed import Client  # noqa: PLC0415 - as above

    if address is None:
        with ExitStack() as stack:
            # Processes that are killed leave their temporary files: those of the workers lie in a folder of this one.
            folder = stack.enter_context(TemporaryDirectory(prefix="seip-", ignore_cleanup_errors=True))
            stack.enter_context(dask.config.set({"temporary-directory": folder}))
            stack.enter_context(_apart_from_blender())
            with held_signals():  # Dask cannot close a cluster whose start was interrupted
                cluster = stack.enter_context(_local_cluster(workers, folder))
                client = stack.enter_context(Client(cluster, set_as_default=False))
            try:
                yield client
            finally:
                cluster.sync(_close_workers, cluster)
        return
    try:
        client = Client(address, timeout=_CONNECT_TIMEOUT, set_as_default=False)
    except TypeError as error:  # raised by distributed for a TLS address without certificates
        raise SeipError(
            f"{address} needs certificates: name them in Dask's settings distributed.comm.tls.ca-file, client.cert "
            "and client.key"
        ) from error
    except (OSError, ValueError) as error:
        raise SeipError(f"no Dask scheduler answers at {address}; start one, or check the address") from error
    # a lost connection is reported by `run_jobs`, without the traceback of Dask
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    with client:
        if not client.scheduler_info()["workers"]:
            raise SeipError(
                f"the Dask scheduler at {address} has no workers; start some where this package is installed"
            )
        yield client


def _local_cluster(workers: int, folder: str) -> Any:  # noqa: ANN401 -- Dask has no types
    """Start a cluster of processes on this machine, whose temporary files lie in a folder."""
    from distributed import LocalCluster  # noqa: PLC0415 - an extra

    return LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        memory_limit=MEMORY,
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        silence_logs=50,
        preload=[_PRELOAD],
        env=dict.fromkeys(("TMPDIR", "TEMP", "TMP"), folder),
    )


async def _close_workers(cluster: Any) -> None:  # noqa: ANN401 -- Dask has no types
    closing = (worker.close(timeout=_CLOSE_TIMEOUT) for worker in cluster.workers.values())
    await asyncio.gather(*closing, return_exceptions=True)


@contextmanager
def _apart_from_blender() -> Iterator[None]:
    """Keep new processes from what bpy has changed in this one.

    They would import the program that started them as their own main module, and with it bpy in the thread that answers
    the scheduler; and of two packages of this name they would find that of Blender's scripts first.
    """
    main, paths = sys.modules["__main__"], list(sys.path)
    sys.modules["__main__"] = ModuleType("__main__")
    sys.path.sort(key=lambda path: "scripts" in Path(path).parts)
    try:
        yield
    finally:
        sys.modules["__main__"], sys.path[:] = main, paths


def run_jobs(
    client: Client, function: Callable[..., Any], jobs: Sequence[tuple[Any, ...]]
) -> Iterator[tuple[int, Any, str]]:
    """Call a function on the workers with the arguments of each job.

    Yields
    ------
    int, object, str
        As they finish: number of a job, what the function returned, and the reason why it failed, or "".

    Raises
    ------
    SeipError
        The scheduler is gone.
    """
    from distributed import CancelledError, KilledWorker, as_completed  # noqa: PLC0415 -- an extra

    futures = [client.submit(_call, function.__module__, function.__name__, job, pure=False) for job in jobs]
    numbers = {future.key: number for number, future in enumerate(futures)}
    try:
        for future in as_completed(futures, loop=client.loop):
            error = future.exception()
            if isinstance(error, KilledWorker):
                reason = "several workers ended in the midst of it, as when memory runs out: shorten --approaches"
            elif error is not None:
                reason = str(error) if isinstance(error, SeipError) else f"{type(error).__name__}: {error}"
            else:
                reason = ""
            yield numbers[future.key], None if reason else future.result(), reason
    except (CancelledError, OSError) as error:
        raise SeipError("the Dask scheduler stopped: start it again, and run the same command to go on") from error
    finally:
        client.cancel(futures)


def _call(module: str, name: str, job: tuple[Any, ...]) -> object:
    """Call a function; the thread that does the work of a worker imports it, and with it Blender."""
    return getattr(importlib.import_module(module), name)(*job)
