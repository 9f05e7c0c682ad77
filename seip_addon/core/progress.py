"""Progress of long work, as values yielded by generators.

Long loops of the core are generators that yield `Progress` and return their result: a modal operator steps them, a
batch command shows a bar, a test exhausts them with `finish`.
"""

import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from contextlib import closing
from dataclasses import dataclass
from typing import TypeVar

Result = TypeVar("Result")

REPORT_INTERVAL = 0.1  # seconds between the reports of work in a thread


@dataclass(frozen=True)
class Progress:
    """Progress of a piece of work.

    Parameters
    ----------
    done, total : int
        Finished and all units of work, ``0 <= done <= total``; a total of 0 means that it is not known.
    what : str
        What is being worked on, for the person who waits.
    counted : bool
        Whether the units take about the same time, so that the time left follows from their number. Stages of work do
        not; a search, which may end at any step, has a total of 0.
    """

    done: int
    total: int
    what: str
    counted: bool = True


class Pace:
    """Time left of counted work, from its reports: each count of units has a pace of its own.

    Attributes
    ----------
    first : Progress or None
        The report that the count began with.
    began : float, seconds
        When that was.
    seconds_left : float or None
        None where the work cannot be counted, or no unit has been finished yet.
    """

    def __init__(self) -> None:
        self.first: Progress | None = None
        self.began = 0.0
        self.seconds_left: float | None = None
        self._done = 0

    def note(self, progress: Progress, now: float) -> None:
        """Take a report.

        Parameters
        ----------
        now : float, seconds
            Reading of a monotonic clock.
        """
        if self.first is None or self.first.total != progress.total or progress.done < self._done:
            self.first, self.began = progress, now
        self._done = progress.done
        gained = progress.done - self.first.done
        known = progress.counted and progress.total > 0 and gained > 0
        self.seconds_left = (progress.total - progress.done) * (now - self.began) / gained if known else None


def finish(steps: Generator[Progress, None, Result], report: Callable[[Progress], object] | None = None) -> Result:
    """Run work to its end, calling ``report`` at each step, and return its result."""
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            result: Result = stop.value
            return result
        if report is not None:
            report(progress)


def within(whole: Progress, steps: Generator[Progress, None, Result]) -> Generator[Progress, None, Result]:
    """Run work as one unit of a larger whole: at each step the whole's progress shows, and it can be stopped there."""
    while True:
        try:
            next(steps)
        except StopIteration as stop:
            result: Result = stop.value
            return result
        yield whole


def in_detail(whole: Progress, steps: Generator[Progress, None, Result]) -> Generator[Progress, None, Result]:
    """Run work as one unit of a larger whole of units that are equally long, and show how far it is within its unit."""
    while True:
        try:
            step = next(steps)
        except StopIteration as stop:
            result: Result = stop.value
            return result
        done, total = whole.done * step.total + step.done, whole.total * step.total
        yield Progress(done, total, step.what, whole.counted and step.counted)


def in_thread(work: Callable[[threading.Event], Result], what: str) -> Generator[Progress, None, Result]:
    """Run work that cannot yield, such as a call of a library, in a thread of its own.

    Parameters
    ----------
    work : callable
        Called with an event; once that is set nobody waits for the result, and the sooner it returns the better.

    Yields
    ------
    Progress
        Ten times a second.
    """
    stop = threading.Event()
    result: Future[Result] = Future()

    def run() -> None:
        try:
            result.set_result(work(stop))
        except BaseException as error:  # noqa: BLE001 -- raised again where the result is asked for
            result.set_exception(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        while thread.is_alive():
            thread.join(REPORT_INTERVAL)
            yield Progress(0, 0, what)
        return result.result()
    finally:
        stop.set()


def side_by_side(
    works: Sequence[Generator[Progress, None, Result]], threads: int
) -> Generator[Progress, None, list[Result]]:
    """Run pieces of work at the same time, each in one thread; for work that mostly leaves Python's lock free.

    Parameters
    ----------
    works : sequence of generators
        Of progress, each of its own units.
    threads : int
        How many run at once at most.

    Yields
    ------
    Progress
        The sum over those that have begun, ten times a second, with what the last of them does.

    Returns
    -------
    list
        Their results, in their order.
    """
    stop = threading.Event()
    latest: dict[int, Progress] = {}

    def run(number: int) -> Result:
        def report(progress: Progress) -> None:
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
                ended.result()  # raises here what went wrong there
            yield _sum_of(list(latest.values()), len(works))
        return [future.result() for future in futures]
    finally:
        stop.set()
        pool.shutdown(wait=False, cancel_futures=True)  # whoever stops this need not wait for the next report


class _Stopped(BaseException):
    """Raised in a worker thread whose result is no longer wanted."""


def _sum_of(parts: Sequence[Progress], works: int) -> Progress:
    if not parts:
        return Progress(0, 0, "begin")
    done, total = sum(part.done for part in parts), sum(part.total for part in parts)
    counted = all(part.counted and part.total for part in parts)
    return Progress(done, total * works // len(parts), parts[-1].what, counted)
