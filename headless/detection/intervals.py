"""Confidence intervals over trainings and traffic, and verdicts on claims from them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from headless.coverage_study.claims import FAILS, HOLDS, UNDECIDED

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.errors import SeipError
from seip_addon.core.robustness.estimates import TAIL, student_quantile

Interval = tuple[float, float]
"""Least and largest value that a 95 % interval holds."""

RESAMPLES = 2000


def percentiles(values: Float) -> Interval:
    """Return the interval that leaves 2.5 % of the values on either side; NaN does not count."""
    low, high = np.nanquantile(values, (TAIL, 1 - TAIL))
    return float(low), float(high)


def mean_interval(values: Sequence[float]) -> Interval:
    """Return the 95 % interval of the mean of what repetitions (seeds) gave.

    Student's (1908) t, exact for values from a normal distribution however few
    they are. Three values, as from three seeds, can be drawn with replacement
    in ten ways only, and a bootstrap over them would hold the mean in three of
    four cases instead of 19 of 20.

    Raises
    ------
    SeipError
        There are fewer than two values.
    """
    count = len(values)
    if count < 2:
        raise SeipError(f"{count} seed gives no interval: repeat the study with at least two, better three or more")
    mean, spread = float(np.mean(values)), float(np.std(values, ddof=1))
    reach = student_quantile(count - 1) * spread / math.sqrt(count)
    return mean - reach, mean + reach


def rank_correlation(x: Sequence[float], y: Sequence[float]) -> float:
    """Return Spearman's (1904) rank correlation; equal values share their mean rank; NaN where all are equal."""
    ranks = np.array([_ranks(np.asarray(values, dtype=np.float64)) for values in (x, y)])
    centred = ranks - ranks.mean(axis=1, keepdims=True)
    scale = math.sqrt(float((centred[0] ** 2).sum() * (centred[1] ** 2).sum()))
    return float(centred[0] @ centred[1]) / scale if scale else math.nan


def rank_correlation_interval(x: Sequence[float], y: Sequence[float], seed: int) -> Interval | None:
    """Return the 95 % interval of the rank correlation, or None where there are too few pairs.

    Bootstrap (Efron 1979) over pairs: give one pair for each configuration,
    with the mean over its seeds, since seeds of one configuration are no new
    evidence that coverage predicts anything.

    Parameters
    ----------
    seed : int
        The same seed draws the same pairs.
    """
    if len(x) < 4 or math.isnan(rank_correlation(x, y)):
        return None
    left, right = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    drawn = np.random.default_rng(seed).integers(len(left), size=(RESAMPLES, len(left)))
    return percentiles(np.array([rank_correlation(left[rows], right[rows]) for rows in drawn]))


def judge_above(interval: Interval, least: float = 0.0) -> str:
    """Return whether a figure is claimed rightly to be above ``least``: where all of its interval is."""
    low, high = interval
    if low > least:
        return HOLDS
    return FAILS if high <= least else UNDECIDED


def judge_within(interval: Interval, least: float, most: float) -> str:
    """Return whether a figure is claimed rightly to be between two values: where all of its interval is."""
    low, high = interval
    if least <= low and high <= most:
        return HOLDS
    return FAILS if high < least or low > most else UNDECIDED


def judge_all(verdicts: Sequence[str]) -> str:
    """Return the verdict on several claims at once: the worst."""
    return next((verdict for verdict in (FAILS, UNDECIDED) if verdict in verdicts), HOLDS)


def _ranks(values: Float) -> Float:
    """Return ranks from 0 on, the mean rank for equal values."""
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(count)
    ranks: Float = (last - (count + 1) / 2)[place]
    return ranks
