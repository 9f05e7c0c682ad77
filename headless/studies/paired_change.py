"""Paired differences of average precision, with intervals over traffic and trainings."""

from __future__ import annotations

import math
from collections.abc import Sequence

from headless.detection.average_precision import (
    Evaluation,
    average_precisions_without_each_run,
    jackknife_reach,
    share_interval,
)
from headless.studies.mean_over_seeds import CHANGE_OF_SHARE, within

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.estimates import SHARE, Interval, IntervalEstimate, student_reach


class ResampledPrecision:
    """Average precision of one detector, with the values without each run of traffic (jackknife).

    Paired results are from the same frames, and so leave out the same runs.
    """

    def __init__(self, evaluation: Evaluation) -> None:
        self.value = evaluation.average_precision
        self.wanted = len(evaluation.wanted)
        self.left_out = average_precisions_without_each_run(evaluation)


def level(those: Sequence[ResampledPrecision]) -> IntervalEstimate:
    """Return the mean average precision of detectors that differ only in their seeds."""
    values = [one.value for one in those]
    left_out = _without_each_run(those)
    if left_out is None:
        return _open(values)
    over_traffic = share_interval(float(np.mean(values)), left_out, those[0].wanted)
    return _with_trainings(values, over_traffic, SHARE)


def change(
    to: Sequence[ResampledPrecision], of: Sequence[ResampledPrecision], *, same_traffic: bool = True
) -> IntervalEstimate:
    """Return the change of mean average precision between two trials of the same detectors.

    Differences are taken for each detector and, with the same traffic, for each
    run: difficult traffic is difficult in both trials. So a change can be
    significant that is far smaller than the interval of either average precision.

    Parameters
    ----------
    to, of : sequence of ResampledPrecision
        Results after and before the change, with detectors in the same order.
    same_traffic : bool
        Whether both had the same frames.
    """
    pairs = list(zip(to, of, strict=True))
    values = [after.value - before.value for after, before in pairs]
    after, before = _without_each_run(to), _without_each_run(of)
    if after is None or before is None:
        return _open(values)
    value = float(np.mean(values))
    if same_traffic:
        reach = jackknife_reach(after - before)
    else:
        reach = math.hypot(jackknife_reach(after), jackknife_reach(before))
    return _with_trainings(values, (value - reach, value + reach), CHANGE_OF_SHARE)


def _without_each_run(those: Sequence[ResampledPrecision]) -> Float | None:
    """Return the mean average precision of detectors without each run (r,), or None with too few runs."""
    known = [one.left_out for one in those if one.left_out is not None]
    if len(known) < len(those):
        return None
    mean: Float = np.mean(known, axis=0)
    return mean


def _open(values: Sequence[float]) -> IntervalEstimate:
    """Return the mean over detectors with an infinite interval, for too little traffic."""
    return IntervalEstimate(float(np.mean(values)), -math.inf, math.inf)


def _with_trainings(values: Sequence[float], over_traffic: Interval, possible: Interval) -> IntervalEstimate:
    """Return the mean over detectors with its 95 % interval over traffic and trainings.

    The interval over trainings is Student's. For two independent errors, the
    distances from the value to the ends of the intervals add in quadrature
    (G. Y. Zou, A. Donner: Construction of confidence limits about effect
    measures. Statistics in Medicine 27 (2008), 1693-1702).
    """
    value, (low, high) = float(np.mean(values)), over_traffic
    reach = student_reach(values) if len(values) > 1 else 0.0
    ends = value - math.hypot(value - low, reach), value + math.hypot(high - value, reach)
    return IntervalEstimate(value, *within(ends, possible))
