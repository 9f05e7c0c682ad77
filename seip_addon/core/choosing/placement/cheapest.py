"""The cheapest placement that reaches a share of the weight: partial set covering."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace

import numpy as np

from ...arrays import Float, Integer
from ...errors import SeipError
from ...progress import Progress
from .bounds import bound_at, falling_bounds, least_price, rest_of
from .feasibility import serving_choice, starting_choice
from .incumbent import Incumbent
from .instance import Instance, make_instance
from .integer_program import check_solver
from .objective import SAME_PRICE
from .problem import TIE_TOLERANCE, Placement, PlacementProblem, assess
from .search import Search, without_idle
from .search_limits import DEFAULT_LIMITS, SolverLimits
from .solver import Describe, search_and_prove

BOUND_STEPS = 100  # steps of the bound on the price of any placement
FINISHING_SHARE, LEAST_FINISHING = 0.25, 0.5
"""Share of the work, and least units of it, for the choice among equally cheap placements."""
UNPROVEN_PRICE = (
    "the search ended before this placement was proven the cheapest: the gap is the share of its price that another "
    "one may save"
)


def cheapest_for_share(
    problem: PlacementProblem,
    share: float,
    limits: SolverLimits = DEFAULT_LIMITS,
    describe: Describe | None = None,
) -> Generator[Progress, None, Placement]:
    """Choose the cheapest placement that covers a share of all weight.

    Each round searches for a cheaper placement that reaches the share, until there is none or the work is done. Of the
    cheapest placements the one of largest coverage found is returned. If all prices are equal, zero included, the
    number of sensors replaces the price. The result's objective, bound and gap are prices.

    Parameters
    ----------
    share : float
        Share of all weight to cover, above 0 and at most 1.

    Raises
    ------
    SeipError
        No placement within the limits reaches the share, none was found, or the solver is not available.
    """
    if not 0 < share <= 1:
        raise SeipError(f"the coverage to reach is {share:g}; give a share above 0 and up to 1")
    check_solver(limits.solver)
    return (yield from _Cheapest(problem, share, limits, describe).solve())


class _Cheapest:
    """Search for the cheapest placement that reaches a goal."""

    def __init__(
        self, problem: PlacementProblem, share: float, limits: SolverLimits, describe: Describe | None
    ) -> None:
        self._problem, self._limits, self._describe = problem, limits, describe
        self._work = limits.work()
        self._instance = make_instance(problem)
        self._whole = math.fsum(problem.weights) / self._instance.unit
        goal = share * self._whole * (1 - TIE_TOLERANCE)
        self._goal = math.ceil(goal) if self._instance.step == 1 else goal
        self._equal_prices = bool(np.ptp(self._instance.price) == 0)

    def solve(self) -> Generator[Progress, None, Placement]:
        """Find a placement, cheaper ones for as long as there are any, and the one of largest coverage among these."""
        instance, work = self._instance, self._work
        chosen = yield from self._reaching()
        least = yield from self._least_price(chosen)
        proven = False
        while not proven and work.left > 0 and (cheaper := self._cheaper(chosen)) is not None:
            incumbent = Incumbent(cheaper, work.part((1.0 - FINISHING_SHARE) * work.left), self._describe, self._goal)
            start = yield from serving_choice(cheaper, self._limits.solver)
            if start is None:
                proven = True
                break
            yield from search_and_prove(incumbent, start, self._limits.solver, instance.original[chosen])
            proven = incumbent.proven
            if incumbent.value < self._goal:
                break
            chosen, proven = without_idle(incumbent, self._goal), False
        return (yield from self._finished(chosen, least, proven=proven or self._cheaper(chosen) is None))

    def _reaching(self) -> Generator[Progress, None, Integer]:
        """Return some placement that reaches the goal: a greedy one by gain per price, or the result of a search."""
        goal, solver = self._goal, self._limits.solver
        incumbent = Incumbent(self._instance, self._work.part(self._work.left), self._describe, goal)
        start = yield from starting_choice(self._problem, self._instance, solver)
        search = Search(incumbent, start)
        for power in (1.0, 0.0):
            incumbent.offer((yield from search.filled(start, power, "choosing greedily", goal)))
        if incumbent.value < goal:
            yield from search_and_prove(incumbent, start, solver)
        if incumbent.value >= goal:
            return without_idle(incumbent, goal)
        wanted = f"a coverage of {goal / self._whole:.2%}"
        if incumbent.proven:
            raise SeipError(
                f"{wanted} cannot be reached: no placement covers more than "
                f"{min(goal, incumbent.bound) / self._whole:.2%}; ask for less, or allow more or better sensors"
            )
        raise SeipError(
            f"no placement with {wanted} was found: the best one covers {max(0.0, incumbent.value) / self._whole:.2%}; "
            "ask for less or raise the effort"
        )

    def _cheaper(self, chosen: Integer) -> Instance | None:
        """Return the instance of placements that are cheaper than a given one; None if there cannot be any."""
        instance = self._instance
        if self._equal_prices:
            return replace(instance, count=len(chosen) - 1) if len(chosen) > 1 else None
        price = math.fsum(instance.price[chosen])
        below = price * (1 - 3 * TIE_TOLERANCE)
        if price == 0 or below < instance.price.min():
            return None
        return replace(instance, budget=min(below, instance.budget))

    def _least_price(self, chosen: Integer) -> Generator[Progress, None, float]:
        """Return a price below which no placement reaches the goal."""
        instance, goal = self._instance, self._goal
        block, every, none = instance.blocks[0], np.arange(len(instance)), np.zeros(0, dtype=np.int64)
        rest = replace(rest_of(instance, none, every), budget=math.fsum(instance.price[chosen]))
        base: Float = np.zeros(len(block.weight))
        bound = bound_at(block, rest, base, block.start(base), block.rounding)
        steps = falling_bounds(block, rest, base, bound, goal, block.rounding)
        for _, lower in zip(range(BOUND_STEPS), steps, strict=False):
            bound = lower
            self._work.spend(block.operations)
            yield Progress(0, 0, "computing a lower bound of the price")
        least = max(least_price(rest, bound, goal), float(instance.price.min()))
        if self._equal_prices and least > 0:
            single = float(instance.price[0])
            least = math.ceil(least / single * (1 - TIE_TOLERANCE)) * single
        return least

    def _finished(self, chosen: Integer, least: float, *, proven: bool) -> Generator[Progress, None, Placement]:
        """Return the placement of largest coverage among those as cheap as a given one."""
        problem, instance, work = self._problem, self._instance, self._work
        price = math.fsum(instance.price[chosen])
        same = replace(instance, count=len(chosen)) if self._equal_prices else replace(instance, budget=price)
        incumbent = Incumbent(same, work.part(max(work.left, LEAST_FINISHING)), self._describe)
        incumbent.offer(chosen)
        start = yield from starting_choice(problem, same, self._limits.solver)
        solver = yield from search_and_prove(incumbent, start, self._limits.solver, instance.original[chosen])
        kept = incumbent.chosen
        cost = math.fsum(instance.price[kept])
        optimal = proven or least >= cost * (1 - 3 * TIE_TOLERANCE)
        notes = [] if optimal else [UNPROVEN_PRICE]
        if not incumbent.proven:
            more = (incumbent.bound - incumbent.value) * instance.unit / math.fsum(problem.weights)
            points = math.ceil(1000 * more - 1e-9) / 10
            notes.append(f"{SAME_PRICE}another one may cover up to {points:.1f} percentage points more")
        return assess(
            problem,
            instance.original[kept],
            cost,
            cost if optimal else min(cost, least),
            optimal=optimal,
            solver=solver,
            notes=notes,
        )
