"""Estimates from draws, each with the interval in which the true value lies with a confidence of 95 %."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from ..arrays import Float

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Estimate:
    """A figure and its interval.

    Parameters
    ----------
    value, low, high : float
        An end that so few draws leave open is infinite.
    """

    value: float
    low: float
    high: float

    def agrees_with(self, other: Estimate) -> bool:
        """Whether the intervals of two estimates meet."""
        return self.low <= other.high and other.low <= self.high

    def in_words(self, decimals: int = 2) -> str:
        """Return value and interval as shares in per cent."""
        return f"{self.value:.{decimals}%} [{self.low:.{decimals}%}, {self.high:.{decimals}%}]"


def mean_of(values: Float) -> Estimate:
    """Estimate a mean; its interval is that of the normal approximation, for some thirty draws and more.

    Parameters
    ----------
    values : (n,) float64
        Independent draws.
    """
    mean = math.fsum(values) / len(values)
    if len(values) < 2:
        return Estimate(mean, -math.inf, math.inf)
    reach = NormalDist().inv_cdf((1 + CONFIDENCE) / 2) * float(values.std(ddof=1)) / math.sqrt(len(values))
    return Estimate(mean, mean - reach, mean + reach)


def quantile_of(values: Float, share: float) -> Estimate:
    """Estimate a quantile; its interval holds whatever the distribution is (David and Nagaraja 2003, section 7.1).

    The number of draws below the true quantile is binomial, so that the order
    statistics between which it lies follow from n and ``share`` alone. The
    value itself is the order statistic of rank ``ceil(share · n)``.

    Parameters
    ----------
    values : (n,) float64
        Independent draws.
    share : float
        0 to 1, both excluded.
    """
    ordered, number = np.sort(values), len(values)
    below = _binomial_distribution(number, share)
    tail = (1 - CONFIDENCE) / 2
    first = int(np.searchsorted(below, tail, side="right"))  # P(B < first) <= tail
    last = int(np.searchsorted(below, 1 - tail))  # P(B > last) <= tail
    return Estimate(
        value=float(ordered[math.ceil(share * number) - 1]),
        low=float(ordered[first - 1]) if first > 0 else -math.inf,
        high=float(ordered[last]) if last < number else math.inf,
    )


def _binomial_distribution(number: int, share: float) -> Float:
    """Return P(B <= b) for b = 0 … number."""
    count = np.arange(number + 1)
    factorial = np.array([math.lgamma(n + 1) for n in range(number + 1)])
    log = factorial[-1] - factorial - factorial[::-1] + count * math.log(share) + count[::-1] * math.log1p(-share)
    distribution: Float = np.cumsum(np.exp(log))
    return distribution
