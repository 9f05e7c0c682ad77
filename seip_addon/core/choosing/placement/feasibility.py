"""A first feasible choice for mandatory groups, or the reason why there is none."""

import math
from collections.abc import Generator
from dataclasses import replace

import numpy as np

from ...base.arrays import Integer
from ...base.errors import SeipError
from ...base.progress import Progress
from .instance import Instance
from .integer_program import PlacementProgram
from .problem import PlacementProblem
from .search_limits import Work


def starting_choice(problem: PlacementProblem, instance: Instance, solver: str) -> Generator[Progress, None, Integer]:
    """Return candidates that serve all mandatory groups within the limits, (s,) int64.

    Raises
    ------
    SeipError
        The groups cannot all be served; the message names the limit that prevents it.
    """
    chosen = yield from serving_choice(instance, solver)
    if chosen is None:
        part = instance.of(np.flatnonzero(instance.mandatory.any(axis=0)))
        raise SeipError((yield from _why_infeasible(problem, part, solver)))
    return chosen


def serving_choice(instance: Instance, solver: str) -> Generator[Progress, None, Integer | None]:
    """Return candidates that serve all mandatory groups within the limits, (s,) int64; None if there are none."""
    if len(instance.mandatory) == 0:
        return np.zeros(0, np.int64)
    members = np.flatnonzero(instance.mandatory.any(axis=0))
    fewest = yield from _least(instance.of(members), solver)
    return None if fewest is None else members[fewest]


def _why_infeasible(problem: PlacementProblem, part: Instance, solver: str) -> Generator[Progress, None, str]:
    """Return the error message: the limit that keeps the groups from being served, and how to change it."""
    groups = f"the mandatory places ({', '.join(problem.group_names)}) cannot all carry a sensor"
    # Constraints are dropped one after another, the budget and the number of sensors first: the first program that has
    # a solution without one names the constraint that is at fault. The part's own count is limited by the budget too.
    unlimited = len(part)
    count = unlimited if problem.count is None else problem.count
    fewest = yield from _least(replace(part, count=unlimited), solver)
    if fewest is not None:
        return f"{groups} with {problem.count} sensors; allow at least {len(fewest)} or lift a demand"
    cheapest = yield from _least(replace(part, count=count, budget=math.inf), solver, by_price=True)
    if cheapest is not None:
        price = math.fsum(part.price[cheapest])
        return f"{groups} within the budget of {problem.budget:g}; raise it to at least {price:g} or lift a demand"
    same_position = problem.positions[part.original]
    conflict = (same_position[:, None] == same_position) & ~np.eye(len(part), dtype=bool)
    apart = replace(part, conflict=conflict)
    if (yield from _least(apart, solver)) is not None:
        return f"{groups} at least {problem.min_distance:g} m apart; lower the minimum distance or lift a demand"
    if (yield from _least(replace(apart, count=unlimited, budget=math.inf), solver)) is not None:
        return f"{groups} within the number, budget and minimum distance together; loosen them or lift a demand"
    return f"{groups}, because they compete for the same positions; lift a demand or add candidates there"


def _least(part: Instance, solver: str, *, by_price: bool = False) -> Generator[Progress, None, Integer | None]:
    """Return the smallest or cheapest choice that serves all groups, if there is one."""
    program = PlacementProgram(part)
    objective = -1 * (program.price if by_price else program.number)
    return (yield from program.maximise(objective, solver, Work(math.inf))).chosen
