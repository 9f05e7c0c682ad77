"""Estimates from samples with 95 % confidence intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from statistics import NormalDist

import numpy as np

from ..arrays import Float, Integer

CONFIDENCE = 0.95
TAIL = 0.025
"""Share of probability on either side of an interval."""

RESAMPLES = 2000
"""Of a bootstrap."""

FEWEST_STRETCHES = 4
"""Of fewer the spread of a mean is not known well enough for an interval."""


@dataclass(frozen=True)
class IntervalEstimate:
    """A figure and its interval.

    Parameters
    ----------
    value, low, high : float
        An end that so few draws leave open is infinite.
    """

    value: float
    low: float
    high: float

    def agrees_with(self, other: IntervalEstimate) -> bool:
        """Whether the intervals of two estimates meet."""
        return self.low <= other.high and other.low <= self.high

    def describe(self, decimals: int = 2) -> str:
        """Return value and interval as shares in per cent."""
        return f"{self.value:.{decimals}%} [{self.low:.{decimals}%}, {self.high:.{decimals}%}]"

    def as_points(self, decimals: int = 2) -> str:
        """Return value and interval as differences of shares, in percentage points."""
        value, low, high = (f"{100 * part:.{decimals}f}" for part in (self.value, self.low, self.high))
        return f"{value} points [{low}, {high}]"


def mean_of(values: Float) -> IntervalEstimate:
    """Estimate a mean; its interval is that of the normal approximation, for some thirty draws and more.

    Parameters
    ----------
    values : (n,) float64
        Independent draws.
    """
    mean = math.fsum(values) / len(values)
    if len(values) < 2:
        return IntervalEstimate(mean, -math.inf, math.inf)
    reach = NormalDist().inv_cdf((1 + CONFIDENCE) / 2) * float(values.std(ddof=1)) / math.sqrt(len(values))
    return IntervalEstimate(mean, mean - reach, mean + reach)


def mean_over_time(values: Float, stretch: Integer) -> IntervalEstimate:
    """Estimate a mean of values that depend on each other when they are near in time, by means of stretches.

    Stretches are taken as independent and as equally long (batch means; Law 2015,
    section 9.5.3), and Student's interval is that of their means.

    Parameters
    ----------
    values : (n,) float64
    stretch : (n,) int64
        In which stretch of time each was taken.
    """
    _, which = np.unique(stretch, return_inverse=True)
    many = np.bincount(which)
    means = np.bincount(which, values) / many
    mean, number = math.fsum(values) / len(values), len(many)
    if number < FEWEST_STRETCHES:
        return IntervalEstimate(mean, -math.inf, math.inf)
    reach = student_quantile(number - 1) * float(means.std(ddof=1)) / math.sqrt(number)
    return IntervalEstimate(mean, mean - reach, mean + reach)


@cache
def student_quantile(freedom: int) -> float:
    """Return the value that Student's t exceeds with a probability of 2.5 %.

    Parameters
    ----------
    freedom : int
        Degrees of freedom, at least 1.
    """
    low, high = 1.0, 13.0  # between the normal quantile, 1.96, and that of one degree, 12.706
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if _student_tail(middle, freedom) > TAIL else (low, middle)
    return (low + high) / 2


def _student_tail(value: float, freedom: int) -> float:
    """Return the probability that Student's t exceeds a positive value (Abramowitz and Stegun 1964, 26.7.3, 26.7.4)."""
    angle = math.atan(value / math.sqrt(freedom))
    odd = freedom % 2
    term = math.cos(angle) if odd else 1.0
    total = 0.0
    for step in range(freedom // 2):
        if step:
            term *= (2 * step - 1 + odd) / (2 * step + odd) * math.cos(angle) ** 2
        total += term
    total *= math.sin(angle)
    within = 2 / math.pi * (angle + total) if odd else total
    return (1 - within) / 2


def quantile_of(values: Float, share: float) -> IntervalEstimate:
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
    return IntervalEstimate(
        value=float(ordered[math.ceil(share * number) - 1]),
        low=float(ordered[first - 1]) if first > 0 else -math.inf,
        high=float(ordered[last]) if last < number else math.inf,
    )


def quantile_gain(values: Float, others: Float, share: float, seed: int = 0) -> IntervalEstimate:
    """Estimate by how much a quantile exceeds another's, draw for draw under the same circumstances.

    The interval is that of `RESAMPLES` resamples of the pairs (the percentile bootstrap, Efron 1979).

    Parameters
    ----------
    values, others : (n,) float64
        Independent draws; a value and the other of the same number belong together.
    share : float
        0 to 1, both excluded.
    seed : int
        Of the resamples.
    """
    number = len(values)
    rank = math.ceil(share * number) - 1
    picked = np.random.default_rng(seed).integers(0, number, (RESAMPLES, number))
    gains = _at_rank(values[picked], rank) - _at_rank(others[picked], rank)
    low, high = np.quantile(gains, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return IntervalEstimate(float(_at_rank(values, rank) - _at_rank(others, rank)), float(low), float(high))


def _at_rank(values: Float, rank: int) -> Float:
    """Return the order statistic of a rank, along the last axis."""
    ranked: Float = np.partition(values, rank, axis=-1)[..., rank]
    return ranked


def _binomial_distribution(number: int, share: float) -> Float:
    """Return P(B <= b) for b = 0 … number."""
    count = np.arange(number + 1)
    factorial = np.array([math.lgamma(n + 1) for n in range(number + 1)])
    log = factorial[-1] - factorial - factorial[::-1] + count * math.log(share) + count[::-1] * math.log1p(-share)
    distribution: Float = np.cumsum(np.exp(log))
    return distribution
