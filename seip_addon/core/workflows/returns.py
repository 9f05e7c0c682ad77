"""Placement by expected returns from road users."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray

from ..arrays import Float, Integer
from ..choosing.placement.concave import LOG_RETURNS
from ..choosing.placement.objective import (
    CHOSEN_FOR,
    Objective,
    Solution,
    placement_constraints,
    weights_in_regions,
    with_count,
)
from ..choosing.placement.problem import Placement, PlacementProblem
from ..choosing.placement.returns_summary import CrossingReturns, ReturnsSummary
from ..choosing.placement.search_limits import SolverLimits
from ..choosing.placement.solver import solve, solve_greedy
from ..errors import SeipError
from ..progress import Progress
from ..sensing.returns.expected_returns import expected_returns
from ..sensing.returns.occlusion import returns_in_traffic
from ..sensing.returns.returns_grid import ReturnsGrid, returns_key, stored_returns
from ..sensing.returns.road_users import BODIES, RoadUsers, road_users
from ..sensing.visibility.ray_casting import engine_name, make_ray_caster
from ..site.targets import Targets
from .survey import Survey

CROSSING_SHARE = 0.5
"""Share of the weight of pedestrians that is on crossings, which are 5 to 7 % of the carriageway. In simulated traffic
at two sites, 47 and 74 % of the pedestrians in the region were there (docs/detection.md)."""


def place_by_returns(survey: Survey, objective: Objective, limits: SolverLimits) -> Generator[Progress, None, Solution]:
    """Choose the placement with the most returns from road users.

    Raises
    ------
    SeipError
        Same as for `placement_problem` and `solve`.
    """
    problem, grid, users = yield from returns_problem(survey, objective)
    origins = survey.site.candidates.xyz

    def describe(chosen: Integer, value: float) -> str:
        summary = _summarised(grid.returns[chosen], origins[chosen], users, objective)
        return f"{math.expm1(value):.4g} returns, {summary.describe_each()}"

    placement = yield from solve(problem, limits, describe=describe)
    return returns_solution(survey, grid, users, objective, (placement, solve_greedy(problem)))


def returns_problem(
    survey: Survey, objective: Objective
) -> Generator[Progress, None, tuple[PlacementProblem, ReturnsGrid, RoadUsers]]:
    """State an objective as a problem of returns from road users, whose weights add up to 1.

    Returns
    -------
    PlacementProblem
        Its value is the mean of ln(1 + returns); returns are those left by traffic that hides road users.
    ReturnsGrid
        Returns in plain view.
    RoadUsers
    """
    site, models = survey.site, survey.models
    users = road_users(survey.geometry)
    grid = yield from stored_returns(survey.returns_path, site, users, models, survey.settings.engine)
    returns = returns_in_traffic(grid.returns, site.candidates.xyz, users)
    weights = user_weights(users, objective)
    constraints = vars(placement_constraints(site, models, objective))
    problem = PlacementProblem(
        **{**constraints, "weights": weights / math.fsum(weights)}, amounts=returns, g=LOG_RETURNS
    )
    return problem, grid, users


def returns_solution(
    survey: Survey,
    grid: ReturnsGrid,
    users: RoadUsers,
    objective: Objective,
    placements: tuple[Placement, Placement | None],
) -> Solution:
    """Return the solution of a placement that was chosen for returns, with the greedy placement if there is one."""
    placement, greedy = placements
    chosen = placement.chosen
    summary = _summarised(grid.returns[chosen], survey.site.candidates.xyz[chosen], users, objective)
    note = f"{CHOSEN_FOR}for returns from road users: {summary.describe()} in one revolution (geometric means)"
    return Solution(
        with_count(objective, survey.site),
        replace(placement, notes=(note, *summary.warnings(), *placement.notes)),
        greedy,
        replace(
            survey.deploy(chosen),
            returns=summary,
            pedestrian_returns=_near_targets(survey.site.targets, users, grid, chosen),
        ),
    )


def crossing_returns(survey: Survey, solution: Solution) -> tuple[CrossingReturns, ...]:
    """Return the least expected returns from a pedestrian on each crossing, of all sensors of a solution together."""
    deployment = solution.deployment
    if deployment.returns is not None:
        return deployment.returns.crossings
    users = road_users(survey.geometry)
    on_crossing = np.flatnonzero(users.crossing >= 0)
    if not len(on_crossing) or not deployment.sensors:
        return ()
    on_foot = replace(
        users,
        xyz=users.xyz[on_crossing],
        body=users.body[on_crossing],
        weight=users.weight[on_crossing],
        central=users.central[on_crossing],
        crossing=users.crossing[on_crossing],
    )
    caster = make_ray_caster(survey.site.triangles, engine_name(survey.settings.engine))
    together = sum(
        expected_returns(caster, sensor.xyz, sensor.orientation, sensor.model, on_foot)[0]
        for sensor in deployment.sensors
    )
    return _least_on_crossings(np.asarray(together, dtype=np.float64), on_foot)


def _least_on_crossings(returns: Float, users: RoadUsers) -> tuple[CrossingReturns, ...]:
    """Return the least of the returns of road users (m,) on each crossing that some of them are on."""
    return tuple(
        CrossingReturns(name, float(returns[users.crossing == number].min()))
        for number, name in enumerate(users.crossings)
        if (users.crossing == number).any()
    )


def stored_pedestrian_returns(survey: Survey, chosen: Integer) -> Float | None:
    """Return the expected returns from a pedestrian near each target, (t,), if the returns grid is stored."""
    users = road_users(survey.geometry)
    key = returns_key(survey.site, users, survey.models, engine_name(survey.settings.engine))
    try:
        grid = None if survey.returns_path is None else ReturnsGrid.load(survey.returns_path)
    except SeipError:
        return None
    return None if grid is None or grid.key != key else _near_targets(survey.site.targets, users, grid, chosen)


def _near_targets(targets: Targets, users: RoadUsers, grid: ReturnsGrid, chosen: Integer) -> Float:
    """Return the expected returns from the pedestrian nearest to each target, (t,) float64."""
    on_foot = np.flatnonzero(users.body == BODIES.index("pedestrian"))
    together: Float = grid.returns[np.ix_(chosen, on_foot)].sum(axis=0, dtype=np.float64)
    tree = shapely.STRtree(shapely.points(users.xyz[on_foot, :2]))
    nearest: Float = together[tree.nearest(shapely.points(targets.xyz[:, :2]))]
    return nearest


def user_weights(users: RoadUsers, objective: Objective) -> Float:
    """Return the weight of each road user under an objective, (m,) float64; their mean is 1 without weighted regions.

    The shares of the objective are those of all cars, all cyclists and all pedestrians, each spread evenly over the
    places of its kind. `CROSSING_SHARE` of that of the pedestrians is on crossings, if the site has any.
    """
    kind = np.where(users.crossing >= 0, len(BODIES), users.body)
    share = np.append(objective.shares, 0.0)
    if (kind == len(BODIES)).any():
        on_foot = BODIES.index("pedestrian")
        share[-1] = CROSSING_SHARE * share[on_foot]
        share[on_foot] -= share[-1]
    each = share / share.sum() * len(users) / np.maximum(1, np.bincount(kind, minlength=len(share)))
    weights: Float = weights_in_regions(objective, users.weight, users.central) * each[kind]
    return weights


def _summarised(returns: NDArray[np.float32], origins: Float, users: RoadUsers, objective: Objective) -> ReturnsSummary:
    """Return the summary of the returns (k, m) of chosen poses at positions (k, 3).

    What the placement was chosen for has an allowance for traffic that hides road users. Returns from pedestrians on
    crossings have none: they tell whether a pedestrian in plain view is detected.
    """
    in_plain_view = returns.sum(axis=0, dtype=np.float64)
    together = returns_in_traffic(returns, origins, users).sum(axis=0, dtype=np.float64)
    weight = user_weights(users, objective)
    in_regions = weights_in_regions(objective, users.weight, users.central)
    kinds = [(name, users.body == body) for body, name in enumerate(BODIES)]
    of_each: dict[str, float] = {name: _typical(together[own], in_regions[own]) for name, own in kinds}
    return ReturnsSummary(_typical(together, weight), of_each, _least_on_crossings(in_plain_view, users))


def _typical(returns: Float, weight: Float) -> float:
    """Return the weighted geometric mean of 1 + returns, less 1."""
    return float(np.expm1(np.average(np.log1p(returns), weights=weight)))
