"""Placement over scenarios of pose errors, sensor failures or traffic, and its evaluation on held-out ones."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.arrays import Float, Integer
from ...base.progress import Progress
from ...sensing.scenarios.scenario_visibility import (
    ScenarioVisibility,
    visibility_in_traffic,
    visibility_under_errors,
)
from ...sensing.scenarios.traffic_instants import Instants, spread_instants
from ...sensing.traffic.trajectories import Trajectories
from ...sensing.visibility.surroundings import Surroundings
from ..placement.problem import Placement, PlacementProblem
from ..placement.risk import Risk
from ..placement.scenarios import Scenarios
from ..placement.search_limits import DEFAULT_LIMITS, SolverLimits
from ..placement.solver import solve
from .comparison import Comparison, EvaluatedPlacement


@dataclass(frozen=True, eq=False)
class RobustProblem:
    """A placement problem over scenarios.

    Parameters
    ----------
    problem : PlacementProblem
        Problem of all candidates of the site in the nominal scenario.
    scenarios : Scenarios
        Scenarios of pose errors or traffic, or the nominal one, on which placements are then also evaluated.
    runs : pair of sequences of Trajectories
        Runs of traffic to optimise on, and others to evaluate on; required if the scenarios are traffic.
    """

    around: Surroundings
    problem: PlacementProblem
    scenarios: Scenarios
    runs: tuple[Sequence[Trajectories], Sequence[Trajectories]] = ((), ())

    def placements(
        self, risks: Sequence[Risk], limits: SolverLimits = DEFAULT_LIMITS
    ) -> Generator[Progress, None, tuple[Placement, dict[Risk, Placement]]]:
        """Return the nominal optimum, and the best placement found for each risk measure over the scenarios."""
        problem = self.problem
        allowed = np.flatnonzero(problem.allowed)  # no rays are cast from poses that may not be chosen
        views, _ = yield from self._views(allowed)
        packed = np.zeros((len(views), len(problem.amounts), views.packed.shape[2]), dtype=np.uint8)
        packed[:, allowed] = views.packed
        views = replace(views, packed=packed)
        nominal = yield from solve(problem, limits, describe=problem.describe_road)
        robust = {}
        for risk in risks:
            robust[risk] = yield from solve_over(problem, views, risk, nominal.chosen, limits)
        return nominal, robust

    def compare(
        self, nominal: Placement, robust: Mapping[Risk, Placement]
    ) -> Generator[Progress, None, tuple[Comparison, ...]]:
        """Compare the placement for each risk measure with the nominal optimum, by the outcome that it was chosen for.

        Placements with the same outcome share one evaluation of the nominal optimum.
        """
        in_traffic = self.scenarios.kind == "traffic"
        outcomes = dict.fromkeys(risk.alone for risk in robust)
        entries = [("the empty road" if in_traffic else "the poses as planned", nominal, risk) for risk in outcomes]
        for risk, placement in robust.items():
            purpose = risk.describe() if self.scenarios.errs else risk.describe_outcome()
            entries.append(("traffic" if in_traffic else purpose, placement, risk.alone))
        evaluated = yield from self.evaluate(entries)
        beside = dict(zip(outcomes, evaluated, strict=False))
        return tuple(Comparison(self.scenarios, beside[one.risk], one) for one in evaluated[len(outcomes) :])

    def evaluate(
        self, entries: Sequence[tuple[str, Placement, Risk]]
    ) -> Generator[Progress, None, list[EvaluatedPlacement]]:
        """Evaluate placements on the held-out scenarios, all chosen poses at once.

        Parameters
        ----------
        entries : sequence of (str, Placement, Risk)
            Each placement with the purpose that it was optimised for, and a risk measure of a single scenario.
        """
        problem, total = self.problem, float(self.problem.weights.sum())
        used = np.unique(np.concatenate([placement.chosen for _, placement, _ in entries]))
        views, instants = yield from self._views(used, held_out=True)
        nominal = np.packbits(problem.amounts[used], axis=1)
        views = replace(views, packed=np.concatenate([nominal[None], views.packed]))
        evaluated = []
        for name, placement, risk in entries:
            rows = np.searchsorted(used, placement.chosen)
            each = [  # one scenario at a time: all at once take much memory
                outcomes_of(problem, replace(views, packed=views.packed[[number]]), risk, rows)
                for number in range(len(views))
            ]
            outcomes, seen = np.concatenate(each) / total, views.seen_by_any(rows)
            shares = problem.value(placement.chosen) / total, float(outcomes[0]), outcomes[1:]
            evaluated.append(EvaluatedPlacement(name, placement, risk, *shares, seen, instants))
        return evaluated

    def _views(
        self, poses: Integer, *, held_out: bool = False
    ) -> Generator[Progress, None, tuple[ScenarioVisibility, Instants | None]]:
        """Compute the visibility of poses in the scenarios to optimise over or held-out ones, and sample instants."""
        scenarios, amounts = self.scenarios, self.problem.amounts
        if scenarios.kind == "nominal":
            return ScenarioVisibility(np.packbits(amounts[poses], axis=1)[None], amounts.shape[1]), None
        number, seed = (scenarios.evaluated, scenarios.seed + 1) if held_out else (scenarios.optimised, scenarios.seed)
        if scenarios.kind == "traffic":
            instants = spread_instants(self.runs[held_out], number, seed)
            return (yield from visibility_in_traffic(self.around, poses, instants.obstacles())), instants
        return (yield from visibility_under_errors(self.around, poses, scenarios.pose_errors, number, seed)), None


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
