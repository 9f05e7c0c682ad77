"""How much of a time limit is left."""

from __future__ import annotations

import math
import time

from ..errors import SeipError


class Clock:
    """A time limit that starts now.

    Parameters
    ----------
    limit : float, seconds
        May be infinite.

    Raises
    ------
    SeipError
        The limit is no positive number.
    """

    def __init__(self, limit: float) -> None:
        if math.isnan(limit) or limit <= 0:
            raise SeipError(f"the time limit is {limit:g} s; give a positive number of seconds")
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
