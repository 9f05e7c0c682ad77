"""Finalists of a placement: the best by each criterion at hand, and placements near them, to be judged by detection."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Generator, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from itertools import chain, zip_longest
from pathlib import Path
from typing import TypeVar

import numpy as np

from ..base.arrays import Boolean, Integer
from ..base.errors import SeipError
from ..base.progress import Progress, within
from ..choosing.placement.judgement import DEFAULT_FINALISTS, Judgement
from ..choosing.placement.objective import Objective, Solution, criterion_of, placement_problem
from ..choosing.placement.problem import TIE_TOLERANCE, PlacementProblem, assess
from ..choosing.placement.search_limits import SolverLimits
from ..choosing.placement.solver import solve
from ..choosing.robustness.gain_band import with_gain_band
from ..output.results.placement_record import RecordedSensor, recorded_sensor
from ..site.site import Site
from ..storage.files import save_json
from ..storage.json_dataclass import from_json
from .detection import DetectionJob, run_elsewhere
from .returns import crossing_returns, survey_returns
from .survey import Survey, surroundings

FINALIST_EFFORT = 0.5
"""Largest effort of the search for the best placement by each criterion: its proof is of no use here."""
LONE_HEIGHTS = 3
"""Mounting heights, the lowest, a middle one and the highest, of which there are finalists of that height alone."""
MOVED_BY = 8.0
"""Metres by which a sensor of a near placement is moved at least; nearer ones find nearly the same."""
JUDGED_CLASSES = ("vehicles", "two-wheelers", "pedestrians")
"""Classes of road users, in the order of the shares of an objective."""

Content = TypeVar("Content")


@dataclass(frozen=True)
class Finalist:
    """A placement to judge: the criterion of which it is best, or the finalist that it is near; poses and sensors."""

    name: str
    poses: tuple[int, ...]
    sensors: tuple[RecordedSensor, ...]


@dataclass(frozen=True)
class JudgementRequest:
    """Finalists, the best by the criterion first, and the weight of each class of road users."""

    finalists: tuple[Finalist, ...]
    weights: Mapping[str, float]

    def save(self, path: Path) -> None:
        """Write it to a file for `read_answer`."""
        save_json(path, asdict(self))


def find_finalists(
    survey: Survey, solution: Solution, number: int = DEFAULT_FINALISTS
) -> Generator[Progress, None, JudgementRequest]:
    """Return placements to judge; the first is the solution itself.

    The best by road seen, by returns with and without the allowance for traffic, and by the first two with mounts of
    one height alone; then placements near these in turn, in which one sensor has another pose at its position, or
    another position.

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
    asked = [(name, problem, np.zeros(len(height), dtype=bool)) for name, problem in criteria[1:]]
    for level in levels.tolist() if len(levels) > 1 else []:
        asked += [(f"{name} with mounts of {level:g} m alone", one, height != level) for name, one in criteria[:2]]
    first = solution.placement.chosen
    found = {frozenset(first.tolist()): (criteria[0][0], first, criteria[0][1])}
    for done, (name, problem, other) in enumerate(asked):
        progress = Progress(done, len(asked), f"choosing finalists by {name}")
        yield progress
        with suppress(SeipError):  # no placement is possible, as at one height alone
            alone = replace(problem, forbidden=~problem.allowed | other)
            chosen = np.sort((yield from within(progress, solve(alone, limits))).chosen)
            if len(found) < number:
                found.setdefault(frozenset(chosen.tolist()), (name, chosen, problem))
    nearby = deque(_near(survey.site, *base, turn % 2) for turn, base in enumerate(found.values()))
    while nearby and len(found) < number:
        near = next(nearby[0], None)
        if near is None:
            nearby.popleft()
        else:
            nearby.rotate(-1)
            found.setdefault(frozenset(near[1].tolist()), near)
    finalists = (Finalist(name, tuple(chosen.tolist()), _sensors(survey, chosen)) for name, chosen, _ in found.values())
    return JudgementRequest(tuple(finalists), dict(zip(JUDGED_CLASSES, solution.objective.shares, strict=True)))


def check_judged(objective: Objective) -> None:
    """Raise SeipError if finalists cannot be judged for an objective."""
    if objective.cheapest:
        raise SeipError("finalists need a number of sensors or a budget, not a coverage to reach")
    if objective.scenarios.kind != "nominal" or objective.measure is not None:
        raise SeipError("finalists are judged in traffic as planned: leave out pose errors, traffic and failures")


