"""Rank correlation of criteria with average precision over placements.

Intervals are over other placements drawn like these, other test traffic and other trainings at once: a resample draws
placements, and the same traffic and trainings for all of them. Traffic that favours one arm favours all placements
that see it, so placements alone would promise too much.
"""

from headless.studies.rank_correlation import rank_agreements

import numpy as np

from seip_addon.core.base.arrays import Float, Integer
from seip_addon.core.base.estimates import IntervalEstimate, percentiles

from .drawing import MIN_PLACEMENTS
from .precision import PLACEMENT_SEED, Precisions

MAX_CORRELATION = 1 - 1e-6  # beyond it Fisher's scale is endless


def correlate(values: Float, precise: Precisions) -> IntervalEstimate:
    """Return the Spearman correlation of a criterion's values (n,) with average precision, with its 95 % interval.

    The interval is open where there are too few placements or runs.
    """
    value = float(rank_agreements(values, precise.values)[0])
    if len(values) < MIN_PLACEMENTS or not precise.has_intervals or np.isnan(value):
        return IntervalEstimate(value, -np.inf, np.inf)
    drawn = _drawn(len(values), precise.resampled.shape[1])
    resamples = np.arange(len(drawn))[:, None]
    return _around(value, rank_agreements(values[drawn], precise.resampled[drawn, resamples])[0])


def _drawn(number: int, resamples: int) -> Integer:
    """Return resamples of n placements, the same for each call, (r, n) int64."""
    return np.random.default_rng(PLACEMENT_SEED).integers(number, size=(resamples, number))


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
