"""Search for the best allocations of budgets to sites, which solves a site only where a decision depends on it."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Float
from ...errors import SeipError
from ...progress import Progress
from ..placement.problem import TIE_TOLERANCE, relative_gap
from .allocation import allocate, allocation_of, cheapest_allocation, relaxed_allocation
from .frontier import Frontier, Options, SolvedBudget

FIRST_EFFORT, LAST_EFFORT, GROWTH = 1.0, 64.0, 4.0
"""Counted work of the first and the last search of a budget at a site, and the factor from one to the next."""
FIRST_SENSORS = (1, 2, 4)
"""Numbers of sensors whose money is solved at every site before any allocation."""


MANY_SITES = 30
"""Number of sites from which rounds use the linear relaxation: the integer program takes a second for 100 sites. With
few sites it is fast, and spares searches of amounts that only a mixture of alternatives takes."""


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


@dataclass(frozen=True)
class Goal:
    """Budget to allocate.

    Parameters
    ----------
    budget : float, dollars
    tolerance : float
        Gap at which the search ends.
    minimum : float
        Least value at each site.
    effort : float, units of counted work
        Limit of each search at a site; the gap stays larger than the tolerance where it does not suffice.
    """

    budget: float
    tolerance: float
    minimum: float = 0.0
    effort: float = LAST_EFFORT

    @property
    def money(self) -> tuple[float, float]:
        """Budget and minimum, which alone decide what is the best allocation."""
        return self.budget, self.minimum


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


def search_allocations(
    frontiers: Sequence[Frontier],
    weights: Float,
    goals: Sequence[Goal],
    solve: Solve,
    *,
    gap: Gap = relative_gap,
) -> Generator[Progress, None, tuple[NetworkAllocation, ...]]:
    """Allocate each of several budgets to sites until its bound is within its tolerance of its value.

    Before the first round each site is solved for the money of one sensor, two, four and all. Each round allocates each
    budget twice: once among the placements found, which gives a value that is reached, and once among the bounds of all
    amounts of money, which gives a value that no allocation exceeds. Where the second takes an amount that has not been
    solved, it is solved, together with the one in the middle below the next solved one; where all it takes have been
    solved, those whose own gaps are largest are searched longer, up to the effort of the goal. The requests of all
    budgets are solved together, so that many workers are busy. With many sites the linear relaxation stands for the
    integer program as long as it takes amounts that have not been solved.

    Parameters
    ----------
    frontiers : sequence of Frontier
    weights : (s,) float64
        Importance of each site.
    goals : sequence of Goal
    solve : callable
        Solves budgets at sites.
    gap : callable
        Gap between the value of an allocation and its bound.

    Returns
    -------
    tuple of NetworkAllocation
        One for each goal.

    Raises
    ------
    SeipError
        A minimum cannot be reached at every site, or not within the budget.
    """
    known = list(frontiers)
    first = {one for goal in goals for one in _first_requests(known, goal.budget)}
    known = yield from _solved(known, first, solve)
    open_goals = list(goals)
    while open_goals:
        wanted: dict[tuple[float, float], list[Request]] = {}
        gaps: dict[tuple[float, float], float] = {}
        # Goals of the same money share the work; they differ by tolerance and effort alone.
        for key in dict.fromkeys(goal.money for goal in open_goals):
            least = min(goal.tolerance for goal in open_goals if goal.money == key)
            wanted[key], gaps[key] = [], math.inf
            if len(known) >= MANY_SITES:
                wanted[key], gaps[key] = _relaxed_round(known, weights, *key, gap)
            if not wanted[key] and gaps[key] > least:
                exact = _Round(known, weights, *key)
                wanted[key], gaps[key] = exact.requests(), exact.gap(gap)
        requests = {
            goal: [one for one in wanted[goal.money] if one.effort <= goal.effort]
            for goal in open_goals
            if gaps[goal.money] > goal.tolerance
        }
        open_goals = [goal for goal, own in requests.items() if own]
        known = yield from _solved(known, set().union(*requests.values()), solve)
    return tuple(_Round(known, weights, *goal.money).allocation() for goal in goals)


def _relaxed_round(
    known: Sequence[Frontier], weights: Float, budget: float, minimum: float, gap: Gap
) -> tuple[list[Request], float]:
    """Return the amounts to solve next by the linear relaxation, and a gap that is not below that of `_Round`.

    There are no requests if it takes solved amounts only, or if it has no solution.
    """
    bounding, found = ([getattr(one, name)(minimum) for one in known] for name in ("bounding_options", "found_options"))
    upper, among_found = (relaxed_allocation(options, weights, budget) for options in (bounding, found))
    if upper is None or among_found is None:
        return [], math.inf
    lower = allocation_of(found, weights, [parts[0] for parts in among_found.taken])
    amounts = [each.index[list(parts)].tolist() for each, parts in zip(bounding, upper.taken, strict=True)]
    return _unsolved(known, amounts, budget), gap(lower.value, max(lower.value, upper.value))


class _Round:
    """Allocations of a budget from what is known of the sites: among placements found, and among bounds."""

    def __init__(self, known: Sequence[Frontier], weights: Float, budget: float, minimum: float) -> None:
        self._known, self._weights, self._budget = known, weights, budget
        self._bounding = [one.bounding_options(minimum) for one in known]
        upper = allocate(self._bounding, weights, budget)
        if upper is None:
            raise _unreachable(known, self._bounding, budget, minimum)
        self._upper = upper
        self._found = [one.found_options(minimum) for one in known]
        self._lower = allocate(self._found, weights, budget)

    def gap(self, gap: Gap) -> float:
        """Return the gap between the two; infinite if no placement was found."""
        if self._lower is None:
            return math.inf
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
        if lower is None:
            raise SeipError(
                f"no allocation of ${self._budget:,.0f} was found that reaches the minimum at every site, though none "
                "is excluded: raise the budget, or lower the minimum"
            )
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
    frontiers: list[Frontier], requests: set[Request], solve: Solve
) -> Generator[Progress, None, list[Frontier]]:
    """Return the frontiers with the results of requests."""
    ordered = sorted(requests, key=lambda one: (one.site, one.budget, one.effort))
    results = yield from solve(ordered)
    known = list(frontiers)
    for request, result in zip(ordered, results, strict=True):
        known[request.site] = known[request.site].with_solved(result)
    return known


def _unreachable(frontiers: Sequence[Frontier], options: Sequence[Options], budget: float, minimum: float) -> SeipError:
    least = cheapest_allocation(options)
    if least is None:
        number = sum(len(each.prices) == 0 for each in options)
        best = min(float(one.bounds()[-1]) for one in frontiers)
        return SeipError(
            f"the minimum of {minimum:.3g} cannot be reached at {number} of {len(frontiers)} sites, at one of them not "
            f"more than {best:.3g}: lower the minimum, leave these sites out, or allow more sensors at a site"
        )
    return SeipError(
        f"${budget:,.0f} do not reach the minimum of {minimum:.3g} at every site: at least ${least.price:,.0f} are "
        "needed"
    )
