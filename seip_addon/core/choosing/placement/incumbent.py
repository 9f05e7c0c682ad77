"""The best placement of a search so far, with its bound and the work that is left."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ...base.arrays import Integer
from ...base.progress import Progress
from .instance import Instance
from .search_limits import Work


class Incumbent:
    """The best feasible placement so far, which all algorithms share.

    Parameters
    ----------
    instance : Instance
    work : Work
        Limit of the search.
    describe : callable, optional
        Description for the user, such as "71% of the road", of candidates of the problem and their objective value.
    goal : float
        Value that only is of interest: the search ends once it is reached.

    Attributes
    ----------
    chosen : (k,) int64
        Candidates of the instance, ascending.
    value : float
        Objective value; minus infinity while there is no feasible placement.
    bound : float
        Upper bound on the value of any placement.
    """

    def __init__(
        self,
        instance: Instance,
        work: Work,
        describe: Callable[[Integer, float], str] | None = None,
        goal: float = -math.inf,
    ) -> None:
        self.instance, self.work = instance, work
        self._describe, self.goal = describe, goal
        self.chosen: Integer = np.zeros(0, dtype=np.int64)
        self.value, self.bound = -math.inf, math.inf
        self._best = ""
        self._poses: tuple[int, ...] = ()

    @property
    def least_better(self) -> float:
        """Least value of a better placement: lower bounds than this are proof enough."""
        return max(self.value + self.instance.step, self.goal)

    def close(self) -> None:
        """Record that no placement is better."""
        self.bound = max(self.value, self.least_better - self.instance.step)

    def offer(self, chosen: Integer) -> None:
        """Take a placement if it is feasible and of a larger value, or as good with fewer or cheaper sensors."""
        chosen = np.sort(np.asarray(chosen, dtype=np.int64))
        if not self.instance.feasible(chosen):
            return
        value = self.instance.value(chosen)
        if value <= self.value + self.instance.slack and not (
            value >= self.value and self._effort(chosen) < self._effort(self.chosen)
        ):
            return
        self.chosen, self.value = chosen, value
        if value >= self.goal > -math.inf:
            self.work.end()
        if self._describe is not None:
            poses = self.instance.original[chosen]
            self._best, self._poses = self._describe(poses, value * self.instance.unit), tuple(poses.tolist())

    @property
    def proven(self) -> bool:
        """Whether no placement is better."""
        return self.bound < self.least_better

    @property
    def gap(self) -> float:
        """Gap of the best placement so far; infinite while there is no bound."""
        if not (math.isfinite(self.bound) and math.isfinite(self.value)):
            return math.inf
        block = self.instance.blocks[0]
        return block.g.gap(self.value, max(self.value, self.bound), float(block.weight.sum()))

    def progress(self, phase: str) -> Progress:
        """Return the progress of a phase, with the best placement so far and its gap."""
        gap = self.gap if math.isfinite(self.gap) else None
        return Progress(0, 0, phase, best=self._best, poses=self._poses, gap=gap)

    def _effort(self, chosen: Integer) -> tuple[int, float]:
        return len(chosen), math.fsum(self.instance.price[chosen])
