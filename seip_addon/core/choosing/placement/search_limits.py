"""Limits of a search, in units of counted work."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ...base.acceptance import Acceptance
from ...base.errors import SeipError

OPERATIONS_PER_UNIT = 2.5e9  # multiplications that make a unit of work: about a second of one processor core
OVERHEAD_OPERATIONS = 6e5  # multiplications that take as long as what goes on around each counted step
DEFAULT_EFFORT = 8.0  # units of work of a search


@dataclass(frozen=True)
class SolverLimits:
    """Solver of integer programs, and the limit of a search for a placement.

    At the limit, the best placement found is returned with its bound and gap.

    Parameters
    ----------
    solver : str
        ``auto``, ``highs``, ``cbc`` or ``gurobi``.
    effort : float, units of work
        Limit of counted work, about a second of one processor core for each unit. The same inputs give the same
        result on every machine.
    acceptance : Acceptance, optional
        User's request to end the search early.

    Raises
    ------
    SeipError
        The effort is not a positive number.

    Examples
    --------
    >>> work = SolverLimits(effort=2.0).work()
    >>> work.spend(0.5 * OPERATIONS_PER_UNIT)
    >>> round(work.left, 1), round(work.part(0.6).left, 1)
    (1.5, 0.6)
    """

    solver: str = "auto"
    effort: float = DEFAULT_EFFORT
    acceptance: Acceptance | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if math.isnan(self.effort) or self.effort <= 0:
            raise SeipError(f"the effort is {self.effort:g} units of work; give a positive number")

    def work(self) -> Work:
        """Return the work of a search that begins now."""
        if self.acceptance is not None:
            self.acceptance.searching = True
        return Work(self.effort, self.acceptance)


DEFAULT_LIMITS = SolverLimits()


class Work:
    """Counted work of a search, which is the same on every machine.

    Parameters
    ----------
    effort : float, units of work
        Limit; may be infinite.
    acceptance : Acceptance, optional
        User's request to end the search; once it is accepted, nothing is left.
    whole : Work, optional
        Work of which this is a part: what is spent here is spent there as well.

    Attributes
    ----------
    done : float
        Units of work done.
    """

    def __init__(self, effort: float, acceptance: Acceptance | None = None, whole: Work | None = None) -> None:
        self._effort, self._acceptance, self._whole = effort, acceptance, whole
        self.done = 0.0

    def spend(self, operations: float) -> None:
        """Record a step of ``operations`` multiplications."""
        self.done += (operations + OVERHEAD_OPERATIONS) / OPERATIONS_PER_UNIT
        if self._whole is not None:
            self._whole.spend(operations)

    def part(self, most: float) -> Work:
        """Return a part of what is left."""
        return Work(min(most, self.left), self._acceptance, self)

    def end(self) -> None:
        """Leave nothing of this part."""
        self._effort = min(self._effort, self.done)

    @property
    def left(self) -> float:
        """Units of work until the limit, negative after it or once the user has accepted what was found."""
        if self._acceptance is not None and self._acceptance.accepted:
            return -1.0
        return self._effort - self.done
