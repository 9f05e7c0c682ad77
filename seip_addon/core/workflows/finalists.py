"""Finalists of a placement: the best by each criterion at hand, and placements near them, to be judged by detection."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Generator, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain, zip_longest

import numpy as np

from ..arrays import Boolean, Integer
from ..choosing.placement.judgement import Judgement
from ..choosing.placement.objective import Objective, Solution, criterion_of, placement_problem
from ..choosing.placement.problem import TIE_TOLERANCE, PlacementProblem, assess, canonical_order
from ..choosing.placement.search_limits import SolverLimits
from ..choosing.placement.solver import solve
from ..choosing.robustness.gain_band import with_gain_band
from ..errors import SeipError
from ..progress import Progress, within
from ..site.site import Site
from .returns import crossing_returns, survey_returns
from .survey import Survey, surroundings

DEFAULT_FINALISTS = 12
FINALIST_EFFORT = 0.5
"""Largest effort of the search for the best placement by each criterion: its proof is of no use here."""
LONE_HEIGHTS = 3
"""Mounting heights, the lowest, a middle one and the highest, of which there are finalists of that height alone."""
MOVED_BY = 8.0
"""Metres by which a sensor of a near placement is moved at least; nearer ones find nearly the same."""


@dataclass(frozen=True, eq=False)
class Finalist:
    """A placement that is to be judged.

    Parameters
    ----------
    name : str
        The criterion of which it is the best placement, or that of the finalist that it is near.
    chosen : (k,) int64
        Candidate poses.
    problem : PlacementProblem
        Problem of its criterion.
    """

    name: str
    chosen: Integer
    problem: PlacementProblem


def require_judged(objective: Objective) -> None:
    """Raise SeipError if finalists cannot be judged for an objective."""
    if objective.cheapest:
        raise SeipError("finalists need a number of sensors or a budget, not a coverage to reach")
    if objective.scenarios.kind != "nominal" or objective.measure is not None:
        raise SeipError("finalists are judged in traffic as planned: leave out pose errors, traffic and failures")


def find_finalists(
    survey: Survey, solution: Solution, number: int = DEFAULT_FINALISTS
) -> Generator[Progress, None, list[Finalist]]:
    """Return placements to judge; the first is the solution itself.

    The best by road seen, by returns with and without the allowance for traffic, and by both with mounts of one height
    alone; then placements near these in turn, in which one sensor has another pose at its position, or another one.

    Parameters
    ----------
    solution : Solution
        Best placement by the plain criterion.
    number : int
        Largest number of finalists; there may be fewer placements.
    """
    criteria = yield from _criteria(survey, solution.objective)
    limits = SolverLimits(effort=min(FINALIST_EFFORT, survey.settings.effort))
    height = survey.site.candidates.height
    levels = np.unique(height)
    levels = levels[np.unique(np.linspace(0, len(levels) - 1, LONE_HEIGHTS).astype(np.int64))]
    asked = [(name, problem, np.zeros(len(height), dtype=bool)) for name, problem in criteria]
    if len(levels) > 1:
        asked += [
            (f"{name} with mounts of {level:g} m alone", problem, height != level)
            for name, problem in criteria[:2]
            for level in levels.tolist()
        ]
    first = criteria[0]
    found = {_key(solution.placement.chosen): Finalist(first[0], solution.placement.chosen, first[1])}
    for done, (name, problem, other) in enumerate(asked[1:]):
        progress = Progress(done, len(asked), f"choosing finalists by {name}")
        yield progress
        with suppress(SeipError):  # no placement is possible, as at one height alone
            alone = replace(problem, forbidden=~problem.allowed | other)
            placement = yield from within(progress, solve(alone, limits))
            finalist = Finalist(name, _in_order(problem, placement.chosen), problem)
            if len(found) < number:
                found.setdefault(_key(finalist.chosen), finalist)
    queues = deque(_near(survey.site, base, turn % 2) for turn, base in enumerate(found.values()))
    while queues and len(found) < number:
        near = next(queues[0], None)
        if near is None:
            queues.popleft()
        else:
            queues.rotate(-1)
            found.setdefault(_key(near.chosen), near)
    return list(found.values())


def judged_solution(survey: Survey, solution: Solution, judgement: Judgement) -> Generator[Progress, None, Solution]:
    """Return the solution of the winner, with the bound, and other numbers of sensors, of the best by the criterion."""
    chosen = np.array(judgement.winner.poses, dtype=np.int64)
    if _key(chosen) == _key(solution.placement.chosen):
        return replace(solution, judgement=judgement)
    of_returns = solution.deployment.returns
    returns = (yield from survey_returns(survey, solution.objective)) if of_returns is not None else None
    problem = _road(survey, solution.objective) if returns is None else returns.problem()
    known = solution.placement
    placement = assess(
        problem, chosen, problem.value(chosen), known.bound, optimal=False, solver=known.solver, notes=()
    )
    if returns is None or of_returns is None:
        winner = replace(solution, placement=placement, greedy=None, deployment=survey.deploy(chosen))
    else:
        winner = returns.solution(placement, None)
        summary = winner.deployment.returns
        assert summary is not None  # noqa: S101  # it was chosen for returns
        with_front = replace(summary, front=of_returns.front)
        winner = replace(winner, deployment=replace(winner.deployment, returns=with_front))
    deployment = yield from with_gain_band(surroundings(survey), winner.deployment)
    winner = replace(winner, deployment=deployment, front=solution.front, judgement=judgement)
    return replace(winner, crossings=crossing_returns(survey, winner))


def _criteria(survey: Survey, objective: Objective) -> Generator[Progress, None, list[tuple[str, PlacementProblem]]]:
    """Return the criteria at hand with their problems, the plain one first and the other one of the product next."""
    returns = yield from survey_returns(survey, objective)
    problem = returns.problem()
    known = {"road": ("road seen", _road(survey, objective)), "returns": ("returns", problem)}
    plain = known.pop(criterion_of(objective, survey.models))
    return [plain, *known.values(), ("returns in an empty street", replace(problem, amounts=returns.grid.returns))]


def _road(survey: Survey, objective: Objective) -> PlacementProblem:
    return placement_problem(survey.site, survey.grid.visible, survey.models, objective)


def _near(site: Site, base: Finalist, first: int) -> Iterator[Finalist]:
    """Yield placements near one, the best by its criterion first: with another pose, or another position, in turn.

    Parameters
    ----------
    first : {0, 1}
        Whether another position comes first.
    """
    problem, candidates = base.problem, site.candidates
    kinds: tuple[list[tuple[float, int, int]], ...] = ([], [])  # value less than 0, slot, candidate
    for slot, gone in enumerate(base.chosen.tolist()):
        rest = np.delete(base.chosen, slot)
        together = problem.amounts[rest].sum(axis=0, dtype=np.float64)
        same = problem.positions == problem.positions[gone]
        same[gone] = False
        far = np.hypot(*(problem.xyz[:, :2] - problem.xyz[gone, :2]).T) >= MOVED_BY
        for kind, mask in zip(kinds, (same, far), strict=True):
            for one in np.flatnonzero(mask & _fits(problem, rest)).tolist():
                value = float(problem.weights @ problem.g(together + problem.amounts[one]))
                kind.append((-value, slot, one))
    lists = [sorted(kind) for kind in (kinds[first], kinds[1 - first])]
    for _, slot, one in filter(None, chain.from_iterable(zip_longest(*lists))):
        place = f"{candidates.position_name[candidates.position_of[one]]} at {candidates.height[one]:g} m"
        chosen = _in_order(problem, np.append(np.delete(base.chosen, slot), one))
        yield Finalist(f"{base.name}, but {place}", chosen, problem)


def _fits(problem: PlacementProblem, rest: Integer) -> Boolean:
    """Return which candidates make a placement that meets all constraints, together with the rest of one, (c,) bool."""
    fits: Boolean = problem.allowed & ~np.isin(problem.positions, problem.positions[rest])
    for place in problem.xyz[rest, :2]:
        fits &= np.hypot(*(problem.xyz[:, :2] - place).T) >= problem.min_distance
    if problem.budget is not None:
        fits &= math.fsum(problem.prices[rest]) + problem.prices <= problem.budget * (1 + TIE_TOLERANCE)
    groups = problem.mandatory_groups
    fits &= groups[~groups[:, rest].any(axis=1)].all(axis=0)
    return fits


def _in_order(problem: PlacementProblem, chosen: Integer) -> Integer:
    """Return candidates in the canonical order."""
    rank = np.argsort(canonical_order(problem))
    return chosen[np.argsort(rank[chosen])]


def _key(chosen: Integer) -> frozenset[int]:
    return frozenset(chosen.tolist())
