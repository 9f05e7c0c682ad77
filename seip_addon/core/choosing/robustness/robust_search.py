r"""Best placement under risk: local searches and branch and bound on an objective bounded by a multi-cover.

The bounding function counts what sees a target: with p in P (`risk`),

.. math::
    F(S) = \sum_k p_k \sum_j w_j\, φ(n_{jk}(S)) \ge T(S),

φ being the value of a target by the number of sensors that see it (`placement.multi_cover`). A set S
with :math:`T(S) \ge g` has :math:`F(S) \ge g` as well: branches that cannot bring F to the best T so
far are cut (`placement.branch_and_bound`), and T itself is computed for every set that is left.

An instance is here one of all scenarios' targets, whose weights are whole numbers and whose objective
value is F in whole units.
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
"""Starting pairs where a single sensor gains nothing, and candidates that may be the first of a pair."""

SWAPS_TRIED = 24  # swaps of a sensor for which T is computed, those with the largest F


def swap_search_from_pairs(
    instance: Instance, start: Integer, best: Integer, clock: Clock
) -> Generator[Progress, None, Integer]:
    """Swap sensors from pairs that see most together, for part of the time; the best so far, if none is better.

    One sensor alone adds nothing where a target must be seen twice: who is added first is a guess, and swaps of
    single sensors do not lead from every guess to the best.
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
    """Return pairs that can join the start, no candidate in two of them, those that see most together first."""
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
    """Swap sensors for as long as T grows, trying of each sensor's swaps those with the largest F."""
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
    """Finds the placement of largest T.

    Parameters
    ----------
    unit : float
        F in these units is what T is bounded by.
    evaluate : callable
        Returns T of candidates of the instance.
    chosen : (k,) int64
        A placement to begin from.
    slack : float
        Values of T that differ by no more count as equal.
    root : (n,) int64 and Bound
        Candidates that a placement as good as ``chosen`` may contain, and a bound on what placements of these reach.

    Attributes
    ----------
    best : (k,) int64
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
        """No placement has a larger T."""
        return max(self.value, min(super().bound, self._highest) / self._unit)

    def _take(self, placement: Integer) -> float:
        if self.instance.feasible(placement):
            self._keep(placement, self._evaluate(placement))
        return self.goal

    def _keep(self, placement: Integer, value: float) -> None:
        """Keep the placements of which none other has both a larger T and a better rank; the best is among them."""
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
