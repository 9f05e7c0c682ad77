"""Value against price: the best placements with fewer and with more sensors than a solution has."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace

from ...errors import SeipError
from ...progress import Progress, within
from .instance import make_instance
from .problem import Placement, PlacementProblem
from .search_limits import SolverLimits
from .solver import solve_instance

MORE = 2  # sensors beyond those of the solution, up to which the front goes
EFFORT = 0.5  # units of work for each number of sensors


def front_of(
    problem: PlacementProblem, placement: Placement, certified: range, effort: float = EFFORT
) -> Generator[Progress, None, dict[int, Placement]]:
    """Find the best placements of one sensor, two and so on, up to two more than a placement has.

    Constraints are those of the problem, without a budget. A bound for more sensors holds for fewer, and a placement of
    fewer sensors is one of at most more, so that more sensors never have the smaller value or bound.

    Parameters
    ----------
    placement : Placement
        Placement from which the searches start.
    certified : range
        Numbers of sensors for which its bound holds, and no other placement is searched.
    effort : float, units of work
        Limit for each number of sensors.

    Returns
    -------
    dict of int to Placement
        Placement by largest number of sensors, without numbers that the constraints do not allow. Its bound holds for
        all placements of at most that number.
    """
    chosen = placement.chosen
    most = min(len(chosen) + MORE, len(set(problem.positions[problem.allowed].tolist())))
    found: dict[int, Placement] = {}
    whole = make_instance(problem)
    for count in range(1, most + 1):
        step = Progress(count - 1, most, "fewer and more sensors", counted=False)
        yield step
        if count in certified:
            found[count] = placement
            continue
        try:
            limited = replace(problem, count=count, budget=None)
            instance = replace(whole, count=limited.most_sensors, budget=math.inf)
            steps = solve_instance(limited, instance, SolverLimits(effort=effort), known=chosen)
            found[count] = yield from within(step, steps)
        except SeipError:  # fewer than the constraints demand
            continue
    return {count: _best(count, problem, found) for count in found}


def _best(count: int, problem: PlacementProblem, found: dict[int, Placement]) -> Placement:
    """Return the best placement of at most ``count`` sensors, with the smallest bound of any larger number."""
    best = max((one for number, one in found.items() if number <= count), key=lambda one: one.objective)
    bound = max(best.objective, min(one.bound for number, one in found.items() if number >= count))
    return replace(best, bound=bound, gap=problem.g.gap(best.objective, bound, math.fsum(problem.weights)))
