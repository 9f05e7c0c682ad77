"""How often a vehicle stands on each target."""

from collections.abc import Sequence

from headless.detection.case_study import Traffic
from headless.detection.matching import VEHICLES
from headless.detection.recordings import SampledRun

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.errors import SeipError
from seip_addon.core.site.site import Site

INTERVAL = 0.5  # seconds between the instants that are looked at


def vehicle_occupancy(targets: Float, runs: Sequence[SampledRun]) -> Float:
    """Return the share of time for which a vehicle stands over each target, (t,).

    Parameters
    ----------
    targets : (t, 3) float64, metres
    """
    held, instants = np.zeros(len(targets), dtype=np.int64), 0
    for run in runs:
        users = run.trajectories.users
        size = np.array([(user.length, user.width) for user in users])
        vehicle = np.array([user.category in VEHICLES for user in users])
        for time in np.arange(run.times[0], run.trajectories.span[1], INTERVAL).tolist():
            now = run.trajectories.at(time)
            here = vehicle[now.user]
            offset = targets[None, :, :2] - now.position[here, None, :2]
            cos, sin = np.cos(now.yaw[here])[:, None], np.sin(now.yaw[here])[:, None]
            along, across = cos * offset[..., 0] + sin * offset[..., 1], cos * offset[..., 1] - sin * offset[..., 0]
            half = size[now.user[here]] / 2
            held += ((np.abs(along) <= half[:, :1]) & (np.abs(across) <= half[:, 1:])).any(axis=0)
            instants += 1
    return held / instants


def require_vehicles(traffic: Traffic, site: Site) -> None:
    """Raise SeipError where no vehicle is ever in the region in the runs to learn from, or in those for tests."""
    for what, runs in (("to learn from", traffic.training), ("for tests", traffic.test)):
        if not vehicle_occupancy(site.targets.xyz, runs).any():
            raise SeipError(
                f"no vehicle is ever in the region of interest in the runs {what}: there is nothing to detect, so name "
                "traffic of this scene"
            )
