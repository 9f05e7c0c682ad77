"""A first feasible choice for mandatory groups, or the reason why there is none."""

import math
from collections.abc import Generator
from dataclasses import replace

import numpy as np

from ...arrays import Integer
from ...errors import SeipError
from ...progress import Progress
from .integer_program import CoverProgram, Expression
from .problem import PlacementProblem
from .reduced_problem import Instance
from .search_limits import Clock

TIME_LIMIT = 20.0  # seconds for a program without targets: far more than it takes; the user's time limit does not apply


def starting_choice(problem: PlacementProblem, instance: Instance, solver: str) -> Generator[Progress, None, Integer]:
    """Return candidates that serve all mandatory groups within the limits, (s,) int64.

    Raises
    ------
    SeipError
        The groups cannot all be served, and the message names the limit that prevents it; or the time was too short.
    """
    if len(instance.mandatory) == 0:
        return np.zeros(0, np.int64)
    members = np.flatnonzero(instance.mandatory.any(axis=0))
    part = instance.part(members)
    program = CoverProgram(part)
    program.require(program.number <= len(part.mandatory))
    # of all choices one with much coverage by each sensor, as a start for the search
    separately = program.number_among(np.arange(len(part)), part.visible @ part.weight * program.weight_scale)
    chosen = yield from _decide(problem, program, separately, solver)
    if chosen is None:
        raise SeipError((yield from _why_infeasible(problem, part, solver)))
    return members[chosen]


def _why_infeasible(problem: PlacementProblem, part: Instance, solver: str) -> Generator[Progress, None, str]:
    """Return the error message: the limit that keeps the groups from being served, and how to change it."""
    groups = f"the mandatory places ({', '.join(problem.group_names)}) cannot all carry a sensor"
    # Constraints are dropped one after another, the budget and the number of sensors first: the first program that has
    # a solution without one names the constraint that is at fault. The part's own count is limited by the budget too.
    unlimited = len(part)
    count = unlimited if problem.count is None else problem.count
    fewest = yield from _least(problem, replace(part, count=unlimited), solver)
    if fewest is not None:
        return f"{groups} with {problem.count} sensors; allow at least {len(fewest)} or lift a demand"
    cheapest = yield from _least(problem, replace(part, count=count, budget=math.inf), solver, by_price=True)
    if cheapest is not None:
        price = math.fsum(part.price[cheapest])
        return f"{groups} within the budget of {problem.budget:g}; raise it to at least {price:g} or lift a demand"
    same_position = problem.positions[part.original]
    conflict = (same_position[:, None] == same_position) & ~np.eye(len(part), dtype=bool)
    apart = replace(part, conflict=conflict)
    if (yield from _least(problem, apart, solver)) is not None:
        return f"{groups} at least {problem.min_distance:g} m apart; lower the minimum distance or lift a demand"
    if (yield from _least(problem, replace(apart, count=unlimited, budget=math.inf), solver)) is not None:
        return f"{groups} within the number, budget and minimum distance together; loosen them or lift a demand"
    return f"{groups}, because they compete for the same positions; lift a demand or add candidates there"


def _least(
    problem: PlacementProblem, part: Instance, solver: str, *, by_price: bool = False
) -> Generator[Progress, None, Integer | None]:
    """Return the smallest or cheapest choice that serves all groups, if there is one."""
    program = CoverProgram(part)
    return (yield from _decide(problem, program, -1 * (program.price if by_price else program.number), solver))


def _decide(
    problem: PlacementProblem, program: CoverProgram, objective: Expression, solver: str
) -> Generator[Progress, None, Integer | None]:
    """Return the choice of largest objective, or None where there is none."""
    outcome = yield from program.maximise(objective, solver, Clock(TIME_LIMIT))
    if outcome.chosen is None and not outcome.finished:
        raise SeipError(
            f"the solver did not find out within {TIME_LIMIT:g} s whether the mandatory places "
            f"({', '.join(problem.group_names)}) can all carry a sensor; lift a demand, or choose another solver"
        )
    return outcome.chosen
