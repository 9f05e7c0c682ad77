"""Which road users are parked, and where two runs have them in the same place."""

import numpy as np

from ...arrays import Boolean
from .trajectories import Trajectories

MOST_DRIFT = 0.5  # metres along an axis that who is parked moves at most in a run

_TIME_TOLERANCE = 1e-6  # seconds


def parked_users(trajectories: Trajectories) -> Boolean:
    """Return which road users stand from the first sample of a run to its last, (u,) bool.

    Who waits at a traffic light drives before or after that, in runs that are longer than a red light.
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
    """Return the share of the parked of a run that stand within so many metres of a parked one of another.

    In plan; of the two runs the larger share, and nought where one of them has none.
    """
    places = [run.position[run.first[:-1]][parked_users(run), :2] for run in (one, other)]
    if not all(map(len, places)):
        return 0.0
    close = np.hypot(*(places[0][:, None] - places[1]).transpose(2, 0, 1)) <= radius
    return float(max(close.any(axis=1).mean(), close.any(axis=0).mean()))
