"""Evaluation of placements on held-out scenarios: pose errors, sensor failures or traffic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.arrays import Boolean, Float
from ...base.estimates import IntervalEstimate, mean_of, mean_over_time, quantile_gain, quantile_of
from ...sensing.scenarios.traffic_instants import Instants
from ..placement.problem import Placement
from ..placement.risk import Risk
from ..placement.scenarios import Scenarios
from .pose_study import LOW_QUANTILE, NOTABLE_LOSS, PoseStudy


@dataclass(frozen=True, eq=False)
class EvaluatedPlacement:
    """A placement with its outcomes in the nominal scenario and in n held-out ones, as shares of the targets' weight.

    Parameters
    ----------
    name : str
        Purpose for which it was optimised.
    risk : Risk
        Risk measure of a single scenario, whose outcome is evaluated: coverage, or coverage after a failure.
    planned : float
        Coverage in the nominal scenario, without failures.
    nominal : float
        Outcome in the nominal scenario.
    held_out : (n,) float64
        Outcome in each held-out scenario.
    seen : (1 + n, t) bool
        Targets that some sensor sees in the nominal scenario and in each held-out one.
    instants : Instants, optional
        Held-out instants, if the scenarios are traffic.
    """

    name: str
    placement: Placement
    risk: Risk
    planned: float
    nominal: float
    held_out: Float
    seen: Boolean
    instants: Instants | None = None

    def estimate(self, values: Float, step: int = 1) -> IntervalEstimate:
        """Estimate a mean over scenarios from values (n,) in the held-out ones, of which every ``step``-th is used.

        Instants close in time have the same queues: their interval is computed from the means of batches of time.
        """
        values = values[::step]
        return mean_of(values) if self.instants is None else mean_over_time(values, self.instants.batch[::step])

    @property
    def low(self) -> IntervalEstimate:
        """5 % quantile over held-out scenarios."""
        return quantile_of(self.held_out, LOW_QUANTILE)

    @property
    def mean(self) -> IntervalEstimate:
        """Mean over held-out scenarios."""
        return self.estimate(self.held_out)

    @property
    def loss(self) -> IntervalEstimate:
        """Nominal outcome minus the mean over held-out scenarios."""
        return self.estimate(self.nominal - self.held_out)

    @property
    def road_users(self) -> float:
        """Mean number of road users at the held-out instants; 0 without traffic."""
        return self.instants.road_users if self.instants else 0.0

    @property
    def traffic_message(self) -> str:
        """Message on the coverage in traffic and on the empty road, for a placement that is only evaluated."""
        return (
            f"in traffic ({self.road_users:.0f} road users at a time) this placement sees {self.mean.describe()} of "
            f"the road on average over time, {self.nominal:.2%} when it is empty"
        )


@dataclass(frozen=True, eq=False)
class Comparison:
    """A placement optimised over scenarios, compared with the nominal optimum on held-out ones.

    Parameters
    ----------
    scenarios : Scenarios
        Scenarios that the robust placement was optimised over.
    nominal : EvaluatedPlacement
        Nominal optimum, evaluated by the same outcome as the robust placement.
    pose_study : PoseStudy, optional
        Coverage of the robust placement by kind of pose error.
    """

    scenarios: Scenarios
    nominal: EvaluatedPlacement
    robust: EvaluatedPlacement
    pose_study: PoseStudy | None = None

    @property
    def price(self) -> float:
        """Planned coverage that the robust placement loses against the nominal optimum."""
        return self.nominal.planned - self.robust.planned

    @property
    def gain(self) -> IntervalEstimate:
        """Gain over the nominal optimum: of the mean in traffic, of the 5 % quantile under pose errors."""
        if self.scenarios.kind == "traffic":
            return self.robust.estimate(self.robust.held_out - self.nominal.held_out)
        return quantile_gain(self.robust.held_out, self.nominal.held_out, LOW_QUANTILE)

    def is_converged(self) -> bool:
        """Return whether every second instant of traffic gives the same means as all, within their intervals."""
        nominal, robust = self.nominal.held_out, self.robust.held_out
        estimate = self.robust.estimate
        return all(estimate(row, 2).agrees_with(estimate(row)) for row in (nominal, robust, robust - nominal))

    def messages(self) -> tuple[str, ...]:
        """Return notes on the loss in the nominal scenario and the gain in held-out ones, and warnings."""
        if self.scenarios.kind == "traffic":
            return tuple(self._messages_in_traffic())
        robust, nominal, outcome = self.robust, self.nominal, self.robust.risk.describe_outcome()
        change = f"{100 * abs(self.price):.2f} points {'less' if self.price >= 0.0 else 'more'}"
        planned = f"as planned, it covers {change} than the placement for poses as planned"
        if not self.scenarios.errs:
            return (f"{planned}; {outcome} is {robust.nominal:.2%}, and {nominal.nominal:.2%} with that one",)
        verdict = ": this is worse" if robust.low.value < nominal.low.value else ""
        gain = (
            f"{planned}; {outcome} is at least {robust.low.describe()} in nineteen of twenty of "
            f"{self.scenarios.evaluated} unseen draws, and {nominal.low.describe()} with that placement{verdict}"
        )
        return (gain, *(self.pose_study.warnings() if self.pose_study else ()))

    def _messages_in_traffic(self) -> list[str]:
        gain, seen = self.gain, self.nominal
        than = "of the road than the best placement for the empty road"
        messages = [f"this placement sees {gain.as_change()} {than}, in traffic that neither was chosen on"]
        if not self.is_converged():
            messages.append("half of the instants give a different result: evaluate on more held-out instants")
        if seen.loss.value >= NOTABLE_LOSS:
            messages.append(
                f"the best placement for the empty road sees {seen.mean.value:.1%} of the road on average "
                f"over time in traffic ({seen.road_users:.0f} road users at a time), not {seen.nominal:.1%}: "
                f"{seen.loss.value:.1%} less"
            )
        if gain.low <= 0 and not np.array_equal(seen.placement.chosen, self.robust.placement.chosen):
            messages.append(
                "on held-out traffic this placement is not significantly better than the empty-road optimum: use more "
                "instants, or keep that one"
            )
        return messages

    def summary(self) -> tuple[str, ...]:
        """Return lines that compare the placement with the nominal optimum."""
        robust, nominal, outcome = self.robust, self.nominal, self.robust.risk.describe_outcome()
        if self.scenarios.kind == "traffic":
            return tuple(
                f"chosen for {one.name}: {one.mean.describe()} of the road on average over time, "
                f"{one.nominal:.2%} on the empty road"
                for one in (nominal, robust)
            )
        planned = f"planned coverage {robust.planned:.2%}, the nominal optimum's {nominal.planned:.2%}"
        if not self.scenarios.errs:
            return (planned, f"{outcome}: {robust.nominal:.2%}, the nominal optimum's {nominal.nominal:.2%}")
        return (
            planned,
            f"over {self.scenarios.evaluated} unseen draws, {outcome}:",
            f"mean {robust.mean.describe()}, the nominal optimum's {nominal.mean.describe()}",
            f"5 % quantile {robust.low.describe()}, the nominal optimum's {nominal.low.describe()}",
            f"the 5 % quantile is higher by {self.gain.describe()}",
        )
