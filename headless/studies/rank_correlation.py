"""Rank correlation of two figures, with an interval."""

import math
from collections.abc import Sequence

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.estimates import RESAMPLES, Interval, percentiles


def rank_correlation(x: Float | Sequence[float], y: Float | Sequence[float]) -> float:
    """Return Spearman's (1904) rank correlation; equal values share their mean rank; NaN if all are equal."""
    ranks = np.array([_ranks(np.asarray(values, dtype=np.float64)) for values in (x, y)])
    centred = ranks - ranks.mean(axis=1, keepdims=True)
    scale = math.sqrt(float((centred[0] ** 2).sum() * (centred[1] ** 2).sum()))
    return float(centred[0] @ centred[1]) / scale if scale else math.nan


def rank_agreements(x: Float, y: Float) -> tuple[Float, Float]:
    """Return Spearman's and Kendall's (tau-b, 1945) rank correlation along the last axis; NaN if all are equal.

    Both follow from the signs of all pairwise differences; equal values share their mean rank.

    Parameters
    ----------
    x, y : (…, n) float64

    Returns
    -------
    spearman, kendall : (…) float64
    """
    # The sum of a value's signs against all others is twice its centred rank: hence Spearman's from the sums, and
    # Kendall's from the signs themselves.
    of_x, of_y = (np.sign(values[..., :, None] - values[..., None, :]) for values in (x, y))
    return _cosine(of_x.sum(axis=-1), of_y.sum(axis=-1), (-1,)), _cosine(of_x, of_y, (-2, -1))


def _cosine(one: Float, other: Float, axes: tuple[int, ...]) -> Float:
    scale = np.sqrt((one**2).sum(axis=axes) * (other**2).sum(axis=axes))
    return np.divide((one * other).sum(axis=axes), scale, out=np.full(scale.shape, np.nan), where=scale > 0)


def rank_correlation_interval(x: Sequence[float], y: Sequence[float], seed: int) -> Interval | None:
    """Return the 95 % interval of the rank correlation, or None if there are too few pairs.

    Bootstrap (Efron 1979) over pairs. Give one pair for each configuration, with the mean over its seeds, because seeds
    of one configuration are not additional evidence of a correlation.

    Parameters
    ----------
    x, y : sequence of float
        Values of the pairs.
    seed : int
        Seed of the resamples.
    """
    if len(x) < 4 or math.isnan(rank_correlation(x, y)):
        return None
    left, right = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    drawn = np.random.default_rng(seed).integers(len(left), size=(RESAMPLES, len(left)))
    return percentiles(np.array([rank_correlation(left[rows], right[rows]) for rows in drawn]))


def _ranks(values: Float) -> Float:
    """Return ranks from 0, with the mean rank for equal values."""
    ordered = np.sort(values)
    ranks: Float = (np.searchsorted(ordered, values) + np.searchsorted(ordered, values, side="right") - 1) / 2
    return ranks
