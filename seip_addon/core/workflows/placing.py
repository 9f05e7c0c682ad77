"""Optimise a placement on a survey: one criterion over scenarios with a risk measure, under constraints."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..acceptance import Acceptance, until_accepted
from ..choosing.placement.cheapest import cheapest_for_share
from ..choosing.placement.deployment import Deployment, deploy
from ..choosing.placement.front import front_of
from ..choosing.placement.objective import (
    CHOSEN_FOR,
    MOVED,
    FrontPoint,
    Objective,
    Solution,
    criterion_of,
    placement_problem,
    target_weights,
    with_count,
)
from ..choosing.placement.problem import PlacementProblem
from ..choosing.placement.returns_summary import ReturnsPoint
from ..choosing.placement.risk import Risk
from ..choosing.placement.search_limits import DEFAULT_LIMITS, SolverLimits
from ..choosing.placement.solver import solve, solve_greedy
from ..choosing.robustness.gain_band import with_gain_band
from ..choosing.robustness.pose_error_evaluation import PoseErrorEvaluation
from ..choosing.robustness.pose_study import PoseStudySettings, pose_message, pose_study
from ..choosing.robustness.robust_study import RobustPlacements, robust_placements, robust_study
from ..choosing.robustness.traffic_study import (
    evaluate_in_traffic,
    traffic_placements,
    traffic_scenarios,
    traffic_study,
)
from ..errors import SeipError
from ..progress import Progress
from ..sensing.lidar.model import LidarModel
from ..sensing.scenarios.traffic_instants import spread_instants
from ..sensing.visibility.surroundings import Surroundings
from ..site.site import Site
from .returns import crossing_returns, place_by_returns, returns_problem
from .survey import Survey, surroundings
from .traffic_runs import TrafficRuns


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
        placement = yield from solve(problem, limits, describe=problem.describe_road)
        greedy = solve_greedy(problem)
    deployment = deploy(site, models, visible[placement.chosen], placement.chosen)
    return Solution(with_count(objective, site), placement, greedy, deployment)


DRAWS_OF_KIND = 100
"""Largest number of draws with one kind of pose error only."""

ACCEPTED_MESSAGE = "accepted before the end of the search: running it to its end may find a better placement"

_OVER_INSTANTS = {1.0: "on average over", 0.25: "in the worst quarter of", 0.0: "in the worst of"}


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
    measure, scenarios = objective.measure, objective.scenarios
    limits = replace(survey.settings.limits, acceptance=acceptance)
    if measure is None:
        solution = yield from _nominal(survey, objective, limits)
    elif scenarios.kind == "traffic":
        solution = yield from _in_traffic(survey, objective, limits, measure, _required(runs))
    else:
        solution = yield from _under_risk(survey, objective, limits, measure)
    around = surroundings(survey)
    deployment = yield from with_gain_band(around, solution.deployment)
    notes = [*solution.placement.notes]
    if acceptance is not None and acceptance.accepted and solution.placement.status != "optimal":
        notes.append(ACCEPTED_MESSAGE)
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
    problem = placement_problem(survey.site, survey.grid.visible, survey.models, objective)
    if summary is not None:
        problem, _, _ = yield from returns_problem(survey, objective)
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


def _nominal(survey: Survey, objective: Objective, limits: SolverLimits) -> Generator[Progress, None, Solution]:
    """Optimise for nominal poses on the empty road."""
    if criterion_of(objective, survey.models) == "returns":
        return (yield from place_by_returns(survey, objective, limits))
    return (yield from optimise(survey.site, survey.grid.visible, survey.models, objective, limits))


def _under_risk(
    survey: Survey, objective: Objective, limits: SolverLimits, measure: Risk
) -> Generator[Progress, None, Solution]:
    """Optimise a risk measure over pose errors, or over sensor failures in the nominal scenario."""
    site, models, grid = survey.site, survey.models, survey.grid
    around, scenarios = surroundings(survey), objective.scenarios
    problem = placement_problem(site, grid.visible, models, objective)
    placements = yield from robust_placements(around, problem, scenarios, [measure], limits)
    placement = placements.robust[measure]
    poses = placement.chosen
    deployment = deploy(site, models, grid.rows(poses), poses)
    over = f" over {scenarios.optimised} scenarios" if scenarios.errs else ""
    name = measure.describe() if scenarios.errs else measure.describe_outcome()
    notes = (f"{CHOSEN_FOR}for {name}{over}: objective, bound and gap refer to that", *placement.notes)
    evaluate = _evaluated_under_risk(around, problem, objective, placements, deployment)
    evaluation = yield from until_accepted(evaluate, limits.acceptance, None)
    notes += () if evaluation is None else evaluation.messages()
    return Solution(with_count(objective, site), replace(placement, notes=notes), None, deployment, evaluation)


def _evaluated_under_risk(
    around: Surroundings,
    problem: PlacementProblem,
    objective: Objective,
    placements: RobustPlacements,
    deployment: Deployment,
) -> Generator[Progress, None, PoseErrorEvaluation]:
    """Evaluate placements on held-out scenarios, and the robust one under each kind of pose error."""
    scenarios = objective.scenarios
    study = yield from robust_study(around, problem, scenarios, placements)
    under_errors = None
    if scenarios.errs:
        draws = scenarios.evaluated
        settings = PoseStudySettings(scenarios.pose_errors, draws, min(DRAWS_OF_KIND, draws), scenarios.seed + 1)
        under_errors = yield from pose_study(around, deployment, settings)
    return PoseErrorEvaluation(study, under_errors)


def _in_traffic(
    survey: Survey, objective: Objective, limits: SolverLimits, measure: Risk, runs: TrafficRuns
) -> Generator[Progress, None, Solution]:
    """Optimise a risk measure over instants of traffic, whose vehicles block the view."""
    site, models, grid = survey.site, survey.models, survey.grid
    around, scenarios = surroundings(survey), objective.scenarios
    problem = placement_problem(site, grid.visible, models, objective)
    instants = spread_instants(runs.optimisation, scenarios.optimised, scenarios.seed)
    views = yield from traffic_scenarios(around, problem, instants)
    placements = yield from traffic_placements(problem, views, limits, measure)
    placement = placements["traffic"]
    held_out = spread_instants(runs.evaluation, scenarios.evaluated, scenarios.seed + 1)
    evaluate = traffic_study(around, problem, placements, len(instants), held_out)
    study = yield from until_accepted(evaluate, limits.acceptance, None)
    note = (
        f"{CHOSEN_FOR}to see the road in traffic, {_OVER_INSTANTS[measure.tail]} {len(instants)} "
        "instants: objective, bound and gap refer to that"
    )
    messages = () if study is None else study.messages()
    placement = replace(placement, notes=(note, *placement.notes, *messages))
    deployment = deploy(site, models, grid.rows(placement.chosen), placement.chosen)
    return Solution(with_count(objective, site), placement, None, deployment, study)


def _evaluated(survey: Survey, solution: Solution, runs: TrafficRuns | None) -> Generator[Progress, None, list[str]]:
    """Return messages on a nominal placement in the scenarios of its objective."""
    objective, around = solution.objective, surroundings(survey)
    scenarios = objective.scenarios
    if scenarios.errs:
        settings = PoseStudySettings(scenarios.pose_errors, scenarios.evaluated, 0, scenarios.seed + 1)
        return [pose_message((yield from pose_study(around, solution.deployment, settings)))]
    if scenarios.kind == "traffic":
        held_out = spread_instants(_required(runs).evaluation, scenarios.evaluated, scenarios.seed + 1)
        weights, placements = target_weights(survey.site, objective), {"the empty road": solution.placement}
        (evaluation,) = yield from evaluate_in_traffic(around, placements, weights, held_out)
        return [evaluation.message]
    return []


def _required(runs: TrafficRuns | None) -> TrafficRuns:
    if runs is None:
        raise SeipError("the scenarios are traffic, but there are no runs: name runs of traffic")
    return runs
