"""Price and benefit of robust placements, evaluated on held-out scenarios."""

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Float, Integer
from ...estimates import IntervalEstimate, mean_of, quantile_gain, quantile_of
from ...progress import Progress
from ...sensing.scenarios.scenario_visibility import ScenarioVisibility
from ...sensing.scenarios.visibility_under_errors import draws_for, visibility_under_errors
from ...sensing.visibility.surroundings import Surroundings
from ..placement.problem import Placement, PlacementProblem
from ..placement.risk import Risk
from ..placement.scenarios import Scenarios
from ..placement.search_limits import DEFAULT_LIMITS, SolverLimits
from ..placement.solver import solve
from .pose_study import LOW_QUANTILE


@dataclass(frozen=True, eq=False)
class Contender:
    """A placement with its outcomes in unseen draws.

    Parameters
    ----------
    name : str
        Purpose for which it was optimised.
    planned : float
        Share of the targets' weight that it covers as planned, without failures.
    evaluated_by : Risk
        Risk measure whose outcome is evaluated: coverage, or coverage after a failure.
    undisturbed : float
        Outcome for the poses as planned, as a share of the targets' weight.
    unseen : (n,) float64
        Outcome in each unseen draw.
    """

    name: str
    placement: Placement
    planned: float
    evaluated_by: Risk
    undisturbed: float
    unseen: Float

    @property
    def low(self) -> IntervalEstimate:
        """The 5 % quantile over unseen draws."""
        return quantile_of(self.unseen, LOW_QUANTILE)

    @property
    def mean(self) -> IntervalEstimate:
        """The mean over unseen draws."""
        return mean_of(self.unseen)


@dataclass(frozen=True, eq=False)
class RobustStudy:
    """Comparison of the nominal optimum with robust placements.

    Parameters
    ----------
    scenarios : Scenarios
        Scenarios of pose errors, or the nominal one, on which placements are then also evaluated.
    nominal : tuple of Contender
        Placement chosen for the poses as planned, once for each outcome by which the others are evaluated.
    robust : tuple of Contender
        Placement for each risk measure.
    """

    scenarios: Scenarios
    nominal: tuple[Contender, ...]
    robust: tuple[Contender, ...]

    def beside(self, contender: Contender) -> Contender:
        """Return the nominal optimum, evaluated by the same outcome as a contender."""
        return next(nominal for nominal in self.nominal if nominal.evaluated_by == contender.evaluated_by)

    def price(self, contender: Contender) -> float:
        """Return the planned coverage that a contender loses against the nominal optimum."""
        return self.beside(contender).planned - contender.planned

    def saving(self, contender: Contender) -> IntervalEstimate:
        """Estimate the gain in the 5 % quantile over unseen draws against the nominal optimum."""
        return quantile_gain(contender.unseen, self.beside(contender).unseen, LOW_QUANTILE)


@dataclass(frozen=True, eq=False)
class RobustPlacements:
    """The nominal optimum, and the best placement found for each risk measure."""

    nominal: Placement
    robust: Mapping[Risk, Placement]


def robust_placements(
    around: Surroundings,
    problem: PlacementProblem,
    scenarios: Scenarios,
    risks: Sequence[Risk],
    limits: SolverLimits = DEFAULT_LIMITS,
) -> Generator[Progress, None, RobustPlacements]:
    """Optimise for the planned poses and for each risk measure.

    Parameters
    ----------
    problem : PlacementProblem
        Problem of all candidates of the site.
    """
    every = np.flatnonzero(problem.allowed)  # no rays are cast from poses that may not be chosen
    views = yield from _views(around, problem, scenarios, every)
    views = views.spread_to(every, len(problem.amounts))
    nominal = yield from solve(problem, limits, describe=problem.describe_road)
    robust = {}
    for risk in risks:
        robust[risk] = yield from solve_over(problem, views, risk, nominal.chosen, limits)
    return RobustPlacements(nominal, robust)


