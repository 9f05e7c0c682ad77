"""Remaining budget of a search, in seconds or in units of counted work."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field

from ...acceptance import Acceptance
from ...errors import SeipError

OPERATIONS_PER_UNIT = 1e10  # multiplications that make a unit of work: about a second of one processor core
OVERHEAD_OPERATIONS = 3e6  # multiplications that take as long as what goes on around each counted step
DEFAULT_EFFORT = 60.0  # units of work of a search without other limits
MIN_PART = 0.01  # least part of a limit, seconds or units of work, even where nothing is left


@dataclass(frozen=True)
class SolverLimits:
    """Solver of integer programs, and the limits of a search for a placement.

    At a limit, the best placement found is returned with its bound and gap.

    Parameters
    ----------
    solver : str
        ``highs``, ``cbc`` or ``gurobi``.
    time_limit : float, seconds, optional
        Limit of wall time. What is found and proven then depends on the machine and on what else runs on it.
    effort : float, units of work, optional
        Limit of counted work, about a second of one processor core for each unit. The same inputs give the same
        result on every machine. Default: `DEFAULT_EFFORT`, or no limit where there is a time limit.
    acceptance : Acceptance, optional
        User's request to end the search early.

    Examples
    --------
    >>> clock = SolverLimits(effort=2.0).clock()
    >>> clock.spend(0.5 * OPERATIONS_PER_UNIT)
    >>> round(clock.left, 1), round(clock.part(0.6).left, 1)
    (1.5, 0.6)
    """

    solver: str = "highs"
    time_limit: float | None = None
    effort: float | None = None
    acceptance: Acceptance | None = field(default=None, compare=False, repr=False)

    @property
    def work(self) -> float:
        """Limit of counted work, infinite where only time is limited."""
        if self.effort is not None:
            return self.effort
        return DEFAULT_EFFORT if self.time_limit is None else math.inf

    def clock(self) -> Clock:
        """Return a clock that starts now.

        Raises
        ------
        SeipError
            A limit is not a positive number.
        """
        if self.acceptance is not None:
            self.acceptance.searching = True
        limit = math.inf if self.time_limit is None else self.time_limit
        return Clock(limit, self.work, acceptance=self.acceptance)


DEFAULT_LIMITS = SolverLimits()


class Clock:
    """Limits of a search: of time from now on, and of counted work, which is the same on every machine.

    Where work is limited, shares of what is left are shares of work: as long as the time suffices, results do not
    depend on the speed of the machine.

    Parameters
    ----------
    limit : float, seconds
        Limit of wall time; may be infinite.
    effort : float, units of work
        Limit of counted work, about one second of one processor core for each unit; may be infinite.
    whole : Clock, optional
        Clock of which this is a part: work spent here is spent there as well.
    acceptance : Acceptance, optional
        User's request to end the search; once it is accepted, nothing is left.

    Attributes
    ----------
    work : float
        Units of work done.

    Raises
    ------
    SeipError
        A limit is not a positive number.
    """

    def __init__(
        self,
        limit: float,
        effort: float = math.inf,
        whole: Clock | None = None,
        acceptance: Acceptance | None = None,
    ) -> None:
        if math.isnan(limit) or limit <= 0:
            raise SeipError(f"the time limit is {limit:g} s; give a positive number of seconds")
        if math.isnan(effort) or effort <= 0:
            raise SeipError(f"the effort is {effort:g} units of work; give a positive number")
        self._start = time.perf_counter()
        self._limit = limit
        self._effort = effort
        self._whole = whole
        self.acceptance = acceptance
        self.work = 0.0

    def spend(self, operations: float) -> None:
        """Record a step of ``operations`` multiplications as work."""
        self.work += (operations + OVERHEAD_OPERATIONS) / OPERATIONS_PER_UNIT
        if self._whole is not None:
            self._whole.spend(operations)

    def part(self, most: float, least: float = MIN_PART) -> Clock:
        """Return a clock for a part of this limit, in the same measure; what is spent there is spent here."""
        share = max(min(most, self.left), least)
        if self.counts_work:
            return Clock(max(self.seconds_left, least), share, self, self.acceptance)
        return Clock(share, whole=self, acceptance=self.acceptance)

    @property
    def counts_work(self) -> bool:
        """Whether work is limited."""
        return math.isfinite(self._effort)

    @property
    def seconds(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self._start

    @property
    def seconds_left(self) -> float:
        """Seconds until the limit of time, negative after it, or once the user has accepted what was found."""
        if self.acceptance is not None and self.acceptance.accepted:
            return -1.0
        return self._limit - self.seconds

    @property
    def elapsed(self) -> float:
        """Seconds since the start, or units of work where these are limited."""
        return self.work if self.counts_work else self.seconds

    @property
    def left(self) -> float:
        """Seconds or units of work until the limit, negative after it."""
        return min(self.seconds_left, self._effort - self.work)
