"""Progress of long work, as values yielded by generators.

Long loops of the core are generators that yield `Progress` and return their result: a modal operator steps them, a
batch command shows a bar, a test exhausts them with `finish`.
"""

import threading
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import closing
from dataclasses import dataclass, replace
from typing import TypeVar

from .counts import duration_text

Result = TypeVar("Result")
Item = TypeVar("Item")

REPORT_INTERVAL = 0.1  # seconds between the reports of work in a thread


@dataclass(frozen=True)
class Progress:
    """Progress of a piece of work.

    Parameters
    ----------
    done, total : int
        Number of finished and of all units of work, ``0 <= done <= total``; a total of 0 means that it is not known.
    what : str
        Description of the current work for the user.
    counted : bool
        Whether all units take about the same time, so that the remaining time follows from their number; false for
        stages of work. A search, which may end at any step, has a total of 0.
    best : str
        Best value that a search has found so far, in the words of the answer: "71% of the road"; "" before the first.
    poses : tuple of int
        Candidate poses of that placement, ascending.
    gap : float or None
        Largest share by which a better value is still possible; None without a bound.
    """

    done: int
    total: int
    what: str
    counted: bool = True
    best: str = ""
    poses: tuple[int, ...] = ()
    gap: float | None = None


def progress_line(progress: Progress, duration: str = "") -> str:
    """Return progress as one line: phase, share done, best value so far, gap and time, as far as they are known.

    Parameters
    ----------
    duration : str
        Time elapsed or left, from `time_text`.

    Examples
    --------
    >>> found = Progress(0, 0, "improving the placement", best="71% of the road", gap=0.052)
    >>> progress_line(found, time_text(elapsed=8.0))
    'improving the placement: 71% of the road, gap at most 5.2%, 8 s elapsed'
    >>> progress_line(Progress(336, 672, "visibility"), time_text(elapsed=12.0, left=12.0))
    'visibility: 50% done, 12 s left'
    """
    share = f"{progress.done / progress.total:.0%} done" if progress.done and progress.total else ""
    gap = "" if progress.gap is None else f"gap at most {progress.gap:.1%}"
    known = ", ".join(filter(None, (share, progress.best, gap, duration)))
    return f"{progress.what}: {known}" if known else progress.what


def time_text(elapsed: float, left: float | None = None) -> str:
    """Return the seconds that work will still take, or those that it has taken if its length is not known."""
    return f"{duration_text(elapsed)} elapsed" if left is None else f"{duration_text(left)} left"


class Pace:
    """Estimate of the remaining time of counted work from its reports, separately for each count of units.

    Attributes
    ----------
    first : Progress or None
        First report of the current count.
    began : float, seconds
        Time of that report.
    seconds_left : float or None
        Remaining time; None if the work is not counted, or no unit has been finished yet.
    """

    def __init__(self) -> None:
        self.first: Progress | None = None
        self.began = 0.0
        self.seconds_left: float | None = None
        self._done = 0

    def note(self, progress: Progress, now: float) -> None:
        """Update the estimate with a report.

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


def reporter(show: Callable[[Progress, str], None], interval: float) -> Callable[[Progress], None]:
    """Return a callable for `finish` that shows progress as often as a user reads it.

    Parameters
    ----------
    show : callable
        Called with the progress and its `time_text` whenever a search has found a better value, and otherwise when the
        interval has passed since the last call.
    interval : float, seconds
    """
    start = shown = time.monotonic()
    best = ""
    pace = Pace()

    def report(progress: Progress) -> None:
        nonlocal shown, best
        now = time.monotonic()
        pace.note(progress, now)
        if progress.best not in {"", best} or now - shown >= interval:
            shown, best = now, progress.best or best
            show(progress, time_text(now - start, pace.seconds_left))

    return report


def finish(steps: Generator[Progress, None, Result], report: Callable[[Progress], object] | None = None) -> Result:
    """Run work to its end, calling ``report`` at each step, and return its result.

    The work is closed if ``report`` raises, so that it leaves no files and no child processes.

    Examples
    --------
    >>> def total(prices):
    ...     for done in range(len(prices)):
    ...         yield Progress(done, len(prices), "adding")
    ...     return sum(prices)
    >>> finish(total([4_000, 8_000]), report=lambda progress: print(progress.done, "of", progress.total))
    0 of 2
    1 of 2
    12000
    """
    with closing(steps):
        while True:
            try:
                progress = next(steps)
            except StopIteration as stop:
                result: Result = stop.value
                return result
            if report is not None:
                report(progress)


def altered(
    steps: Generator[Progress, None, Result], alter: Callable[[Progress], Progress]
) -> Generator[Progress, None, Result]:
    """Run work, and yield what ``alter`` makes of its progress."""
    with closing(steps):
        while True:
            try:
                step = next(steps)
            except StopIteration as stop:
                result: Result = stop.value
                return result
            yield alter(step)


def within(whole: Progress, steps: Generator[Progress, None, Result]) -> Generator[Progress, None, Result]:
    """Run work as one unit of a larger whole: each step yields the progress of the whole, with the best placement."""
    return altered(steps, lambda step: replace(whole, best=step.best, poses=step.poses, gap=step.gap))


def in_thread(
    work: Callable[[threading.Event], Result], what: str | Callable[[], Progress]
) -> Generator[Progress, None, Result]:
    """Run work that cannot yield, such as a call of a library, in a separate thread.

    Parameters
    ----------
    work : callable
        Function to call with an event. When the event is set, the result is not needed any more and it should return.
    what : str or callable
        Description of the work, or a function that returns its progress.

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
        except BaseException as error:  # noqa: BLE001 -- raised again by `result.result()`
            result.set_exception(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        while thread.is_alive():
            thread.join(REPORT_INTERVAL)
            yield Progress(0, 0, what) if isinstance(what, str) else what()
        return result.result()
    finally:
        stop.set()


def each_in_threads(
    compute: Callable[[Item], None], items: Sequence[Item], threads: int, what: str
) -> Generator[Progress, None, None]:
    """Call a function for each item, several at once; closing the generator cancels calls that have not started."""
    pool = ThreadPoolExecutor(threads)
    calls = [pool.submit(compute, item) for item in items]
    try:
        for done, call in enumerate(calls):
            while not wait([call], REPORT_INTERVAL).done:  # so that the caller can close soon
                yield Progress(done, len(items), what)
            call.result()
            yield Progress(done, len(items), what)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
    yield Progress(len(items), len(items), what)
