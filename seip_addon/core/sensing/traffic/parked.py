"""Parked road users of runs, and parking bays that two runs share."""

import numpy as np

from ...arrays import Boolean
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


def shared_bays(one: Trajectories, other: Trajectories, radius: float) -> float:
    """Return the share of a run's parked road users within a radius, metres in plan, of a parked one of another run.

    It is the larger share of the two runs, and zero if one of them has no parked road users.
    """
    places = [run.position[run.first[:-1]][parked_users(run), :2] for run in (one, other)]
    if not all(map(len, places)):
        return 0.0
    close = np.hypot(*(places[0][:, None] - places[1]).transpose(2, 0, 1)) <= radius
    return float(max(close.any(axis=1).mean(), close.any(axis=0).mean()))
