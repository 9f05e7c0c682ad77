"""Search for the best allocation of a budget to sites, which solves a site only where a decision depends on it."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np

from ...base.arrays import Float
from ...base.progress import Progress, in_thread
from ..placement.concave import relative_gap
from ..placement.problem import TIE_TOLERANCE
from .allocation import Allocation, allocate, allocation_of, relaxed_allocation
from .frontier import Frontier, Options, SolvedBudget

Result = TypeVar("Result")

FIRST_EFFORT, LAST_EFFORT, GROWTH = 0.25, 64.0, 4.0
"""Counted work of the first and the last search of a budget at a site, and the factor from one to the next."""
FIRST_SENSORS = (1, 2, 4)
"""Numbers of sensors whose money is solved at every site before any allocation."""


MANY_SITES = 30
"""Number of sites from which rounds use the linear relaxation: the integer program takes a second for 100 sites. With
few sites it is fast, and spares searches of amounts that only a mixture of alternatives takes."""
EXACT_SITES = 1000
"""Largest number of sites for which the integer program is solved at all: six budgets took half a minute at 1,000
random sites, and more than three minutes at 3,000. Beyond, the relaxation stands for it to the end: it takes several
alternatives of one site at most, so that rounding it down loses less than that site is worth."""


@dataclass(frozen=True)
class Request:
    """Request to solve a budget at a site.

    Parameters
    ----------
    site : int
    budget : float, dollars
    effort : float, units of counted work
    """

    site: int
    budget: float
    effort: float


Solve = Callable[[Sequence[Request]], Generator[Progress, None, Sequence[SolvedBudget]]]
"""Solves requests, in any order, and returns their results in the order of the requests."""

Gap = Callable[[float, float], float]
"""Gap of a value to its bound."""


@dataclass(frozen=True, eq=False)
class NetworkAllocation:
    """Allocation of a budget with its bound.

    Parameters
    ----------
    budget : float, dollars
    taken : tuple of SolvedBudget
        Placement at each site.
    price : float, dollars
    value, bound : float
        Sum over the sites of weight times value, and the largest such sum that is not excluded.
    frontiers : tuple of Frontier
        Frontiers of the sites as they are known after the search.
    """

    budget: float
    taken: tuple[SolvedBudget, ...]
    price: float
    value: float
    bound: float
    frontiers: tuple[Frontier, ...]


def search_allocation(
    frontiers: Sequence[Frontier],
    weights: Float,
    budget: float,
    tolerance: float,
    solve: Solve,
    *,
    gap: Gap = relative_gap,
) -> Generator[Progress, None, NetworkAllocation]:
    """Allocate a budget to sites until its bound is within a tolerance of its value.

    Before the first round each site is solved for the money of one sensor, two, four and all. Each round allocates the
    budget twice: once among the placements found, which gives a value that is reached, and once among the bounds of all
    amounts of money, which gives a value that no allocation exceeds. Where the second takes an amount that has not been
    solved, it is solved, together with the one in the middle below the next solved one; where all it takes have been
    solved, those whose own gaps are largest are searched longer. With many sites the linear relaxation stands for the
    integer program as long as it takes amounts that have not been solved.

    Parameters
    ----------
    frontiers : sequence of Frontier
    weights : (s,) float64
        Importance of each site.
    budget : float, dollars
    tolerance : float
        Gap at which the search ends.
    solve : callable
        Solves budgets at sites.
    gap : callable
        Gap between the value of an allocation and its bound.
    """
    known = list(frontiers)
    requests = _first_requests(known, budget)
    while requests:
        known = yield from _solved(known, requests, solve)
        requests, reached = [], math.inf
        if len(known) >= MANY_SITES:
            requests, reached = yield from _reporting(partial(_relaxed_round, known, weights, budget, gap))
        if not requests and reached > tolerance:
            exact = yield from _reporting(partial(_Round, known, weights, budget))
            requests, reached = exact.requests(), exact.gap(gap)
        if reached <= tolerance:
            break
    return (yield from _reporting(partial(_Round, known, weights, budget))).allocation()


def _reporting(work: Callable[[], Result]) -> Generator[Progress, None, Result]:
    """Return the result of a function, and go on reporting: with many sites its programs take half a minute."""
    return in_thread(lambda _: work(), "allocating the money")


def _relaxed_round(known: Sequence[Frontier], weights: Float, budget: float, gap: Gap) -> tuple[list[Request], float]:
    """Return the amounts to solve next by the linear relaxation, and a gap that is not below that of `_Round`.

    There are no requests if it takes solved amounts only.
    """
    bounding, found = ([getattr(one, name)() for one in known] for name in ("bounding_options", "found_options"))
    upper, among_found = (relaxed_allocation(options, weights, budget) for options in (bounding, found))
    lower = allocation_of(found, weights, [parts[0] for parts in among_found.taken])
    amounts = [each.index[list(parts)].tolist() for each, parts in zip(bounding, upper.taken, strict=True)]
    return _unsolved(known, amounts, budget), gap(lower.value, max(lower.value, upper.value))


def _allocations(options: Sequence[Options], weights: Float, budget: float) -> tuple[Allocation, Allocation]:
    """Return an allocation whose value no other exceeds, and one within the budget: the best one if sites are few."""
    if len(options) <= EXACT_SITES:
        best = allocate(options, weights, budget)
        return best, best
    relaxed = relaxed_allocation(options, weights, budget)
    lower = allocation_of(options, weights, [parts[0] for parts in relaxed.taken])
    return replace(lower, value=max(lower.value, relaxed.value)), lower


class _Round:
    """Allocations of a budget from what is known of the sites: among placements found, and among bounds."""

    def __init__(self, known: Sequence[Frontier], weights: Float, budget: float) -> None:
        self._known, self._weights, self._budget = known, weights, budget
        self._bounding = [one.bounding_options() for one in known]
        self._upper, _ = _allocations(self._bounding, weights, budget)
        self._found = [one.found_options() for one in known]
        _, self._lower = _allocations(self._found, weights, budget)

    def gap(self, gap: Gap) -> float:
        """Return the gap between the two."""
        return gap(self._lower.value, max(self._lower.value, self._upper.value))

    def requests(self) -> list[Request]:
        """Return what to solve next: amounts that the bound takes without a search, otherwise those with a gap."""
        known, bounding, taken = self._known, self._bounding, self._upper.taken
        amounts = [int(each.index[one]) for each, one in zip(bounding, taken, strict=True)]
        unsolved = _unsolved(known, [[amount] for amount in amounts], self._budget)
        if unsolved:
            return unsolved
        ends = [float(one.ends[amount]) for one, amount in zip(known, amounts, strict=True)]
        gaps = [
            (self._weights[site] * (bounding[site].values[taken[site]] - _reached(one, end)), site)
            for site, (one, end) in enumerate(zip(known, ends, strict=True))
            if amounts[site] and one.spent(end) < LAST_EFFORT
        ]
        gaps = [(gap, site) for gap, site in gaps if gap > TIE_TOLERANCE]
        largest = max((gap for gap, _ in gaps), default=0.0)
        return [
            Request(site, ends[site], min(LAST_EFFORT, known[site].spent(ends[site]) * GROWTH))
            for gap, site in gaps
            if gap >= largest / 4  # smaller ones can wait until these are closed
        ]

    def allocation(self) -> NetworkAllocation:
        """Return the allocation among placements found, with its bound."""
        lower = self._lower
        chosen = zip(self._known, self._found, lower.taken, strict=True)
        taken = tuple(one.found[each.index[index]] for one, each, index in chosen)
        bound = max(lower.value, self._upper.value)
        return NetworkAllocation(self._budget, taken, lower.price, lower.value, bound, tuple(self._known))


def _first_requests(frontiers: Sequence[Frontier], budget: float) -> list[Request]:
    """Return the requests before any allocation: money for one sensor, two, four and all, as far as the budget goes."""
    requests = []
    for site, one in enumerate(frontiers):
        if len(one.amounts) == 1:
            continue
        cheapest = one.amounts[1]
        wanted = {float(one.ends[-1])} | {
            float(one.ends[np.flatnonzero(one.amounts <= number * cheapest * (1 + TIE_TOLERANCE))[-1]])
            for number in FIRST_SENSORS
        }
        requests += [
            Request(site, amount, FIRST_EFFORT)
            for amount in sorted(wanted)
            if amount <= budget * (1 + TIE_TOLERANCE) and not one.spent(amount)
        ]
    return requests


def _unsolved(frontiers: Sequence[Frontier], amounts: Sequence[Sequence[int]], budget: float) -> list[Request]:
    """Return requests for amounts of each site that have not been solved; amount 0 needs no search.

    An amount that has not been solved has the bound of the next larger one that has, so the bound takes the amounts
    between two solved ones from the lowest upwards, one in each round. The amount in the middle is solved with each: it
    lowers the bound of half of them at once. Amounts above the budget are left out.
    """
    requests = []
    for site, (one, own) in enumerate(zip(frontiers, amounts, strict=True)):
        ends = one.ends.tolist()
        payable = int(np.searchsorted(one.amounts, budget * (1 + TIE_TOLERANCE), side="right"))
        for amount in own:
            if amount and not one.spent(ends[amount]):
                above = next((index for index in range(amount, payable) if one.spent(ends[index])), payable)
                requests += [Request(site, ends[index], FIRST_EFFORT) for index in {amount, (amount + above) // 2}]
    return requests


def _reached(frontier: Frontier, budget: float) -> float:
    """Return the best value found within a budget."""
    return max(one.value for one in frontier.found if one.price <= budget * (1 + TIE_TOLERANCE))


def _solved(
    frontiers: list[Frontier], requests: Sequence[Request], solve: Solve
) -> Generator[Progress, None, list[Frontier]]:
    """Return the frontiers with the results of requests."""
    ordered = sorted(set(requests), key=lambda one: (one.site, one.budget, one.effort))
    results = yield from solve(ordered)
    known = list(frontiers)
    for request, result in zip(ordered, results, strict=True):
        known[request.site] = known[request.site].with_solved(result)
    return known
