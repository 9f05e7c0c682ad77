"""Survey of one site of a network: its placement problem, and the solution of the placement that is taken there."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import SeipError
from ..base.progress import Progress
from ..choosing.network.frontier import SolvedBudget
from ..choosing.network.site_problem import SiteProblem, check_problem
from ..choosing.placement.concave import relative_gap
from ..choosing.placement.deployment import deploy, pose_prices
from ..choosing.placement.objective import Objective, Solution, criterion_of, placement_constraints
from ..choosing.placement.problem import Placement
from .network_sites import NetworkPlace
from .returns import survey_returns
from .survey import Survey
from .survey_settings import SurveySettings


@dataclass(frozen=True)
class NetworkRequest:
    """Choices of a network besides its places.

    Parameters
    ----------
    budget : float, dollars
    tolerance : float
        Gap at which the search ends, as a share of the value.
    objective : Objective
        Criterion and largest number of sensors at each site.
    """

    budget: float
    tolerance: float
    approaches: float
    settings: SurveySettings
    objective: Objective


def site_problem(survey: Survey, objective: Objective, place: NetworkPlace) -> Generator[Progress, None, SiteProblem]:
    """Return the placement problem of a site of a network.

    Parameters
    ----------
    objective : Objective
        Criterion, and the largest number of sensors at the site.

    Raises
    ------
    SeipError
        The site demands a sensor somewhere, or no candidate sees anything.
    """
    site, candidates = survey.site, survey.site.candidates
    constraints = placement_constraints(site, survey.models, _at_site(survey, objective))
    if len(constraints.mandatory_groups):
        raise SeipError(
            f"{constraints.group_names[0]} must carry a sensor, which is not possible in a network: clear the "
            "mandatory poles and areas of the site"
        )
    allowed = np.flatnonzero(constraints.allowed)
    criterion = criterion_of(objective, survey.models)
    returns, weights = np.zeros((len(candidates), 0), dtype=np.float32), np.zeros(0)
    if criterion == "returns":
        found = yield from survey_returns(survey, objective, threads=1)
        returns, weights = found.in_traffic(), found.weights
    geographic = site.geographic(candidates.xyz)
    if geographic is None:  # a scene without a projection lies where the table says
        latlon = np.tile((place.latitude, place.longitude), (len(candidates), 1))
    else:
        latlon = geographic[:, 1::-1]
    if len(allowed) != len(candidates):  # forbidden poses keep their indices, and have no value
        forbidden = ~constraints.allowed
        returns = np.where(forbidden[:, None], np.float32(0.0), returns)
    visible = survey.grid.visible & constraints.allowed[:, None]
    problem = SiteProblem(
        criterion="returns" if criterion == "returns" else "road",
        visible=visible,
        returns=returns,
        user_weights=weights,
        prices=pose_prices(candidates, survey.models),
        positions=candidates.position_of,
        xyz=candidates.xyz,
        heights=candidates.height,
        latlon=np.round(latlon, 8),
        labels=candidates.sensor,
        names=candidates.position_name[candidates.position_of],
        most_sensors=_at_site(survey, objective).count or len(candidates.position),
    )
    check_problem(problem)
    return problem


def taken_solution(survey: Survey, objective: Objective, taken: SolvedBudget) -> Generator[Progress, None, Solution]:
    """Return the solution of the placement that an allocation takes at a site, as `place` returns it."""
    objective = _at_site(survey, objective)
    chosen = np.array(taken.chosen, dtype=np.int64)
    optimal = taken.bound <= taken.value
    rows = survey.grid.rows(chosen)
    covered = float(rows.any(axis=0).sum())
    of_returns = criterion_of(objective, survey.models) == "returns"
    value, bound = (taken.value, taken.bound) if of_returns else (covered, taken.bound * rows.shape[1])
    placement = Placement(
        chosen=chosen,
        objective=value,
        bound=value if optimal else bound,
        gap=0.0 if optimal else math.expm1(bound - value) if of_returns else relative_gap(value, bound),
        status="optimal" if optimal else "feasible",
        solver="network allocation",
        price=taken.price,
        notes=("the money at this site is its share of the budget of a network",),
    )
    if of_returns:
        return (yield from survey_returns(survey, objective, threads=1)).solution(survey, placement, None)
    return Solution(objective, placement, None, deploy(survey.site, survey.models, rows, chosen))


def _at_site(survey: Survey, objective: Objective) -> Objective:
    """Return the objective with no more sensors than the site has positions."""
    positions = len(survey.site.candidates.position)
    return replace(objective, count=min(objective.count or positions, positions))
