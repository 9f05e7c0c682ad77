"""Estimates from samples with 95 % confidence intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .arrays import Float, Integer

Interval = tuple[float, float]  # lower and upper end of a 95 % interval
SHARE: Interval = (0.0, 1.0)  # range of a share or an average precision
TAIL_PROBABILITY = 0.025  # probability on either side of an interval
NORMAL_QUANTILE = 1.959963984540054  # value that a standard normal variable exceeds with a probability of 2.5 %
RESAMPLES = 2000  # number of resamples of a bootstrap
MIN_BATCHES = 4  # least number of batches for an interval of a mean


@dataclass(frozen=True)
class IntervalEstimate:
    """A figure and its 95 % interval.

    Parameters
    ----------
    value, low, high : float
        Figure, and ends of the interval; an end that the number of draws leaves open is infinite.
    """

    value: float
    low: float
    high: float

    def agrees_with(self, other: IntervalEstimate) -> bool:
        """Return whether the intervals of two estimates overlap."""
        return self.low <= other.high and other.low <= self.high

    def describe(self, decimals: int = 2) -> str:
        """Return value and interval as shares in per cent."""
        if not math.isfinite(self.high - self.low):
            return f"{self.value:.{decimals}%} [too few data for an interval]"
        return f"{self.value:.{decimals}%} [{self.low:.{decimals}%}, {self.high:.{decimals}%}]"

    def as_points(self, decimals: int = 2) -> str:
        """Return value and interval as differences of shares, in percentage points."""
        value, low, high = (f"{100 * part:.{decimals}f}" for part in (self.value, self.low, self.high))
        return f"{value} points [{low}, {high}]"

    def as_change(self) -> str:
        """Return a difference of shares as a number of percentage points more, or less for a loss."""
        gain = self.value >= 0.0
        size = self if gain else IntervalEstimate(-self.value, -self.high, -self.low)
        word = "more" if gain else "less"
        if not math.isfinite(self.high - self.low):
            return f"{100 * size.value:.2f} points {word} [too few data for an interval]"
        return f"{size.as_points()} {word}"


def mean_of(values: Float) -> IntervalEstimate:
    """Estimate a mean with the interval of the normal approximation, for about thirty draws or more.

    Parameters
    ----------
    values : (n,) float64
        Independent draws.

    Examples
    --------
    >>> coverage = mean_of(np.array([0.80, 0.82, 0.84, 0.82]))
    >>> coverage.describe()
    '82.00% [80.40%, 83.60%]'
    >>> coverage.agrees_with(mean_of(np.array([0.70, 0.72, 0.74, 0.72])))
    False
    """
    mean = math.fsum(values) / len(values)
    several = len(values) > 1
    reach = NORMAL_QUANTILE * float(values.std(ddof=1)) / math.sqrt(len(values)) if several else math.inf
    return IntervalEstimate(mean, mean - reach, mean + reach)


def mean_over_time(values: Float, batch: Integer) -> IntervalEstimate:
    """Estimate the mean of a time series from the means of batches, because neighbouring values are dependent.

    Batches are assumed to be independent and equally long (batch means; Law 2015, section 9.5.3), and the interval is
    Student's interval of their means.

    Parameters
    ----------
    values : (n,) float64
        Values of the time series.
    batch : (n,) int64
        Batch that each value belongs to.
    """
    _, which = np.unique(batch, return_inverse=True)
    many = np.bincount(which)
    means = np.bincount(which, values) / many
    mean, number = math.fsum(values) / len(values), len(many)
    reach = student_reach(means) if number >= MIN_BATCHES else math.inf
    return IntervalEstimate(mean, mean - reach, mean + reach)


def student_reach(values: Float | Sequence[float]) -> float:
    """Return half the width of the 95 % interval of a mean (Student 1908).

    Exact for any number of values from a normal distribution. Three values, as from three seeds, can be drawn with
    replacement in only ten ways, and the interval of a bootstrap over them would contain the mean in three of four
    cases instead of 19 of 20.

    Parameters
    ----------
    values : (n,) float64
        Independent draws, at least two.
    """
    return student_quantile(len(values) - 1) * float(np.std(values, ddof=1)) / math.sqrt(len(values))


def student_quantile(freedom: int) -> float:
    """Return the value that Student's t with `freedom` degrees of freedom exceeds with a probability of 2.5 %."""
    low, high = 1.0, 13.0  # between the normal quantile, 1.96, and that of one degree, 12.706
    # Bisection: the tail probability decreases with the value, and 60 halvings reach full precision.
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if _student_tail(middle, freedom) > TAIL_PROBABILITY else (low, middle)
    return (low + high) / 2


