r"""Risk measures of robust placement: expectation, worst case, CVaR, failures.

The outcome :math:`f_k(S)` of scenario k is the weight of the targets that the chosen sensors S see, or what is left of
it after the failure of one of them: at worst, or on average, where each of the N sensors that are allowed is equally
likely to fail (if only chosen sensors could fail, adding a sensor that sees nothing would raise the average). The risk
measure is the mean of the m smallest of K outcomes, :math:`m = \lceil αK \rceil`:

.. math::
    T(S) = \min_{p \in P} \sum_k p_k f_k(S), \qquad
    P = \{p : 0 \le p_k \le 1/m,\; \textstyle\sum_k p_k = 1\},

the conditional value at risk of the coverage (Rockafellar and Uryasev 2000):
the expectation for α = 1, the worst scenario for α up to 1/K.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float, Integer
from ...base.errors import SeipError

Failure = Literal["none", "worst", "mean"]


@dataclass(frozen=True)
class Risk:
    """Risk measure that a robust placement maximises.

    Parameters
    ----------
    tail : float
        α, the share of the worst scenarios that are averaged; 1 for the expectation, 0 for the single worst one.
    failure : {"none", "worst", "mean"}
        Failure of one sensor: none, the most important one, or any of them on average.
    """

    tail: float = 1.0
    failure: Failure = "none"

    @property
    def least_sensors(self) -> int:
        """Number of sensors below which every outcome is zero."""
        return 1 + (self.failure != "none")

    def require_sensors(self, most: int) -> None:
        """Raise SeipError if every outcome of ``most`` sensors is zero."""
        if most < self.least_sensors:
            raise SeipError(f"{self.describe()} needs at least {self.least_sensors} sensors, not {most}; allow more")

    def describe(self) -> str:
        """Name the risk measure."""
        of = {1.0: "expected coverage", 0.0: "coverage in the worst scenario"}.get(
            self.tail, f"mean coverage of the worst {self.tail:.0%} of the scenarios"
        )
        lost = {"none": "", "worst": ", the most important sensor lost", "mean": ", any one sensor lost"}[self.failure]
        return of + lost

    def describe_outcome(self) -> str:
        """Name the outcome of one scenario."""
        lost = {
            "none": "",
            "worst": " after the loss of the most important sensor",
            "mean": " after the loss of any one sensor, on average",
        }[self.failure]
        return f"coverage{lost}"

    @property
    def alone(self) -> Risk:
        """Return the same measure for a single scenario, by which each draw is evaluated."""
        return replace(self, tail=1.0)

    def counted(self, scenarios: int) -> int:
        """Return m, the number of worst scenarios that count."""
        return max(1, math.ceil(self.tail * scenarios - 1e-9))

    def outcomes(self, seen: NDArray[np.uint8], weight: Float, sensors: int) -> Float:
        """Return the outcome of a placement in each scenario, (K,) float64.

        Parameters
        ----------
        seen : (K, s, t) uint8
            1 where a chosen sensor sees a target.
        weight : (t,) float64
        sensors : int
            N, the largest number of sensors.
        """
        times = seen.sum(axis=1, dtype=np.uint8)
        whole: Float = (times >= 1) @ weight
        if self.failure == "none":
            return whole
        if seen.shape[1] == 0:
            return np.zeros(len(seen))
        # weight of the targets that only one sensor sees, for each sensor: it is lost with that sensor, (K, s)
        lost: Float = ((times == 1)[:, None] & seen.view(bool)) @ weight
        return self.after_failure(whole, (whole[:, None] - lost).T, sensors)

    def after_failure(self, whole: Float | float, left: Float, sensors: int) -> Float:
        """Return what is left after a failure, from the value of all sensors and that without each one, (k, …)."""
        if len(left) == 0:
            return np.zeros_like(whole)
        if self.failure == "worst":
            worst: Float = left.min(axis=0)
            return worst
        mean: Float = (left.sum(axis=0) + (sensors - len(left)) * whole) / sensors
        return mean

    def of(self, outcomes: Float) -> float:
        """Return the risk measure T of outcomes (K,)."""
        counted = self.counted(len(outcomes))
        return math.fsum(np.sort(outcomes)[:counted]) / counted

    def of_each(self, outcomes: Float) -> Float:
        """Return the risk measure of each column of outcomes (K, c), (c,) float64."""
        counted = self.counted(len(outcomes))
        measure: Float = np.partition(outcomes, counted - 1, axis=0)[:counted].mean(axis=0)
        return measure

    def worst(self, outcomes: Float) -> Integer:
        """Return the m worst scenarios, (m,) int64; among equal ones the first."""
        return np.argsort(outcomes, kind="stable")[: self.counted(len(outcomes))]


NOMINAL = Risk()
