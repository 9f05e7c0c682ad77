"""Progress of long work, as values yielded by generators.

Long loops of the core are generators that yield `Progress` and return their result: a modal operator steps them, a
batch command shows a bar, a test exhausts them with `finish`.
"""

import threading
from collections.abc import Callable, Generator
from concurrent.futures import Future
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
        Number of finished and of all units of work, ``0 <= done <= total``; a total of 0 means that it is not known.
    what : str
        Description of the current work for the user.
    counted : bool
        Whether all units take about the same time, so that the remaining time follows from their number; false for
        stages of work. A search, which may end at any step, has a total of 0.
    best : str
        Best value that a search has found so far, in the words of the answer: "71% of the road"; "" before the first.
    gap : float or None
        Largest share by which a better value is still possible; None without a bound.
    """

    done: int
    total: int
    what: str
    counted: bool = True
    best: str = ""
    gap: float | None = None


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


def finish(steps: Generator[Progress, None, Result], report: Callable[[Progress], object] | None = None) -> Result:
    """Run work to its end, calling ``report`` at each step, and return its result.

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
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            result: Result = stop.value
            return result
        if report is not None:
            report(progress)


def within(whole: Progress, steps: Generator[Progress, None, Result]) -> Generator[Progress, None, Result]:
    """Run work as one unit of a larger whole, yielding the progress of the whole at each step."""
    while True:
        try:
            next(steps)
        except StopIteration as stop:
            result: Result = stop.value
            return result
        yield whole


def in_thread(work: Callable[[threading.Event], Result], what: str) -> Generator[Progress, None, Result]:
    """Run work that cannot yield, such as a call of a library, in a separate thread.

    Parameters
    ----------
    work : callable
        Function to call with an event. When the event is set, the result is not needed any more and it should return.

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
            yield Progress(0, 0, what)
        return result.result()
    finally:
        stop.set()