def judged_solution(survey: Survey, solution: Solution, judgement: Judgement) -> Generator[Progress, None, Solution]:
    """Return the solution of the winner, with the bound and other numbers of sensors of the best by the criterion."""
    chosen, known = np.array(judgement.finalists[0].poses, dtype=np.int64), solution.placement
    if judgement.plain == 0:
        return replace(solution, judgement=judgement)
    before = solution.deployment.returns
    if before is None:
        problem = placement_problem(survey.site, survey.grid.visible, survey.models, solution.objective)
    else:
        returns = yield from survey_returns(survey, solution.objective)
        problem = returns.problem()
    value, solver = problem.value(chosen), known.solver
    placement = assess(problem, chosen, value, known.bound, optimal=False, solver=solver, notes=())
    if before is None:
        winner = replace(solution, placement=placement, greedy=None, deployment=survey.deploy(chosen))
    else:
        winner = replace(returns.solution(survey, placement, None), front=solution.front)
        summary = replace(winner.deployment.returns or before, front=before.front)
        winner = replace(winner, deployment=replace(winner.deployment, returns=summary))
    deployment = yield from with_gain_band(surroundings(survey), winner.deployment)
    winner = replace(winner, deployment=deployment, judgement=judgement)
    return replace(winner, crossings=crossing_returns(survey, winner))


def judge_elsewhere(
    job: DetectionJob, request: JudgementRequest, scene: Path, folder: Path
) -> Generator[Progress, None, Judgement]:
    """Judge finalists in another Python, which has PyTorch.

    Parameters
    ----------
    scene : path
        A .blend in a folder for temporary files.
    folder : path
        Folder for detections, which later judgements use again.

    Raises
    ------
    SeipError
        The command fails.
    """
    asked, answered = scene.parent / "finalists.json", scene.parent / "judgement.json"
    request.save(asked)
    command = [job.python.program, "-m", "headless.finalists", scene, asked, answered, "-o", folder, *job.options()]
    yield from run_elsewhere(job.python, command, scene.parent / "log")
    return read_answer(Judgement, answered)


def read_answer(kind: type[Content], path: Path) -> Content:
    """Read a request or a judgement from a file.

    Raises
    ------
    SeipError
        The file is damaged or missing.
    """
    try:
        return from_json(kind, json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError) as error:
        raise SeipError(f"{path} is damaged or missing ({error}): judge again") from error


def _criteria(survey: Survey, objective: Objective) -> Generator[Progress, None, list[tuple[str, PlacementProblem]]]:
    """Return the criteria at hand with their problems, the plain one first and the other one of the product next."""
    returns = yield from survey_returns(survey, objective)
    road = placement_problem(survey.site, survey.grid.visible, survey.models, objective)
    known = {"road": ("road seen", road), "returns": ("returns", returns.problem())}
    plain = known.pop(criterion_of(objective, survey.models))
    empty = replace(returns.problem(), amounts=returns.grid.returns)
    return [plain, *known.values(), ("returns in an empty street", empty)]


def _near(
    site: Site, name: str, chosen: Integer, problem: PlacementProblem, first: int
) -> Iterator[tuple[str, Integer, PlacementProblem]]:
    """Yield placements near one, best first: with another pose, or another position, of one sensor in turn.

    Parameters
    ----------
    first : {0, 1}
        Whether another position comes first.
    """
    candidates = site.candidates
    kinds: tuple[list[tuple[float, int, int]], ...] = ([], [])
    for gone in chosen.tolist():
        rest = chosen[chosen != gone]
        together = problem.amounts[rest].sum(axis=0, dtype=np.float64)
        same = problem.positions == problem.positions[gone]
        same[gone] = False
        far = np.hypot(*(problem.xyz[:, :2] - problem.xyz[gone, :2]).T) >= MOVED_BY
        for kind, mask in zip(kinds, (same, far), strict=True):
            for one in np.flatnonzero(mask & _fits(problem, rest)).tolist():
                kind.append((-float(problem.weights @ problem.g(together + problem.amounts[one])), gone, one))
    lists = (sorted(kinds[first]), sorted(kinds[1 - first]))
    for _, gone, one in filter(None, chain.from_iterable(zip_longest(*lists))):
        place = f"{candidates.position_name[candidates.position_of[one]]} at {candidates.height[one]:g} m"
        yield f"{name}, but {place}", np.sort(np.append(chosen[chosen != gone], one)), problem


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


def _sensors(survey: Survey, chosen: Integer) -> tuple[RecordedSensor, ...]:
    return tuple(recorded_sensor(sensor, survey.site) for sensor in survey.deploy(chosen).sensors)
