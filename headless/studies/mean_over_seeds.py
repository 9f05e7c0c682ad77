"""Interval of the mean of a figure over repetitions with different seeds."""

import math
from collections.abc import Sequence

import numpy as np

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.estimates import Interval, student_reach

ANYTHING: Interval = (-math.inf, math.inf)  # range of a figure without bounds
COUNT: Interval = (0.0, math.inf)
CHANGE_OF_SHARE: Interval = (-1.0, 1.0)


def mean_interval(values: Sequence[float], possible: Interval = ANYTHING) -> Interval:
    """Return the 95 % interval of the mean over repetitions (seeds); see `student_reach`.

    Impossible values are cut off, which does not change the probability that the interval contains the mean.

    Parameters
    ----------
    values : sequence of float
        Values of the repetitions.
    possible : (float, float)
        Least and largest possible value of the figure.

    Raises
    ------
    SeipError
        There are fewer than two values.
    """
    if len(values) < 2:
        raise SeipError(
            f"{len(values)} seed gives no interval: repeat the study with at least two, better three or more"
        )
    mean, reach = float(np.mean(values)), student_reach(values)
    return max(mean - reach, possible[0]), min(mean + reach, possible[1])
