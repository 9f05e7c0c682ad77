"""Coverage of placements in traffic, and the gain from optimising for traffic.

Placements are optimised on some instants of traffic and evaluated at instants of different runs, by the share of time
for which each target is seen and by the mean share of the targets' weight. Instants close in time have the same queues,
so that confidence intervals are computed from the means of batches of time (`mean_over_time`).
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Boolean, Float, Integer
from ...estimates import IntervalEstimate, mean_over_time
from ...progress import Progress
from ...sensing.scenarios.scenario_visibility import ScenarioVisibility
from ...sensing.scenarios.traffic_instants import NO_TRAFFIC, Instants
from ...sensing.scenarios.visibility_in_traffic import visibility_in_traffic
from ...sensing.visibility.surroundings import Surroundings
from ..placement.problem import Placement, PlacementProblem
from ..placement.risk import Risk
from ..placement.search_limits import DEFAULT_LIMITS, SolverLimits
from ..placement.solver import solve
from .robust_study import solve_over

NOTABLE_LOSS = 0.01  # share of the targets' weight whose loss in traffic is worth a warning
IN_TRAFFIC = "in traffic"  # first words of the message on a placement that is only evaluated

MEAN = Risk()


@dataclass(frozen=True, eq=False)
class TrafficEvaluation:
    """Coverage of a placement on the empty road and at n held-out instants of traffic.

    Parameters
    ----------
    name : str
        Purpose for which the placement was optimised.
    empty : float
        Share of the targets' weight that is seen on the empty road.
    at : (n,) float64
        The same share at each instant.
    hidden_at : (n,) float64
        Share of the weight that is seen on the empty road but not at each instant.
    empty_targets : (t,) bool
        Targets that are seen on the empty road.
    time : (t,) float64
        Share of the instants at which each target is seen.
    batch : (n,) int64
        Batch of each instant.
    road_users : float
        Mean number of road users at the instants.
    """

    name: str
    placement: Placement
    empty: float
    at: Float
    hidden_at: Float
    empty_targets: Boolean
    time: Float
    batch: Integer
    road_users: float

    @property
    def mean(self) -> IntervalEstimate:
        """Mean over time of the share of the targets' weight that is seen."""
        return mean_over_time(self.at, self.batch)

    @property
    def loss(self) -> IntervalEstimate:
        """Coverage of the empty road minus that in traffic: hidden weight less what returns from vehicles add."""
        return mean_over_time(self.empty - self.at, self.batch)

    @property
    def hidden(self) -> IntervalEstimate:
        """Share of the weight seen on the empty road that vehicles hide, on average over time."""
        return mean_over_time(self.hidden_at / self.empty if self.empty else self.hidden_at, self.batch)

    def more_than(self, other: TrafficEvaluation) -> IntervalEstimate:
        """Estimate the gain in coverage over another placement at the same instants."""
        return mean_over_time(self.at - other.at, self.batch)

    @property
    def message(self) -> str:
        """Message on the coverage in traffic and on the empty road, for a placement that is only evaluated."""
        return (
            f"{IN_TRAFFIC} ({self.road_users:.0f} road users at a time) this placement sees {self.mean.describe()} of "
            f"the road on average over time, {self.empty:.2%} when it is empty"
        )


@dataclass(frozen=True, eq=False)
class TrafficStudy:
    """Comparison of the optimum for the empty road with the placement optimised on traffic.

    Parameters
    ----------
    chosen_at : int
        Number of instants that the traffic-aware placement was optimised on.
    """

    chosen_at: int
    empty: TrafficEvaluation
    traffic: TrafficEvaluation

    @property
    def road_users(self) -> float:
        """Mean number of road users at the evaluated instants."""
        return self.empty.road_users

    @property
    def gain(self) -> IntervalEstimate:
        """Gain in coverage in traffic from optimising on traffic rather than for the empty road."""
        return self.traffic.more_than(self.empty)

    def is_converged(self) -> bool:
        """Return whether every second instant gives the same means as all, within their intervals."""
        empty, traffic, batch = self.empty.at, self.traffic.at, self.empty.batch
        rows = [empty, traffic, traffic - empty]
        return all(mean_over_time(row[::2], batch[::2]).agrees_with(mean_over_time(row, batch)) for row in rows)

    def messages(self) -> tuple[str, ...]:
        """Return messages on the gain or loss by optimising on traffic, and warnings if traffic costs much."""
        gain, seen = self.gain, self.empty
        than = "of the road than the best placement for the empty road"
        messages = [f"this placement sees {gain.as_change()} {than}, in traffic that neither was chosen on"]
        if not self.is_converged():
            messages.append("half of the instants give a different result: evaluate on more held-out instants")
        if seen.loss.value >= NOTABLE_LOSS:
            messages.append(
                f"the best placement for the empty road sees {seen.mean.value:.1%} of the road on average "
                f"over time in traffic ({self.road_users:.0f} road users at a time), not {seen.empty:.1%}: "
                f"{seen.loss.value:.1%} less"
            )
        if gain.low <= 0 and not np.array_equal(self.empty.placement.chosen, self.traffic.placement.chosen):
            messages.append(
                "on held-out traffic this placement is not significantly better than the empty-road optimum: use more "
                "instants, or keep that one"
            )
        return tuple(messages)

    def summary(self) -> tuple[str, ...]:
        """Return a line for each placement: its coverage in traffic and on the empty road."""
        return tuple(
            f"chosen for {placed.name}: {placed.mean.describe()} of the road on average over time, "
            f"{placed.empty:.2%} on the empty road"
            for placed in (self.empty, self.traffic)
        )