def solve_over(
    problem: PlacementProblem,
    views: ScenarioVisibility,
    risk: Risk,
    known: Integer | None = None,
    limits: SolverLimits = DEFAULT_LIMITS,
) -> Generator[Progress, None, Placement]:
    """Choose the placement that maximises a risk measure over scenarios; see `solve`.

    Parameters
    ----------
    views : ScenarioVisibility
        Visibility of all candidates in each scenario.
    known : (k,) int64, optional
        Placement to begin from besides: the result is no worse.
    """
    # scenarios that are all the same are one, so that results without errors have no other rounding
    same = bool((views.packed == views.packed[:1]).all())
    cases = [views.seen(number) for number in range(1 if same else len(views))]
    return (yield from solve(problem, limits, cases=cases, risk=risk, known=known, describe=problem.describe_road))


def outcomes_of(problem: PlacementProblem, scenarios: ScenarioVisibility, risk: Risk, chosen: Integer) -> Float:
    """Return the outcome of chosen candidates in each scenario, (K,) float64, in units of the targets' weight."""
    return risk.outcomes(scenarios.seen_by_each(chosen), problem.weights, problem.most_sensors)


def robust_study(
    around: Surroundings, problem: PlacementProblem, scenarios: Scenarios, placements: RobustPlacements
) -> Generator[Progress, None, RobustStudy]:
    """Evaluate the nominal optimum and robust placements on held-out scenarios."""
    ways = dict.fromkeys(risk.alone for risk in placements.robust)  # in the order of the risks, each once
    entries = [("the poses as planned", placements.nominal, way) for way in ways]
    for risk, placed in placements.robust.items():
        entries.append((risk.describe() if scenarios.errs else risk.describe_outcome(), placed, risk.alone))
    contenders = yield from _evaluated(around, problem, scenarios, entries)
    return RobustStudy(scenarios, tuple(contenders[: len(ways)]), tuple(contenders[len(ways) :]))


def _views(
    around: Surroundings, problem: PlacementProblem, scenarios: Scenarios, poses: Integer, *, held_out: bool = False
) -> Generator[Progress, None, ScenarioVisibility]:
    """Compute the visibility of poses in the scenarios to optimise over, or in the held-out ones."""
    if not scenarios.errs:
        return ScenarioVisibility(np.packbits(problem.amounts[poses], axis=1)[None], problem.amounts.shape[1])
    number, seed = (scenarios.evaluated, scenarios.seed + 1) if held_out else (scenarios.optimised, scenarios.seed)
    drawn = draws_for(around, poses, scenarios.pose_errors, number, seed)
    return (yield from visibility_under_errors(around, poses, drawn))


def _evaluated(
    around: Surroundings,
    problem: PlacementProblem,
    scenarios: Scenarios,
    entries: Sequence[tuple[str, Placement, Risk]],
) -> Generator[Progress, None, list[Contender]]:
    """Evaluate placements on held-out scenarios, all chosen poses at once."""
    used = np.unique(np.concatenate([placement.chosen for _, placement, _ in entries]))
    views = yield from _views(around, problem, scenarios, used, held_out=True)
    planned = replace(views, packed=np.packbits(problem.amounts[used], axis=1)[None])
    total = float(problem.weights.sum())
    contenders = []
    for name, placement, evaluated_by in entries:
        rows = np.searchsorted(used, placement.chosen)
        (undisturbed,) = outcomes_of(problem, planned, evaluated_by, rows)
        outcomes = [  # one draw at a time: all at once take much memory
            outcomes_of(problem, replace(views, packed=views.packed[[draw]]), evaluated_by, rows)
            for draw in range(len(views))
        ]
        unseen = np.concatenate(outcomes) / total
        planned_coverage = placement.covered / total
        contenders.append(
            Contender(name, placement, planned_coverage, evaluated_by, float(undisturbed) / total, unseen)
        )
    return contenders
