"""Jackknife intervals of figures over independent runs of traffic."""

import math

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.estimates import Interval, student_quantile


def jackknife_reach(left_out: Float) -> float:
    """Return half the width of the 95 % jackknife interval of a figure.

    The delete-one jackknife (Tukey 1958) with Student's quantile of n − 1 degrees of freedom. A bootstrap over few
    samples gives intervals that are too narrow: with 4 or 8 runs of traffic its percentiles contain the true figure in
    77 to 89 of 100 cases instead of 95.

    Parameters
    ----------
    left_out : (n,) float64
        Values of the figure without each of n independent samples, at least two.
    """
    number = len(left_out)
    spread = (number - 1) / number * float(((left_out - left_out.mean()) ** 2).sum())
    return student_quantile(number - 1) * math.sqrt(spread)


def share_interval(share: float, left_out: Float, count: float) -> Interval:
    """Return the 95 % jackknife interval of a share.

    This is `jackknife_reach` on the scale of log odds, on which shares near 0 and 1 have symmetric errors. The interval
    lies between 0 and 1, and has the stated coverage near both ends, too.

    Parameters
    ----------
    share : float, 0 to 1
        Share of all samples.
    left_out : (n,) float64, 0 to 1
        Shares without each of n independent samples, at least two.
    count : float
        Number of items that the share refers to; log odds are limited to half an item from 0 and 1.
    """
    edge = 0.5 / count

    def log_odds(value: Float | float) -> Float:
        kept = np.clip(value, edge, 1.0 - edge)
        odds: Float = np.log(kept / (1.0 - kept))
        return odds

    middle, reach = float(log_odds(share)), jackknife_reach(log_odds(left_out))
    low, high = (float(0.5 + 0.5 * math.tanh(end / 2.0)) for end in (middle - reach, middle + reach))
    return min(low, share), max(high, share)
