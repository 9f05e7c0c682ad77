"""A user's request, from another thread, to end a search early."""

import threading
from collections.abc import Generator
from contextlib import closing
from typing import TypeVar

from .progress import Progress

Result = TypeVar("Result")


class Acceptance:
    """A request, from another thread, to end a search with the best placement found so far.

    Attributes
    ----------
    searching : bool
        Whether the search has begun, so that there is something to accept.
    """

    def __init__(self) -> None:
        self._event = threading.Event()
        self.searching = False

    def accept(self) -> None:
        """End the search at its next step."""
        self._event.set()

    @property
    def accepted(self) -> bool:
        """Whether the search is to end."""
        return self._event.is_set()


def until_accepted(
    steps: Generator[Progress, None, Result], acceptance: Acceptance | None, otherwise: Result
) -> Generator[Progress, None, Result]:
    """Run work that a result can be without, and return ``otherwise`` in its place once the user has accepted."""
    with closing(steps):
        while acceptance is None or not acceptance.accepted:
            try:
                step = next(steps)
            except StopIteration as stop:
                result: Result = stop.value
                return result
            yield step
    return otherwise
