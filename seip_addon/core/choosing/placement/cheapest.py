"""The cheapest placement that reaches a share of the weight: partial set covering."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace

import numpy as np

from ...base.arrays import Float, Integer
from ...base.errors import SeipError
from ...base.progress import Progress
from .bounds import bound_at, falling_bounds, rest_of
from .feasibility import serving_choice, starting_choice
from .incumbent import Incumbent
from .instance import Instance, make_instance
from .integer_program import check_solver
from .objective import SAME_PRICE
from .problem import TIE_TOLERANCE, Placement, PlacementProblem, assess
from .search import without_idle
from .search_limits import DEFAULT_LIMITS, SolverLimits
from .solver import Describe, search_and_prove

BOUND_STEPS, PRICE_STEPS = 300, 3  # steps of the bound on the value of any placement, and then of that on its price
REPORTED = 10  # steps between two reports
FINISHING_SHARE, LEAST_FINISHING = 0.25, 0.5
"""Share of the work left that each round keeps back, and least units of it, for the choice among equally cheap ones."""
UNPROVEN_PRICE = (
    "the search ended before this placement was proven the cheapest: the gap is the share of its price that another "
    "one may save"
)
UNPROVEN_NUMBER = "the search ended before this number of sensors was proven the smallest"


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
        self._problem, self._solver, self._describe = problem, limits.solver, describe
        self._share, self._work = share, limits.work()
        self._instance = make_instance(problem)
        self._whole = math.fsum(problem.weights) / self._instance.unit
        goal = share * self._whole * (1 - TIE_TOLERANCE)
        self._goal = math.ceil(goal) if self._instance.step == 1 else goal
        self._equal_prices = bool(np.ptp(self._instance.price) == 0)

    def solve(self) -> Generator[Progress, None, Placement]:
        """Find a placement, cheaper ones for as long as there are any, and the one of largest coverage among these."""
        work = self._work
        start = yield from starting_choice(self._problem, self._instance, self._solver)
        first = yield from self._searched(self._instance, work.left, start)
        if first.value < self._goal:
            raise SeipError(self._unreached(first))
        chosen, proven = without_idle(first, self._goal), False
        while work.left > 0 and (cheaper := self._cheaper(chosen)) is not None:
            served = yield from serving_choice(cheaper, self._solver)
            if served is None:
                proven = True
                break
            found = yield from self._searched(cheaper, (1.0 - FINISHING_SHARE) * work.left, served, chosen)
            if found.value < self._goal:
                proven = found.proven
                break
            chosen = without_idle(found, self._goal)
        proven = proven or self._cheaper(chosen) is None
        least = math.fsum(self._instance.price[chosen]) if proven else (yield from self._least_price(chosen))
        return (yield from self._finished(chosen, least, proven=proven))

    def _searched(
        self, instance: Instance, most: float, start: Integer, known: Integer | None = None
    ) -> Generator[Progress, None, Incumbent]:
        """Search an instance until the goal is reached or proven out of reach, for units of work."""
        incumbent = Incumbent(instance, self._work.part(most), self._describe, self._goal)
        known = None if known is None else instance.original[known]
        yield from search_and_prove(incumbent, start, self._solver, known)
        return incumbent

    def _unreached(self, incumbent: Incumbent) -> str:
        """Return the message that the goal is out of reach, or was not found."""
        wanted = f"a coverage of {self._share:.2%}"
        if incumbent.proven:
            return (
                f"{wanted} cannot be reached: no placement covers more than "
                f"{min(self._goal, incumbent.bound) / self._whole:.2%}; ask for less, or allow more or better sensors"
            )
        return (
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
        r"""Return a price below which no placement reaches the goal.

        With a multiplier :math:`μ > 0` of the price a placement of price P has at most the value :math:`L + μ P`, so
        that :math:`P \ge (goal - L) / μ`. The bound at the budget B is :math:`L + μ B`, which gives the price as
        :math:`B - (bound - goal) / μ`. Each step takes the multiplier of the bound at the price of the last one
        (Newton's method).
        """
        instance, goal = self._instance, self._goal
        block, every, none = instance.blocks[0], np.arange(len(instance)), np.zeros(0, dtype=np.int64)
        rest = replace(rest_of(instance, none, every), budget=math.fsum(instance.price[chosen]))
        base: Float = np.zeros(len(block.weight))
        bound = bound_at(block, rest, base, block.start(base), block.rounding)
        falling = falling_bounds(block, rest, base, bound, goal, block.rounding)
        for number, lower in zip(range(BOUND_STEPS), falling, strict=False):
            bound = lower
            self._work.spend(block.operations)
            if number % REPORTED == 0:
                yield Progress(0, 0, "computing a lower bound on the price")
        least = float(instance.price.min())
        for _ in range(PRICE_STEPS):
            if bound.selection.multiplier == 0:
                break
            least = max(least, rest.budget - (bound.value - goal) / bound.selection.multiplier)
            rest = replace(rest, budget=least)
            bound = bound_at(block, rest, base, bound.parameters, block.rounding)
        if self._equal_prices and least > 0:
            single = float(instance.price[0])
            least = math.ceil(least / single * (1 - TIE_TOLERANCE)) * single
        return least

    def _finished(self, chosen: Integer, least: float, *, proven: bool) -> Generator[Progress, None, Placement]:
        """Return the placement of largest coverage among those as cheap as a given one.

        ``least`` is a price below which none reaches the goal, and ``proven`` says that none is cheaper, or has fewer
        sensors where all prices are equal.
        """
        problem, instance, work = self._problem, self._instance, self._work
        price = math.fsum(instance.price[chosen])
        same = replace(instance, count=len(chosen)) if self._equal_prices else replace(instance, budget=price)
        incumbent = Incumbent(same, work.part(max(work.left, LEAST_FINISHING)), self._describe)
        incumbent.offer(chosen)
        start = yield from starting_choice(problem, same, self._solver)
        solver = yield from search_and_prove(incumbent, start, self._solver, instance.original[chosen])
        kept = incumbent.chosen
        cost = math.fsum(instance.price[kept])
        optimal = proven or (cost > 0 and least >= cost * (1 - 3 * TIE_TOLERANCE))
        notes = [] if optimal else [UNPROVEN_PRICE if cost > 0 else UNPROVEN_NUMBER]
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
