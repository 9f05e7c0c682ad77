"""Connections to Dask schedulers, which distribute work to other processes and machines."""

from __future__ import annotations

import asyncio
import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

from ..base.errors import SeipError

_CONNECT_TIMEOUT = 20  # seconds
_CLOSE_TIMEOUT = 0.5  # seconds that a worker has to end by itself when the command is interrupted
_IGNORE_CTRL_C = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"
"""Run by each worker of a cluster on this machine: Ctrl-C reaches all processes of a terminal, and the command ends its
workers itself."""


@contextmanager
def connected(address: str | None, workers: int = 1) -> Iterator[Any]:
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
    try:
        import dask  # noqa: PLC0415 - an extra that need not be installed
        from distributed import Client, LocalCluster  # noqa: PLC0415 - as above
    except ImportError as error:
        raise SeipError(
            "a scheduler needs Dask, which is not installed; install the extra 'cluster' in the project's folder: "
            "pip install '.[cluster]'"
        ) from error
    with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1TB"}):
        if address is None:
            # Processes that are killed leave their temporary files: those of the workers lie in a folder of this one.
            with (
                TemporaryDirectory(prefix="seip-", ignore_cleanup_errors=True) as folder,
                dask.config.set({"temporary-directory": folder}),
                _empty_main(),
                LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    memory_limit=0,
                    host="127.0.0.1",
                    dashboard_address="127.0.0.1:0",
                    silence_logs=50,
                    preload=[_IGNORE_CTRL_C],
                    env=dict.fromkeys(("TMPDIR", "TEMP", "TMP"), folder),
                ) as cluster,
                _ended_with(cluster),
                Client(cluster, set_as_default=False) as client,
            ):
                yield client
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
        with _without_log("distributed.client"), client:
            if not client.scheduler_info()["workers"]:
                raise SeipError(
                    f"the Dask scheduler at {address} has no workers; start some where this package is installed"
                )
            yield client


@contextmanager
def _ended_with(cluster: Any) -> Iterator[None]:  # noqa: ANN401 -- Dask has no types
    """End the workers of a cluster soon after an exception in the block: Dask would wait 4 s for each to finish."""
    try:
        yield
    except BaseException:
        cluster.sync(_close_workers, cluster)
        raise


async def _close_workers(cluster: Any) -> None:  # noqa: ANN401 -- as above
    closing = (worker.close(timeout=_CLOSE_TIMEOUT) for worker in cluster.workers.values())
    await asyncio.gather(*closing, return_exceptions=True)


@contextmanager
def _without_log(name: str) -> Iterator[None]:
    """Silence a logger: a lost connection is reported by whoever uses the client, without the traceback of Dask."""
    logger = logging.getLogger(name)
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)


@contextmanager
def _empty_main() -> Iterator[None]:
    """Keep new processes from importing the program that started them.

    They would import it as their own main module, and with it bpy, which cannot be imported there.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main
