"""Parked road users of runs."""

import numpy as np

from ...base.arrays import Boolean
from .trajectories import Trajectories

MOST_DRIFT = 0.5  # largest movement of a parked road user along an axis during a run, metres

_TIME_TOLERANCE = 1e-6  # seconds


def parked_users(trajectories: Trajectories) -> Boolean:
    """Return which road users stand still from the first sample of a run to the last, (u,) bool.

    Road users at a traffic light move before or after it, in runs that are longer than a red light.
    """
    begin, end = trajectories.span
    first, last = trajectories.first[:-1], trajectories.first[1:] - 1
    throughout = (trajectories.time[first] <= begin + _TIME_TOLERANCE) & (
        trajectories.time[last] >= end - _TIME_TOLERANCE
    )
    highest = np.maximum.reduceat(trajectories.position, first, axis=0)
    drift = (highest - np.minimum.reduceat(trajectories.position, first, axis=0)).max(axis=1)
    stands: Boolean = throughout & (drift < MOST_DRIFT)
    return stands
