"""Several pieces of long work at the same time, in threads."""

import threading
from collections.abc import Generator, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from contextlib import closing

from seip_addon.core.progress import REPORT_INTERVAL, Progress, Result, finish


def side_by_side(
    works: Sequence[Generator[Progress, None, Result]], threads: int
) -> Generator[Progress, None, list[Result]]:
    """Run pieces of work in parallel threads, for work that mostly releases Python's global lock.

    Parameters
    ----------
    works : sequence of generators
        Pieces of work, each with its own units of progress.
    threads : int
        Largest number of pieces that run at the same time.

    Yields
    ------
    Progress
        Sum over the pieces that have begun, ten times a second, with the description of the last one.

    Returns
    -------
    list
        Results in the order of the pieces.
    """
    stop = threading.Event()
    latest: dict[int, Progress] = {}

    def run(number: int) -> Result:
        def report(progress: Progress) -> None:
            # A thread cannot be stopped from outside: it stops itself at its next report.
            latest[number] = progress
            if stop.is_set():
                raise _Stopped

        with closing(works[number]) as work:
            return finish(work, report)

    pool = ThreadPoolExecutor(threads)
    try:
        futures = [pool.submit(run, number) for number in range(len(works))]
        while any(not future.done() for future in futures):
            for ended in wait(futures, REPORT_INTERVAL, FIRST_EXCEPTION).done:
                ended.result()  # raises the exception of that thread
            yield _sum_of(list(latest.values()), len(works))
        return [future.result() for future in futures]
    finally:
        stop.set()
        pool.shutdown(wait=False, cancel_futures=True)  # do not wait for the next report of each piece


class _Stopped(BaseException):
    """Raised in a worker thread whose result is no longer wanted."""


def _sum_of(parts: Sequence[Progress], works: int) -> Progress:
    if not parts:
        return Progress(0, 0, "begin")
    done, total = sum(part.done for part in parts), sum(part.total for part in parts)
    counted = all(part.counted and part.total for part in parts)
    return Progress(done, total * works // len(parts), parts[-1].what, counted)
