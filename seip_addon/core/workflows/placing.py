"""Optimise a placement on a survey: one criterion over scenarios with a risk measure, under constraints."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..base.acceptance import Acceptance, until_accepted
from ..base.arrays import Integer
from ..base.errors import SeipError
from ..base.progress import Progress
from ..choosing.placement.cheapest import UNPROVEN_PRICE, cheapest_for_share
from ..choosing.placement.deployment import Deployment, deploy
from ..choosing.placement.instance import make_instance
from ..choosing.placement.objective import (
    ACCEPTED_MESSAGE,
    CHOSEN_FOR,
    MOVED,
    FrontPoint,
    Objective,
    Solution,
    criterion_of,
    placement_problem,
    with_count,
)
from ..choosing.placement.problem import Placement, PlacementProblem
from ..choosing.placement.returns_summary import ReturnsPoint
from ..choosing.placement.risk import NOMINAL, Risk
from ..choosing.placement.scenarios import Scenarios
from ..choosing.placement.search_limits import DEFAULT_LIMITS, SolverLimits
from ..choosing.placement.solver import UNPROVEN, front_of, solve_greedy, solve_instance
from ..choosing.robustness.comparison import Comparison
from ..choosing.robustness.gain_band import with_gain_band
from ..choosing.robustness.pose_study import pose_study
from ..choosing.robustness.robust_problem import RobustProblem
from ..sensing.lidar.model import LidarModel
from ..site.site import Site
from .returns import crossing_returns, survey_returns
from .survey import Survey, surroundings
from .traffic_runs import TrafficRuns

DRAWS_OF_KIND = 100
"""Largest number of draws with one kind of pose error only."""

_OVER_INSTANTS = {1.0: "on average over", 0.25: "in the worst quarter of", 0.0: "in the worst of"}


def optimise(
    site: Site,
    visible: NDArray[np.bool_],
    models: Mapping[str, LidarModel],
    objective: Objective,
    limits: SolverLimits = DEFAULT_LIMITS,
) -> Generator[Progress, None, Solution]:
    """Optimise a placement on a site: the most coverage, or the least price for a coverage.

    Parameters
    ----------
    visible : (c, t) bool

    Raises
    ------
    SeipError
        Same as for `placement_problem`, `solve` and `cheapest_for_share`.
    """
    problem = placement_problem(site, visible, models, objective)
    if objective.coverage is not None:
        placement = yield from cheapest_for_share(problem, objective.coverage, limits, problem.describe_road)
        greedy = None
    else:
        placement, greedy = yield from _searched(problem, problem.describe_road, limits)
    deployment = deploy(site, models, visible[placement.chosen], placement.chosen)
    return Solution(with_count(objective, site), placement, greedy, deployment)


def _searched(
    problem: PlacementProblem, describe: Callable[[Integer, float], str], limits: SolverLimits
) -> Generator[Progress, None, tuple[Placement, Placement]]:
    """Return the best placement that a search finds, and that of the greedy algorithm."""
    instance = make_instance(problem)
    placement = yield from solve_instance(problem, instance, limits, describe=describe)
    return placement, solve_greedy(problem, instance)


def place(
    survey: Survey, objective: Objective, runs: TrafficRuns | None = None, acceptance: Acceptance | None = None
) -> Generator[Progress, None, Solution]:
    """Optimise a placement, evaluate it on held-out scenarios, and add notes on the evaluation.

    Parameters
    ----------
    runs : TrafficRuns, optional
        Runs of traffic; required if the scenarios are traffic.
    acceptance : Acceptance, optional
        User's request to end the search with the best placement found so far.

    Raises
    ------
    SeipError
        Same as for `placement_problem`, `solve` and `spread_instants`.
    """
    measure = objective.measure
    limits = replace(survey.settings.limits, acceptance=acceptance)
    if measure is not None:
        solution = yield from _over_scenarios(survey, objective, limits, measure, runs)
    elif criterion_of(objective, survey.models) == "returns":
        returns = yield from survey_returns(survey, objective)
        placement, greedy = yield from _searched(returns.problem(), returns.describe, limits)
        solution = returns.solution(survey, placement, greedy)
    else:
        solution = yield from optimise(survey.site, survey.grid.visible, survey.models, objective, limits)
    deployment = yield from with_gain_band(surroundings(survey), solution.deployment)
    notes = [*solution.placement.notes]
    if acceptance is not None and acceptance.accepted and solution.placement.status != "optimal":
        notes = [ACCEPTED_MESSAGE, *(note for note in notes if note not in {UNPROVEN, UNPROVEN_PRICE})]
    if measure is None and deployment.sensors:
        evaluation = _evaluated(survey, replace(solution, deployment=deployment), runs)
        notes += yield from until_accepted(evaluation, acceptance, [])
    return replace(solution, deployment=deployment, placement=replace(solution.placement, notes=tuple(notes)))


def with_context(
    survey: Survey, solution: Solution, acceptance: Acceptance | None = None
) -> Generator[Progress, None, Solution]:
    """Return a solution with what reports add: other numbers of sensors, and a pedestrian's returns on crossings.

    Parameters
    ----------
    acceptance : Acceptance, optional
        User's request to end the search. Other numbers of sensors are then left out.
    """
    solution = yield from until_accepted(_with_front(survey, solution), acceptance, solution)
    return replace(solution, crossings=crossing_returns(survey, solution))


def _with_front(survey: Survey, solution: Solution) -> Generator[Progress, None, Solution]:
    """Return a nominal solution with the best placements of fewer and of more sensors."""
    objective, placement, summary = solution.objective, solution.placement, solution.deployment.returns
    if placement.status == MOVED or not len(placement.chosen) or objective.measure is not None:
        return solution
    if summary is None:
        problem = placement_problem(survey.site, survey.grid.visible, survey.models, objective)
    else:
        problem = (yield from survey_returns(survey, objective)).problem()
    # the bound of a solution holds for its own number of sensors unless a budget or a coverage limits it
    own = range(len(placement.chosen), (objective.count or 0) + 1)
    free = objective.budget is None and not objective.cheapest
    found = yield from front_of(problem, placement, own if free else range(0))
    whole = math.fsum(problem.weights)
    if summary is None:
        points = [
            FrontPoint(count, one.objective / whole, one.price, (one.bound - one.objective) / whole)
            for count, one in found.items()
        ]
        return replace(solution, front=tuple(points))
    returns = [ReturnsPoint(count, math.expm1(one.objective), one.price, one.gap) for count, one in found.items()]
    deployment = replace(solution.deployment, returns=replace(summary, front=tuple(returns)))
    return replace(solution, deployment=deployment)


def _robust_problem(survey: Survey, objective: Objective, runs: TrafficRuns | None) -> RobustProblem:
    """Return the problem of an objective over its scenarios."""
    problem = placement_problem(survey.site, survey.grid.visible, survey.models, objective)
    if objective.scenarios.kind != "traffic":
        return RobustProblem(surroundings(survey), problem, objective.scenarios)
    if runs is None:
        raise SeipError("the scenarios are traffic, but there are no runs: name runs of traffic")
    return RobustProblem(surroundings(survey), problem, objective.scenarios, (runs.optimisation, runs.evaluation))


def _over_scenarios(
    survey: Survey, objective: Objective, limits: SolverLimits, measure: Risk, runs: TrafficRuns | None
) -> Generator[Progress, None, Solution]:
    """Optimise a risk measure over scenarios, and compare the placement with the nominal optimum."""
    robust = _robust_problem(survey, objective, runs)
    nominal, placements = yield from robust.placements([measure], limits)
    placement = placements[measure]
    deployment = survey.deploy(placement.chosen)
    compared = _compared(robust, nominal, placements, deployment)
    evaluation = yield from until_accepted(compared, limits.acceptance, None)
    note = f"{CHOSEN_FOR}{_purpose(robust.scenarios, measure)}: objective, bound and gap refer to that"
    messages = () if evaluation is None else evaluation.messages()
    placement = replace(placement, notes=(note, *placement.notes, *messages))
    return Solution(with_count(objective, survey.site), placement, None, deployment, evaluation)


def _purpose(scenarios: Scenarios, measure: Risk) -> str:
    """Return the purpose of a placement that is optimised over scenarios, as text that follows `CHOSEN_FOR`."""
    if scenarios.kind == "traffic":
        return f"to see the road in traffic, {_OVER_INSTANTS[measure.tail]} {scenarios.optimised} instants"
    if scenarios.errs:
        return f"for {measure.describe()} over {scenarios.optimised} scenarios"
    return f"for {measure.describe_outcome()}"


def _compared(
    robust: RobustProblem, nominal: Placement, placements: Mapping[Risk, Placement], deployment: Deployment
) -> Generator[Progress, None, Comparison]:
    """Compare the placement with the nominal optimum, and study it under each kind of pose error."""
    (comparison,) = yield from robust.compare(nominal, placements)
    scenarios = robust.scenarios
    if not scenarios.errs:
        return comparison
    draws = scenarios.evaluated, min(DRAWS_OF_KIND, scenarios.evaluated)
    study = yield from pose_study(robust.around, deployment, scenarios.pose_errors, scenarios.seed + 1, draws)
    return replace(comparison, pose_study=study)


def _evaluated(survey: Survey, solution: Solution, runs: TrafficRuns | None) -> Generator[Progress, None, list[str]]:
    """Return messages on a nominal placement in the scenarios of its objective."""
    scenarios = solution.objective.scenarios
    if scenarios.kind == "nominal":
        return []
    robust = _robust_problem(survey, solution.objective, runs)
    if scenarios.errs:
        errors, seed, draws = scenarios.pose_errors, scenarios.seed + 1, (scenarios.evaluated, 0)
        study = yield from pose_study(robust.around, solution.deployment, errors, seed, draws)
        return [study.message()]
    (evaluated,) = yield from robust.evaluate([("the empty road", solution.placement, NOMINAL)])
    return [evaluated.traffic_message]
