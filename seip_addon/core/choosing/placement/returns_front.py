"""Returns from road users against price: the best placements with fewer and with more sensors than a solution has."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...errors import SeipError
from ...progress import Progress, within
from .objective import MOVED, Solution
from .price_front import EFFORT, MORE
from .problem import Placement, PlacementProblem
from .returns_solver import solve_returns
from .returns_summary import ReturnsPoint
from .search_limits import SolverLimits


def returns_front(
    problem: PlacementProblem, returns: NDArray[np.float32], solution: Solution, effort: float = EFFORT
) -> Generator[Progress, None, tuple[ReturnsPoint, ...]]:
    """Find the placements with the most returns of one sensor, two and so on, up to two more than a solution has.

    Weights and rules are those of the solution, without a budget. The solution itself counts for its number of sensors,
    and its bound if it has no budget. More sensors never have fewer returns, nor a smaller bound.

    Parameters
    ----------
    problem : PlacementProblem
        Problem of the solution; its weights are those of the m road users.
    returns : (c, m) float
        Expected returns of each candidate from each road user.
    effort : float, units of counted work
        Limit for each number of sensors.

    Returns
    -------
    tuple of ReturnsPoint
        Without numbers of sensors that the rules do not allow.
    """
    chosen, placement = solution.placement.chosen, solution.placement
    if placement.status == MOVED or not len(chosen):
        return ()
    allowed = set(problem.positions[problem.allowed].tolist())
    most = min(len(chosen) + MORE, len(allowed))
    limits = SolverLimits("auto", math.inf, effort)
    is_for_number = solution.objective.budget is None and solution.objective.count == len(chosen)
    found: dict[int, list[Placement]] = {}
    for count in range(1, most + 1):
        step = Progress(count - 1, most, "solving for fewer and more sensors", counted=False)
        yield step
        found[count] = [placement] if count == len(chosen) else []
        if count == len(chosen) and is_for_number:
            continue
        try:
            limited = replace(problem, count=count, budget=None)
            found[count].append((yield from within(step, solve_returns(limited, returns, limits))))
        except SeipError:  # fewer than the rules demand
            continue
    bounds = {
        count: min(one.bound for one in there if is_for_number or one is not placement)
        for count, there in found.items()
        if any(is_for_number or one is not placement for one in there)
    }
    return tuple(_point(count, found, bounds) for count, there in found.items() if there)


def _point(count: int, found: dict[int, list[Placement]], bounds: dict[int, float]) -> ReturnsPoint:
    """Return the best placement of at most ``count`` sensors, and by how much the bounds let another one be better."""
    no_more = [one for number, there in found.items() if number <= count for one in there]
    best = max(no_more, key=lambda one: one.objective)
    bound = min((bound for number, bound in bounds.items() if number >= count), default=math.inf)  # holds for fewer too
    gap = None if math.isinf(bound) else math.expm1(max(0.0, bound - best.objective))
    return ReturnsPoint(count, math.expm1(best.objective), best.price, gap)