def traffic_scenarios(
    around: Surroundings, problem: PlacementProblem, instants: Instants
) -> Generator[Progress, None, ScenarioVisibility]:
    """Compute visibility on the empty road, which is the first scenario, and at instants of traffic.

    It is computed for the candidates that may be chosen, and left false for the others.
    """
    every = np.flatnonzero(problem.allowed)
    views = yield from visibility_in_traffic(around, every, [NO_TRAFFIC, *instants.obstacles()])
    return views.spread_to(every, len(problem.amounts))


def traffic_placements(
    problem: PlacementProblem, scenarios: ScenarioVisibility, limits: SolverLimits = DEFAULT_LIMITS, risk: Risk = MEAN
) -> Generator[Progress, None, dict[str, Placement]]:
    """Optimise for the empty road and for traffic; return the placements by these purposes.

    Parameters
    ----------
    problem : PlacementProblem
        Problem of all candidates of the site; their visibility is taken from the scenarios.
    scenarios : ScenarioVisibility
        Visibility on the empty road and at the instants to optimise on; see `traffic_scenarios`.
    risk : Risk
        Risk measure over the instants to maximise.
    """
    problem = replace(problem, amounts=scenarios.seen(0))
    views = replace(scenarios, packed=scenarios.packed[1:])
    empty = yield from solve(problem, limits, describe=problem.describe_road)
    return {"the empty road": empty, "traffic": (yield from solve_over(problem, views, risk, empty.chosen, limits))}


def traffic_study(
    around: Surroundings,
    problem: PlacementProblem,
    placements: Mapping[str, Placement],
    chosen_at: int,
    evaluation: Instants,
) -> Generator[Progress, None, TrafficStudy]:
    """Evaluate the placements for the empty road and for traffic at other instants.

    Parameters
    ----------
    placements : mapping of str to Placement
        See `traffic_placements`.
    chosen_at : int
        Number of instants that the second one was optimised on.
    evaluation : Instants
        Instants of runs other than those of the scenarios.
    """
    evaluated = yield from evaluate_in_traffic(around, placements, problem.weights, evaluation)
    return TrafficStudy(chosen_at, *evaluated)


def evaluate_in_traffic(
    around: Surroundings, placements: Mapping[str, Placement], weight: Float, instants: Instants
) -> Generator[Progress, None, list[TrafficEvaluation]]:
    """Evaluate placements at instants of traffic and on the empty road.

    Parameters
    ----------
    placements : mapping of str to Placement
        Placements by their purposes.
    weight : (t,) float64
        Weights of the targets.
    """
    obstacles = instants.obstacles()
    users = float(np.mean([len(instant.hulls) for instant in obstacles]))
    used = np.unique(np.concatenate([placement.chosen for placement in placements.values()]))
    views = yield from visibility_in_traffic(around, used, [NO_TRAFFIC, *obstacles])
    evaluations = []
    for name, placement in placements.items():
        seen = views.seen_by_any(np.searchsorted(used, placement.chosen))
        share, hidden = (which @ weight / weight.sum() for which in (seen, seen[0] & ~seen[1:]))
        shares = float(share[0]), share[1:], hidden, seen[0], seen[1:].mean(axis=0)
        evaluations.append(TrafficEvaluation(name, placement, *shares, instants.batch, users))
    return evaluations
