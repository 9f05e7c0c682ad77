"""A user's request, from another thread, to end a search early."""

import threading


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
