"""A plain search for placements: greedy, swaps, and restarts. A solver must not be worse in the same time."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from tests.oracles.placement_faults import LEAST_EXCESS, Boolean, Float, PlacementCase


class Found(NamedTuple):
    """A placement that is better than those before, and the processor seconds until then."""

    value: float
    chosen: list[int]
    seconds: float


def plain_search(case: PlacementCase, seconds: float | None = None, restarts: int = 10) -> Iterator[Found]:
    """Yield ever better placements under a number, a budget and exclusions; required groups are not considered.

    A choice grows by the largest gain, and once more by the largest gain per price if there is a budget. Then the best
    of all swaps follows until none helps; sensors are added wherever there is room. Each restart keeps a random half of
    the best placement, every other one with a random candidate beside it.

    Parameters
    ----------
    seconds : float, optional
        Processor seconds after which no further restart begins; they replace the number of restarts.
    """
    start, search, random = time.process_time(), _Swaps(case), np.random.default_rng(0)
    best, begun, priced = Found(-math.inf, [], 0.0), 0, math.isfinite(case.budget)
    while begun < 1 + priced + restarts if seconds is None else begun < 1 + priced or _since(start) < seconds:
        kept = []
        if begun > priced:
            kept = random.permutation(best.chosen)[: (len(best.chosen) + 1) // 2].tolist()
            kept = search.with_one(kept, int(random.integers(len(case.prices)))) if begun % 2 else kept
        chosen = search.improved(kept, per_price=priced and begun % 4 in {1, 2})
        value, begun = case.value(chosen), begun + 1
        if value > best.value:
            best = Found(value, chosen, _since(start))
            yield best


def _since(start: float) -> float:
    return time.process_time() - start


class _Swaps:
    """Gains of all candidates at once: one matrix product for coverage, one array of logarithms for returns.

    They are in single precision, the values of placements in double precision.
    """

    def __init__(self, case: PlacementCase) -> None:
        self.case, self.conflict = case, case.conflict()
        self.amounts, self.weights = case.amounts.astype(np.float32), case.weights.astype(np.float32)
        self.parts = np.array_split(self.amounts, range(16, len(self.amounts), 16))  # a cache holds one

    def with_one(self, chosen: list[int], candidate: int) -> list[int]:
        """Return a choice with a candidate more, if that is allowed."""
        fits = self._fits(chosen, np.ones((1, len(chosen)), bool))[0, candidate]
        return [*chosen, candidate] if fits and self._has_room(chosen) else chosen

    def _has_room(self, chosen: list[int]) -> bool:
        return self.case.count is None or len(chosen) < self.case.count

    def improved(self, chosen: list[int], *, per_price: bool) -> list[int]:
        case = self.case
        while True:
            base, value = case.amounts[chosen].sum(axis=0, dtype=np.float64), case.value(chosen)
            least = 1e-6 * abs(value)
            if self._has_room(chosen):
                gain = self._values(base[None], chosen, np.ones((1, len(chosen)), bool))[0] - value
                ratio = np.where(gain > least, gain / case.prices if per_price else gain, -math.inf)
                if ratio.max() > 0:
                    chosen = [*chosen, int(np.argmax(ratio))]
                    continue
            swapped = self._values(base - case.amounts[chosen], chosen, ~np.eye(len(chosen), dtype=bool))
            if not chosen or swapped.max() <= value + least:
                return chosen
            out, pick = np.unravel_index(int(np.argmax(swapped)), swapped.shape)
            before, chosen = chosen, [*chosen[:out], *chosen[out + 1 :], int(pick)]
            if case.value(chosen) <= value:  # better in single precision only
                return before

    def _values(self, bases: Float, chosen: list[int], kept: Boolean) -> Float:
        """Return the value of each candidate on top of each base, -inf where it does not fit, (b, c)."""
        case = self.case
        if case.logarithm:
            sums = 1 + bases.astype(np.float32)
            values = np.concatenate([np.log(one + part) @ self.weights for one in sums for part in self.parts])
        else:
            values = (~(bases >= 1) * self.weights) @ self.amounts.T + (bases >= 1) @ self.weights[:, None]
        return np.where(self._fits(chosen, kept), values.reshape(len(bases), -1), -math.inf)

    def _fits(self, chosen: list[int], kept: Boolean) -> Boolean:
        """Return which candidates each kept part of a choice leaves room for, (b, c)."""
        price = (kept @ self.case.prices[chosen])[:, None] + self.case.prices
        return ~(kept @ self.conflict[chosen] | self.case.forbidden) & (price <= self.case.budget * LEAST_EXCESS)
