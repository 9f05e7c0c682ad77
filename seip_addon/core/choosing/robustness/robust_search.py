r"""Best placement under risk: branch and bound on an objective bounded by a multi-cover.

The bounding function depends on the number of sensors that see a target: with p in P (`risk`),

.. math::
    F(S) = \sum_k p_k \sum_j w_j\, φ(n_{jk}(S)) \ge T(S),

where φ is the value of a target by that number (`placement.multi_cover`). A set S with :math:`T(S) \ge g` has
:math:`F(S) \ge g` as well. So branches in which F cannot reach the best T so far are cut
(`placement.branch_and_bound`), and T itself is computed for every set that is left.

An instance here has the targets of all scenarios. Its weights are whole numbers, and its objective value is F in whole
units.
"""

import math
from collections.abc import Callable

import numpy as np

from ...arrays import Integer
from ..placement.bounds import Bound
from ..placement.branch_and_bound import Search
from ..placement.reduced_problem import Instance


class BestUnderRisk(Search):
    """Search for the placement of largest T.

    Parameters
    ----------
    unit : float
        Unit of F: F divided by it bounds T.
    evaluate : callable
        Function that returns T of candidates of the instance.
    chosen : (k,) int64
        Placement to begin from.
    slack : float
        Largest difference between equal values of T.
    root : (n,) int64 and Bound
        Candidates that a placement as good as ``chosen`` may contain, and an upper bound on the F of placements of
        these.

    Attributes
    ----------
    best : (k,) int64
        Best placement so far.
    value : float
        T of the best placement so far. Of equally good ones, which are those within ``slack`` of the largest T, it is
        the one with fewest sensors, then the cheapest, then the first in the order of candidates.
    """

    def __init__(
        self,
        instance: Instance,
        unit: float,
        evaluate: Callable[[Integer], float],
        chosen: Integer,
        slack: float,
        root: tuple[Integer, Bound],
    ) -> None:
        super().__init__(instance, 0.0, root=root)
        self._unit, self._evaluate, self._slack = unit, evaluate, slack
        self._highest = root[1].value
        self._front: list[tuple[float, tuple[int, float, list[int]], Integer]] = []
        self._keep(np.sort(chosen), evaluate(chosen))

    @property
    def bound(self) -> float:
        """Upper bound on the T of any placement."""
        return max(self.value, min(super().bound, self._highest) / self._unit)

    def _take(self, placement: Integer) -> float:
        if self.instance.feasible(placement):
            self._keep(placement, self._evaluate(placement))
        return self.goal

    def _keep(self, placement: Integer, value: float) -> None:
        """Keep the Pareto front of placements in T and rank; the best placement is in it."""
        # Of placements within the slack of the largest T the one of best rank is the result. As the largest T may still
        # rise, a placement of better rank may drop out later: the next best ones must be kept until then.
        rank = self._rank(placement)
        if any(kept >= value and better <= rank for kept, better, _ in self._front):
            return
        front = [one for one in self._front if one[0] > value or one[1] < rank]
        least = max([value, *(kept for kept, _, _ in front)]) - self._slack
        self._front = [one for one in [*front, (value, rank, placement)] if one[0] >= least]
        self.value, _, self.best = min(self._front, key=lambda one: one[1])
        self.goal = least * self._unit

    def _rank(self, chosen: Integer) -> tuple[int, float, list[int]]:
        return len(chosen), round(math.fsum(self.instance.price[chosen]), 6), chosen.tolist()
