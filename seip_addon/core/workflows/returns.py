"""Placement by expected returns from road users."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from ..base.arrays import Float, Integer
from ..base.errors import SeipError
from ..base.progress import Progress
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
from ..choosing.placement.returns_summary import ENOUGH_RETURNS, CrossingReturns, ReturnsSummary
from ..sensing.returns.expected_returns import expected_returns
from ..sensing.returns.occlusion import returns_in_traffic
from ..sensing.returns.returns_grid import ReturnsGrid, returns_key, stored_returns
from ..sensing.returns.road_users import BODIES, RoadUsers, road_users
from ..sensing.scans.sensor import MountedSensor
from ..sensing.visibility.ray_casting import engine_name, make_ray_caster
from ..site.targets import Targets
from .survey import Layout, Survey

CROSSING_SHARE = 0.5
"""Share of the weight of pedestrians that is on crossings, which are 5 to 7 % of the carriageway. In simulated traffic
at two sites, 47 and 74 % of the pedestrians in the region were there (docs/detection.md)."""


@dataclass(frozen=True, eq=False)
class SurveyReturns:
    """Expected returns from the road users of a site, as an objective weights them.

    Parameters
    ----------
    grid : ReturnsGrid
        Returns in plain view.
    """

    layout: Layout
    objective: Objective
    users: RoadUsers
    grid: ReturnsGrid

    @property
    def weights(self) -> Float:
        """Weight of each road user, (m,) float64; see `user_weights`."""
        return user_weights(self.users, self.objective)

    def in_traffic(self, poses: Integer | slice = slice(None)) -> NDArray[np.float32]:
        """Return what is left of the returns from poses by traffic that hides road users, (k, m) float32."""
        origins = self.layout.site.candidates.xyz[poses]
        return returns_in_traffic(self.grid.returns[poses], origins, self.users)

    def problem(self) -> PlacementProblem:
        """State the objective as a problem whose value is the mean of ln(1 + returns in traffic)."""
        constraints = vars(placement_constraints(self.layout.site, self.layout.models, self.objective))
        weights = self.weights
        return PlacementProblem(
            **{**constraints, "weights": weights / math.fsum(weights)}, amounts=self.in_traffic(), g=LOG_RETURNS
        )

    def summary(self, chosen: Integer) -> ReturnsSummary:
        """Return the summary of the returns of chosen poses."""
        return summary_of(
            self.grid.returns[chosen], self.layout.site.candidates.xyz[chosen], self.users, self.objective
        )

    def describe(self, chosen: Integer, value: float) -> str:
        """Return a placement's value, and its returns from road users of each kind, in words."""
        return f"{math.expm1(value):.4g} returns, {self.summary(chosen).describe_each()}"

    def solution(self, survey: Survey, placement: Placement, greedy: Placement | None) -> Solution:
        """Return the solution of a placement on the survey of this layout that was chosen for returns."""
        chosen = placement.chosen
        summary = self.summary(chosen)
        note = f"{CHOSEN_FOR}for returns from road users: {summary.describe()} in one revolution (geometric means)"
        pedestrians = _near_targets(survey.site.targets, self.users, self.grid.returns[chosen])
        return Solution(
            with_count(self.objective, survey.site),
            replace(placement, notes=(note, *summary.warnings(), *placement.notes)),
            greedy,
            replace(survey.deploy(chosen), returns=summary, pedestrian_returns=pedestrians),
        )


