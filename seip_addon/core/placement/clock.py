"""How much of a time limit is left."""

from __future__ import annotations

import time


class Clock:
    """A time limit that starts now.

    Parameters
    ----------
    limit : float, seconds
    """

    def __init__(self, limit: float) -> None:
        self._start = time.perf_counter()
        self._limit = limit

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self._start

    @property
    def left(self) -> float:
        """Seconds until the limit, negative after it."""
        return self._limit - self.elapsed
