"""Paired differences of average precision, with intervals over traffic and trainings."""

from __future__ import annotations

import math
from collections.abc import Sequence

from headless.detection.average_precision import MIN_BLOCKS, RESAMPLES, Evaluation, resampled_average_precisions

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.estimates import IntervalEstimate, percentiles, student_reach

DRAWS = 2 * RESAMPLES
"""Resamples of the blocks of traffic; what the first half of them says must be what all say."""


class ResampledPrecision:
    """One detector's average precision on some frames, with resamples of their traffic.

    Parameters
    ----------
    seed : int
        Of the resamples: what is compared pair by pair has the same, and the same frames.
    """

    def __init__(self, evaluation: Evaluation, seed: int = 0) -> None:
        self.value = evaluation.average_precision
        self.blocks = int(evaluation.block.max()) + 1
        self.draws = resampled_average_precisions(evaluation, seed, DRAWS)


def level(those: Sequence[ResampledPrecision], draws: int = DRAWS) -> IntervalEstimate:
    """Return the mean average precision of detectors that differ in their seeds alone."""
    return _estimate([one.value for one in those], [one.draws[:draws] for one in those], those[0].blocks)


def change(to: Sequence[ResampledPrecision], of: Sequence[ResampledPrecision], draws: int = DRAWS) -> IntervalEstimate:
    """Return by how much the mean average precision changes from one trial to another of the same detectors.

    Differences are taken detector by detector and, where both had the same
    frames and seed, resample by resample: what makes traffic hard makes it hard
    for both. So a change can be told that is far smaller than the interval of
    either average precision.

    Parameters
    ----------
    to, of : sequence of ResampledPrecision
        In the same order of detectors.
    draws : int
        Resamples that count.
    """
    pairs = list(zip(to, of, strict=True))
    return _estimate(
        [after.value - before.value for after, before in pairs],
        [after.draws[:draws] - before.draws[:draws] for after, before in pairs],
        min(min(after.blocks, before.blocks) for after, before in pairs),
    )


def _estimate(values: Sequence[float], draws: Sequence[Float], blocks: int) -> IntervalEstimate:
    """Return the mean over detectors; its 95 % interval is over other traffic and over other trainings.

    Over traffic it is that of the bootstrap, over trainings Student's. Of two
    independent errors the distances from the value to the ends add up as
    squares (G. Y. Zou, A. Donner: Construction of confidence limits about
    effect measures. Statistics in Medicine 27 (2008), 1693-1702).
    """
    value = float(np.mean(values))
    if blocks < MIN_BLOCKS:
        return IntervalEstimate(value, -math.inf, math.inf)
    low, high = percentiles(np.mean(draws, axis=0))
    reach = student_reach(values) if len(values) > 1 else 0.0
    return IntervalEstimate(value, value - math.hypot(value - low, reach), value + math.hypot(high - value, reach))
