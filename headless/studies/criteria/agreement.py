"""How well criteria agree with average precision over placements, and how well they could.

Intervals are over other placements drawn like these, other test traffic and other trainings at once: a resample draws
placements, and the same traffic and trainings for all of them. Traffic that favours one arm favours all placements
that see it, so placements alone would promise too much.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from headless.studies.rank_correlation import rank_agreements

import numpy as np

from seip_addon.core.arrays import Boolean, Float, Integer
from seip_addon.core.estimates import IntervalEstimate, percentiles

from .criteria import Criterion
from .drawing import MIN_PLACEMENTS, NEAR
from .precision import PLACEMENT_SEED, Precisions

MAX_CORRELATION = 1 - 1e-6  # beyond it Fisher's scale is endless


@dataclass(frozen=True, eq=False)
class Correlation:
    """Agreement of a criterion with average precision over some placements.

    Parameters
    ----------
    placements : int
        Their number.
    spearman, kendall : IntervalEstimate
        Without an interval where there are too few placements or runs.
    resampled : (r,) float64
        Spearman's in the resamples; empty without an interval.
    """

    placements: int
    spearman: IntervalEstimate
    kendall: IntervalEstimate
    resampled: Float


@dataclass(frozen=True, eq=False)
class AssessedCriterion:
    """A criterion beside coverage.

    Parameters
    ----------
    difference : IntervalEstimate
        Its Spearman correlation less that of coverage, resample for resample.
    best : int
        The evaluated placement that it likes best.
    gain : IntervalEstimate
        The average precision of that less that of the one that coverage likes best, on the same traffic.
    """

    criterion: Criterion
    correlation: Correlation
    difference: IntervalEstimate
    best: int
    gain: IntervalEstimate


@dataclass(frozen=True)
class NoiseCeiling:
    """The correlation with average precision that a criterion without any error would have.

    The test traffic and the training each add an error to the average precision of a placement. Two halves of the
    traffic agree as far as the first allows, two trainings as far as the second. By Spearman and Brown (1910) follows
    how well all of the traffic, and the mean of all trainings, would agree with another such: the reliability. Where
    the errors add up, that of both is the sum of the two less one, and no criterion correlates better than its root
    (Spearman 1904). The formulas are those of products of moments; for ranks they are near.

    Parameters
    ----------
    halves : IntervalEstimate
        Spearman correlation of the average precision on two halves of the test runs, the mean over ways to halve them.
    trainings : IntervalEstimate or None
        That of two trainings, the mean over pairs; None with one training.
    reliability, ceiling : IntervalEstimate
    """

    halves: IntervalEstimate
    trainings: IntervalEstimate | None
    reliability: IntervalEstimate
    ceiling: IntervalEstimate


def correlate(criterion: Criterion, precise: Precisions, which: Boolean | None = None) -> Correlation:
    """Return how well a criterion agrees with average precision over all or some placements (n,) bool."""
    rows = np.arange(len(criterion.values)) if which is None else np.flatnonzero(which)
    found = rank_agreements(criterion.values[rows], precise.values[rows]) if len(rows) else (np.nan, np.nan)
    values = [float(value) for value in found]
    if len(rows) < MIN_PLACEMENTS or not precise.has_intervals or np.isnan(values).any():
        return Correlation(len(rows), _open(values[0]), _open(values[1]), np.zeros(0))
    drawn = rows[_drawn(len(rows), precise.resampled.shape[1])]
    resamples = np.arange(len(drawn))[:, None]
    resampled = rank_agreements(criterion.values[drawn], precise.resampled[drawn, resamples])
    spearman, kendall = (_around(value, some) for value, some in zip(values, resampled, strict=True))
    return Correlation(len(rows), spearman, kendall, resampled[0])


def assess(criteria: Sequence[Criterion], precise: Precisions) -> tuple[AssessedCriterion, ...]:
    """Set each criterion beside the first, which is coverage."""
    correlations = [correlate(one, precise) for one in criteria]
    coverage, reference = correlations[0], int(np.argmax(criteria[0].values))
    assessed = []
    for criterion, correlation in zip(criteria, correlations, strict=True):
        best = int(np.argmax(criterion.values))
        gain = float(precise.values[best] - precise.values[reference])
        gains = precise.resampled[best] - precise.resampled[reference]
        assessed.append(
            AssessedCriterion(
                criterion,
                correlation,
                _difference(correlation, coverage),
                best,
                IntervalEstimate(gain, *percentiles(gains)) if precise.has_intervals else _open(gain),
            )
        )
    return tuple(assessed)


def noise_ceiling(precise: Precisions) -> NoiseCeiling:
    """Return how well a criterion could agree with the average precision that was measured."""
    number = len(precise.values)
    measured = _ceiling(precise, np.arange(number))
    resampled = _ceiling(precise, _drawn(number, precise.resampled.shape[1]))
    halves, trainings, reliability, ceiling = (
        _around(float(value), some) if precise.has_intervals and np.isfinite(value) else _open(float(value))
        for value, some in zip(measured, resampled, strict=True)
    )
    return NoiseCeiling(halves, trainings if precise.trainings > 1 else None, reliability, ceiling)


def near_optimum(coverage: Criterion) -> Boolean:
    """Return which placements cover within `NEAR` of the best, (n,) bool."""
    near: Boolean = coverage.values >= coverage.values.max() - NEAR
    return near


def upper_half(coverage: Criterion) -> Boolean:
    """Return which placements cover as much as the median or more, (n,) bool."""
    upper: Boolean = coverage.values >= np.median(coverage.values)
    return upper


def _ceiling(precise: Precisions, rows: Integer) -> tuple[Float, Float, Float, Float]:
    """Return agreement of halves and of trainings, reliability and ceiling for rows (…, n) of placements."""
    halves = np.mean([rank_agreements(one[rows], other[rows])[0] for one, other in precise.halves], axis=0)
    of_traffic = _spearman_brown(halves, 2)
    trainings, of_trainings = np.ones_like(halves), np.ones_like(halves)
    if precise.trainings > 1:
        pairs = combinations(precise.by_training, 2)
        trainings = np.mean([rank_agreements(one[rows], other[rows])[0] for one, other in pairs], axis=0)
        of_trainings = _spearman_brown(trainings, precise.trainings)
    reliability = np.clip(of_traffic + of_trainings - 1, 0.0, 1.0)
    return halves, trainings, reliability, np.sqrt(reliability)


def _spearman_brown(agreement: Float, times: int) -> Float:
    """Return the reliability of data that is `times` as large as two halves with this correlation (Spearman-Brown)."""
    positive = np.maximum(agreement, 0.0)
    reliability: Float = times * positive / (1 + (times - 1) * positive)
    return reliability


def _drawn(number: int, resamples: int) -> Integer:
    """Return resamples of n placements, the same for each call, (r, n) int64."""
    return np.random.default_rng(PLACEMENT_SEED).integers(number, size=(resamples, number))


def _difference(one: Correlation, other: Correlation) -> IntervalEstimate:
    value = one.spearman.value - other.spearman.value
    if not (len(one.resampled) and len(other.resampled)):
        return _open(value)
    resampled = one.resampled - other.resampled
    low, high = percentiles(resampled)
    shift = value - float(np.nanmedian(resampled))
    return IntervalEstimate(value, low + shift, high + shift)


def _around(value: float, resampled: Float) -> IntervalEstimate:
    """Return a correlation with the interval of its resamples, moved on Fisher's scale until their median is the value.

    Resamples of traffic add its noise a second time, so that they lie below what was measured.
    """
    scaled, z = _fisher(resampled), float(_fisher(np.array(value)))
    low, high = percentiles(scaled)
    shift = z - float(np.nanmedian(scaled))
    return IntervalEstimate(value, float(np.tanh(low + shift)), float(np.tanh(high + shift)))


def _fisher(correlation: Float) -> Float:
    scaled: Float = np.arctanh(np.clip(correlation, -MAX_CORRELATION, MAX_CORRELATION))
    return scaled


def _open(value: float) -> IntervalEstimate:
    return IntervalEstimate(value, -np.inf, np.inf)
