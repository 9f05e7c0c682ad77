"""Share of the time for which a vehicle stands on each target."""

from collections.abc import Sequence

from headless.detection.matching import VEHICLES
from headless.detection.recordings import SampledRun

import numpy as np

from seip_addon.core.base.arrays import Boolean, Float
from seip_addon.core.site.site import Targets

INTERVAL = 0.5  # seconds between the instants that are looked at


def vehicle_occupancy(targets: Targets, runs: Sequence[SampledRun]) -> Float:
    """Return the share of time for which a vehicle stands on each target's square, (t,).

    A vehicle stands on a square whose middle its box holds when it is enlarged by half the spacing on each side.
    """
    held, instants = np.zeros(len(targets), dtype=np.int64), 0
    for run in runs:
        users = run.trajectories.users
        reach = np.array([(user.length, user.width) for user in users]) / 2 + targets.spacing / 2
        vehicle = _vehicles(run)
        for time in np.arange(run.times[0], run.trajectories.span[1], INTERVAL).tolist():
            now = run.trajectories.at(time)
            here = vehicle[now.user]
            offset = targets.xyz[None, :, :2] - now.position[here, None, :2]
            cos, sin = np.cos(now.yaw[here])[:, None], np.sin(now.yaw[here])[:, None]
            along, across = cos * offset[..., 0] + sin * offset[..., 1], cos * offset[..., 1] - sin * offset[..., 0]
            most = reach[now.user[here]]
            held += ((np.abs(along) <= most[:, :1]) & (np.abs(across) <= most[:, 1:])).any(axis=0)
            instants += 1
    return held / instants


def _vehicles(run: SampledRun) -> Boolean:
    """Return which road users are vehicles, (u,) bool."""
    return np.array([user.category in VEHICLES for user in run.trajectories.users])