def summary_of(returns: NDArray[np.float32], origins: Float, users: RoadUsers, objective: Objective) -> ReturnsSummary:
    """Return the summary of the returns of sensors.

    The criterion has an allowance for traffic that hides road users. Returns from pedestrians on crossings have none:
    they tell whether a pedestrian in plain view is detected.

    Parameters
    ----------
    returns : (k, m) float32
        Expected returns of each sensor from each road user in plain view.
    origins : (k, 3) float64, metres
        Positions of the sensors, local site axes.
    """
    together = returns_in_traffic(returns, origins, users).sum(axis=0, dtype=np.float64)
    in_regions = weights_in_regions(objective, users.weight, users.central)
    kinds = [(name, users.body == body) for body, name in enumerate(BODIES)]
    of_each: dict[str, float] = {name: _typical(together[own], in_regions[own]) for name, own in kinds}
    clear = returns.sum(axis=0, dtype=np.float64)
    enough: dict[str, float] = {
        name: float(np.average(clear[own] >= ENOUGH_RETURNS[name], weights=in_regions[own])) for name, own in kinds
    }
    typical = _typical(together, user_weights(users, objective))
    return ReturnsSummary(typical, of_each, _least_on_crossings(clear, users), enough=enough)


class SensorReturns:
    """Expected returns from road users of sensors at any poses, for the criterion of an objective.

    Parameters
    ----------
    layout : Layout
        Site of the sensors.
    """

    def __init__(self, layout: Layout, objective: Objective) -> None:
        self.users, self.objective, self._targets = road_users(layout.geometry), objective, layout.site.targets
        self._caster = make_ray_caster(layout.site.triangles, engine_name(layout.settings.engine))

    def of(self, sensor: MountedSensor) -> NDArray[np.float32]:
        """Return the expected returns of a sensor from each road user in plain view, (m,) float32."""
        row, _ = expected_returns(self._caster, sensor.xyz, sensor.orientation, sensor.model, self.users)
        return row.astype(np.float32)

    def summary(self, sensors: Sequence[MountedSensor], rows: Sequence[NDArray[np.float32]]) -> ReturnsSummary:
        """Return the summary of sensors, each with its row of returns."""
        origins = np.array([one.xyz for one in sensors]).reshape(-1, 3)
        return summary_of(self._stacked(rows), origins, self.users, self.objective)

    def near_targets(self, rows: Sequence[NDArray[np.float32]]) -> Float:
        """Return the expected returns from the pedestrian nearest to each target, (t,) float64."""
        return _near_targets(self._targets, self.users, self._stacked(rows))

    def _stacked(self, rows: Sequence[NDArray[np.float32]]) -> NDArray[np.float32]:
        return np.array(rows, dtype=np.float32).reshape(-1, len(self.users))


def survey_returns(
    survey: Survey, objective: Objective, threads: int | None = None
) -> Generator[Progress, None, SurveyReturns]:
    """Compute the returns of a survey, or read them from its file."""
    users, engine = road_users(survey.geometry), survey.settings.engine
    grid = yield from stored_returns(survey.returns_path, survey.site, users, survey.models, engine, threads)
    return SurveyReturns(survey, objective, users, grid)


def crossing_returns(survey: Survey, solution: Solution) -> tuple[CrossingReturns, ...]:
    """Return the least expected returns from a pedestrian on each crossing, of all sensors of a solution together."""
    deployment = solution.deployment
    if deployment.returns is not None:
        return deployment.returns.crossings
    users = road_users(survey.geometry)
    on_crossing = np.flatnonzero(users.crossing >= 0)
    if not len(on_crossing) or not deployment.sensors:
        return ()
    parts = ("xyz", "body", "weight", "central", "crossing")
    on_foot = replace(users, **{name: getattr(users, name)[on_crossing] for name in parts})
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
    return None if grid is None or grid.key != key else _near_targets(survey.site.targets, users, grid.returns[chosen])


def _near_targets(targets: Targets, users: RoadUsers, returns: NDArray[np.float32]) -> Float:
    """Return the expected returns from the pedestrian nearest to each target, (t,) float64."""
    on_foot = np.flatnonzero(users.body == BODIES.index("pedestrian"))
    together: Float = returns[:, on_foot].sum(axis=0, dtype=np.float64)
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


def _typical(returns: Float, weight: Float) -> float:
    """Return the weighted geometric mean of 1 + returns, less 1."""
    return float(np.expm1(np.average(np.log1p(returns), weights=weight)))