def _student_tail(value: float, freedom: int) -> float:
    """Return the probability that Student's t exceeds a positive value (Abramowitz and Stegun 1964, 26.7.3, 26.7.4)."""
    angle, odd = math.atan(value / math.sqrt(freedom)), freedom % 2
    term, total = math.cos(angle) if odd else 1.0, 0.0
    for step in range(freedom // 2):
        if step:
            term *= (2 * step - 1 + odd) / (2 * step + odd) * math.cos(angle) ** 2
        total += term
    total *= math.sin(angle)
    within = 2 / math.pi * (angle + total) if odd else total
    return (1 - within) / 2


def percentiles(values: Float) -> Interval:
    """Return the interval that leaves 2.5 % of the values on either side; NaN is ignored."""
    low, high = np.nanquantile(values, (TAIL_PROBABILITY, 1 - TAIL_PROBABILITY))
    return float(low), float(high)


def quantile_of(values: Float, share: float) -> IntervalEstimate:
    """Estimate a quantile with a distribution-free interval (David and Nagaraja 2003, section 7.1).

    The number of draws below the true quantile is binomial, so that the order statistics that enclose it depend only on
    n and ``share``. The value is the order statistic of rank ``ceil(share · n)``.

    Parameters
    ----------
    values : (n,) float64
        Independent draws.
    share : float
        Probability of the quantile, 0 to 1, both excluded.
    """
    ordered, number = np.sort(values), len(values)
    below = _binomial_distribution(number, share)
    first = int(np.searchsorted(below, TAIL_PROBABILITY, side="right"))  # P(B < first) <= TAIL_PROBABILITY
    last = int(np.searchsorted(below, 1 - TAIL_PROBABILITY))  # P(B > last) <= TAIL_PROBABILITY
    return IntervalEstimate(
        value=float(ordered[math.ceil(share * number) - 1]),
        low=float(ordered[first - 1]) if first > 0 else -math.inf,
        high=float(ordered[last]) if last < number else math.inf,
    )


def quantile_gain(values: Float, others: Float, share: float) -> IntervalEstimate:
    """Estimate the difference between the quantiles of two samples of paired draws.

    The interval is that of `RESAMPLES` resamples of the pairs (the percentile bootstrap, Efron 1979).

    Parameters
    ----------
    values, others : (n,) float64
        Independent draws; values with the same index are a pair.
    share : float
        Probability of the quantile, 0 to 1, both excluded.
    """
    number = len(values)
    rank = math.ceil(share * number) - 1
    picked = np.random.default_rng(0).integers(0, number, (RESAMPLES, number))
    gains = _at_rank(values[picked], rank) - _at_rank(others[picked], rank)
    return IntervalEstimate(float(_at_rank(values, rank) - _at_rank(others, rank)), *percentiles(gains))


def _at_rank(values: Float, rank: int) -> Float:
    """Return the order statistic of a rank, along the last axis."""
    ranked: Float = np.partition(values, rank, axis=-1)[..., rank]
    return ranked


def _binomial_distribution(number: int, share: float) -> Float:
    """Return P(B <= b) for b = 0 … number."""
    count = np.arange(number + 1)
    factorial = np.array([math.lgamma(n + 1) for n in range(number + 1)])
    # Logarithms keep binomial coefficients of many draws from overflowing.
    log = factorial[-1] - factorial - factorial[::-1] + count * math.log(share) + count[::-1] * math.log1p(-share)
    distribution: Float = np.cumsum(np.exp(log))
    return distribution
