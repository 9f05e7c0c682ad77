r"""Best placement under risk: local searches and branch and bound on an objective bounded by a multi-cover.

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
from collections.abc import Callable, Generator

import numpy as np

from ...arrays import Integer
from ...progress import Progress
from ..placement.bounds import Bound
from ..placement.branch_and_bound import Search
from ..placement.greedy import addable, swap_gains, swap_search
from ..placement.reduced_problem import Instance
from ..placement.search_limits import Clock

STARTING_PAIRS, MAX_FIRST_CANDIDATES = 8, 100
"""Number of starting pairs if a single sensor gains nothing, and of candidates that may be the first of a pair."""

SWAPS_TRIED = 24  # number of swaps of each sensor for which T is computed: those with the largest F


def swap_search_from_pairs(
    instance: Instance, start: Integer, best: Integer, clock: Clock
) -> Generator[Progress, None, Integer]:
    """Swap sensors from the pairs that see most together, for part of the time; return the best placement.

    If targets must be seen twice, a single sensor adds nothing. The first one is then a guess, and swaps of single
    sensors do not lead from every guess to the best placement.
    """
    time, value = clock.left, instance.value(best)
    for pair in _best_pairs(instance, start):
        if clock.left < 0.75 * time:
            break
        chosen = yield from swap_search(instance, np.append(start, pair))
        if instance.value(chosen) > value:
            best, value = chosen, instance.value(chosen)
    return best


def _best_pairs(instance: Instance, start: Integer) -> list[list[int]]:
    """Return pairs that can join the start, those that see most together first; no candidate is in two of them."""
    seen = instance.gains(instance.weight)
    seen[~addable(instance, start)] = 0.0
    first = np.argsort(-seen, kind="stable")[: min(MAX_FIRST_CANDIDATES, np.count_nonzero(seen))]
    together = (instance.matrix[first] * instance.weight.astype(instance.matrix.dtype)) @ instance.matrix.T
    together[instance.conflict[first] | (seen == 0) | (first[:, None] == np.arange(len(instance)))] = 0.0
    pairs: list[list[int]] = []
    while len(pairs) < STARTING_PAIRS and together.any():
        row, other = np.unravel_index(int(np.argmax(together)), together.shape)
        pair = [int(first[row]), int(other)]
        together[np.isin(first, pair)] = 0.0
        together[:, pair] = 0.0
        if addable(instance, np.append(start, pair[0]))[pair[1]]:
            pairs.append(pair)
    return pairs


def swap_search_by_risk(
    instance: Instance, evaluate: Callable[[Integer], float], chosen: Integer
) -> Generator[Progress, None, Integer]:
    """Swap sensors for as long as T grows; for each sensor, the swaps with the largest F are tried."""
    value = evaluate(chosen)
    while len(chosen) > 0:
        yield Progress(0, 0, "swapping sensors")
        rivals = [
            np.sort(np.append(chosen[chosen != gone], new))
            for gone, row in zip(chosen, swap_gains(instance, chosen), strict=True)
            for new in np.argsort(-row, kind="stable")[:SWAPS_TRIED]
            if math.isfinite(row[new])
        ]
        reached = [evaluate(rival) for rival in rivals]
        if not rivals or max(reached) <= value:
            break
        value = max(reached)
        chosen = rivals[reached.index(value)]
    return chosen


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
