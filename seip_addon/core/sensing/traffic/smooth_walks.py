"""Smoothing of SUMO's pedestrians, who jump by a metre or two at the beginning of a crossing, and turn on the spot."""

from dataclasses import replace

import numpy as np

from ...base.arrays import Boolean, Float
from .trajectories import Trajectories

WINDOW_SECONDS = 1.8  # seconds over which a pedestrian's position and heading are averaged
MAX_LEAP = 4.0  # metres beyond what the speed explains; after a longer step a road user was moved elsewhere


def out_of_reach(trajectories: Trajectories) -> Boolean:
    """Return whether each of the n samples except the first, (n - 1,) bool, is out of reach from the one before.

    Speeds up to 1.5 times those at the two samples are possible. The first sample of a road user is compared with the
    last one of the road user before; that result has no meaning.
    """
    step = np.hypot(*np.diff(trajectories.position[:, :2], axis=0).T)
    speed = np.maximum(trajectories.speed[1:], trajectories.speed[:-1])
    leaps: Boolean = step > 1.5 * speed * np.abs(np.diff(trajectories.time)) + MAX_LEAP
    return leaps


def smooth_walks(trajectories: Trajectories) -> Trajectories:
    """Return the trajectories with pedestrians' positions in plan and headings averaged over `WINDOW_SECONDS`.

    At the ends of a walk, and where a pedestrian was moved elsewhere, the window is shortened to the available samples.
    """
    position, yaw = trajectories.position.copy(), trajectories.yaw.copy()
    leaps = np.flatnonzero(out_of_reach(trajectories)) + 1
    for user, begin, end in zip(trajectories.users, trajectories.first[:-1], trajectories.first[1:], strict=True):
        if user.category != "pedestrian" or end - begin < 3:
            continue
        reach = round(WINDOW_SECONDS / 2.0 / float(np.median(np.diff(trajectories.time[begin:end]))))
        for part in np.split(np.arange(begin, end), leaps[(begin < leaps) & (leaps < end)] - begin):
            position[part, :2] = _averaged(position[part, :2], reach)
            yaw[part] = _averaged(yaw[part, None], reach)[:, 0]
    return replace(trajectories, position=position, yaw=yaw)


def _averaged(values: Float, reach: int) -> Float:
    """Return the mean (n, d) of each row and ``reach`` rows on either side, or fewer where one side has fewer."""
    count = len(values)
    number = np.arange(count)
    reach_here = np.minimum(np.minimum(number, count - 1 - number), reach)
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values - values[0], axis=0)])
    total = sums[number + reach_here + 1] - sums[number - reach_here]
    mean: Float = values[0] + total / (2 * reach_here + 1)[:, None]
    return mean
