"""Progress of long work, as values yielded by generators.

Long loops of the core are generators that yield `Progress` and return their
result: a modal operator steps them, a batch command shows a bar, a test
exhausts them with `finish`.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TypeVar

Result = TypeVar("Result")


@dataclass(frozen=True)
class Progress:
    """How far a piece of work has come.

    Parameters
    ----------
    done, total : int
        Finished and all units of work, ``0 <= done <= total``.
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
