"""Parking bays that two runs of traffic share."""

import numpy as np

from seip_addon.core.sensing.traffic.parked import parked_users
from seip_addon.core.sensing.traffic.trajectories import Trajectories


def shared_bays(one: Trajectories, other: Trajectories, radius: float) -> float:
    """Return the share of a run's parked road users within a radius, metres in plan, of a parked one of another run.

    It is the larger share of the two runs, and zero if one of them has no parked road users.
    """
    places = [run.position[run.first[:-1]][parked_users(run), :2] for run in (one, other)]
    if not all(map(len, places)):
        return 0.0
    close = np.hypot(*(places[0][:, None] - places[1]).transpose(2, 0, 1)) <= radius
    return float(max(close.any(axis=1).mean(), close.any(axis=0).mean()))
