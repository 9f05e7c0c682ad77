"""Progress of long work, as values yielded by generators.

Long loops of the core are generators that yield `Progress` and return their
result: a modal operator steps them, a batch command shows a bar, a test
exhausts them with `finish`.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator
from concurrent.futures import Future
from dataclasses import dataclass
from typing import TypeVar

Result = TypeVar("Result")

PAUSE = 0.1
"""Seconds between the reports of work in a thread."""


@dataclass(frozen=True)
class Progress:
    """How far a piece of work has come.

    Parameters
    ----------
    done, total : int
        Finished and all units of work, ``0 <= done <= total``; a total of 0 means that it is not known.
    what : str
        What is being worked on, for the person who waits.
    """

    done: int
    total: int
    what: str


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


def in_thread(work: Callable[[threading.Event], Result], what: str) -> Generator[Progress, None, Result]:
    """Run work that cannot yield, such as a call of a library, in a thread of its own.

    Parameters
    ----------
    work : callable
        Called with an event; once that is set nobody waits for the result, and the sooner it returns the better.
    what : str
        What is being worked on.

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
            thread.join(PAUSE)
            yield Progress(0, 0, what)
        return result.result()
    finally:
        stop.set()
