"""Coverage against price: the best placements with fewer and with more sensors than a solution has."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace

from ...errors import SeipError
from ...progress import Progress, within
from .objective import CHOSEN_FOR, MOVED, SAME_PRICE, FrontPoint, Solution
from .problem import TIE_TOLERANCE, Placement, PlacementProblem, assess
from .search_limits import SolverLimits
from .solver import solve

MORE = 2  # sensors beyond those of the solution, up to which the front goes
EFFORT = 0.2
"""Counted work for each number of sensors; a unit is about a second of one core."""


def price_front(
    problem: PlacementProblem, solution: Solution, effort: float = EFFORT
) -> Generator[Progress, None, tuple[FrontPoint, ...]]:
    """Find the best placements of one sensor, two and so on, up to two more than a solution has.

    Weights and rules are those of the solution, without a budget. Numbers of sensors for which the certificate of the
    solution holds have its coverage and its bound; searches for other numbers start from it, and their bounds are held
    to the certificate, so that each number has one bound, and more sensors never have the smaller one.

    Parameters
    ----------
    problem : PlacementProblem
        Problem of the solution.
    effort : float, units of counted work
        Limit for each number of sensors.

    Returns
    -------
    tuple of FrontPoint
        Without numbers of sensors that the rules do not allow; empty if the solution was not chosen for nominal
        coverage, which alone the front compares.
    """
    if any(note.startswith(CHOSEN_FOR) for note in solution.notes) or not len(solution.placement.chosen):
        return ()
    whole = math.fsum(problem.weights)
    allowed = set(problem.positions[problem.allowed].tolist())
    chosen = solution.placement.chosen
    most = min(len(chosen) + MORE, len(allowed))
    limits = SolverLimits("auto", math.inf, effort)
    known, caps = _certified(problem, solution), _proven_limits(problem, solution, whole)
    found: dict[int, Placement] = {}
    for count in range(1, most + 1):
        step = Progress(count - 1, most, "solving for fewer and more sensors", counted=False)
        yield step
        try:
            limited = replace(problem, count=count, budget=None)
            found[count] = known.get(count) or (yield from within(step, solve(limited, limits, chosen)))
        except SeipError:  # fewer than the rules demand
            continue
    return tuple(_point(count, found, known, caps, whole) for count in found)


def equal_prices(problem: PlacementProblem) -> bool:
    """Return whether all sensors cost the same, so that a price is a number of sensors."""
    prices = problem.prices[problem.allowed]
    return bool(len(prices) and prices.max() == prices.min())


def _certified(problem: PlacementProblem, solution: Solution) -> dict[int, Placement]:
    """Return the solution's placement for each number of sensors whose best coverage its certificate bounds."""
    objective, placement = solution.objective, solution.placement
    poses = placement.chosen
    if not _is_certified(placement):
        return {}
    if objective.cheapest:  # of equal prices: those of the lowest price are those of the fewest sensors
        if not equal_prices(problem) or any(note.startswith(SAME_PRICE) for note in placement.notes):
            return {}
        bound, optimal, numbers = problem.covered(poses), True, range(len(poses), len(poses) + 1)
    else:
        bound, optimal = placement.bound, placement.status == "optimal"
        most = _most_allowed(objective.budget, problem, max(len(poses), objective.count or 0))
        numbers = range(len(poses), most + 1)
    known = assess(problem, poses, bound, optimal=optimal, solver=placement.solver, seconds=0.0)
    return dict.fromkeys(numbers, known)


def _proven_limits(problem: PlacementProblem, solution: Solution, whole: float) -> dict[int, float]:
    """Return, for numbers of sensors, the weight that the solution proves no such number to exceed."""
    objective, placement = solution.objective, solution.placement
    bound = placement.bound
    if not _is_certified(placement):
        return {}
    most = objective.count or len(placement.chosen) + MORE
    if not objective.cheapest:
        return dict.fromkeys(range(1, _most_allowed(objective.budget, problem, most) + 1), bound)
    dearest = float(problem.prices[problem.allowed].max())
    too_few = (number for number in range(1, most + 1) if number * dearest < bound * (1 - TIE_TOLERANCE))
    return dict.fromkeys(too_few, (objective.coverage or 1.0) * whole)  # what costs less does not reach the coverage


def _is_certified(placement: Placement) -> bool:
    """Return whether the bound of a placement is on nominal coverage, or on the price of it."""
    return math.isfinite(placement.bound) and placement.status != MOVED


def _most_allowed(budget: float | None, problem: PlacementProblem, most: int) -> int:
    """Return the largest number of sensors, up to ``most``, of which the budget allows any choice."""
    if budget is None:
        return most
    dearest = float(problem.prices[problem.allowed].max())
    return most if dearest == 0 else min(most, math.floor(budget * (1 + TIE_TOLERANCE) / dearest))


def _point(
    count: int, found: dict[int, Placement], known: dict[int, Placement], caps: dict[int, float], whole: float
) -> FrontPoint:
    """Return the best placement of at most ``count`` sensors, and what the bounds of all numbers leave open."""
    best = max((one for number, one in found.items() if number <= count), key=lambda one: one.covered)
    # a bound for more sensors holds for fewer, and the recorded one is never undercut by those for more
    bounds = [*((number, one.bound) for number, one in found.items()), *caps.items()]
    bound = min(bound for number, bound in bounds if number >= count)
    bound = max([bound, *(one.bound for number, one in known.items() if number <= count)])
    return FrontPoint(count, best.covered / whole, best.price, max(0.0, bound - best.covered) / whole)
