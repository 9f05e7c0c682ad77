"""Smoothing of SUMO's pedestrians, who leap by a metre or two where a crossing begins, and turn on the spot."""

from dataclasses import replace

import numpy as np

from ...arrays import Boolean, Float
from .trajectories import Trajectories

WINDOW_SECONDS = 1.8  # seconds over which a pedestrian's position and heading are averaged
MAX_LEAP = 4.0  # metres beyond what its speed explains: who moves further between two samples was put elsewhere


def out_of_reach(trajectories: Trajectories) -> Boolean:
    """Return whether each of the n samples but the first, (n - 1,) bool, is out of reach from the one before.

    The speeds at both are believed up to half as much again. The first sample of a road user is compared with the last
    of the one before, which means nothing.
    """
    step = np.hypot(*np.diff(trajectories.position[:, :2], axis=0).T)
    speed = np.maximum(trajectories.speed[1:], trajectories.speed[:-1])
    leaps: Boolean = step > 1.5 * speed * np.abs(np.diff(trajectories.time)) + MAX_LEAP
    return leaps


def smooth_walks(trajectories: Trajectories) -> Trajectories:
    """Return the trajectories with pedestrians' positions in plan and headings averaged over `WINDOW_SECONDS`.

    At the ends of a walk, and where a pedestrian was put somewhere else, the window shrinks to what is there.
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
    """Return the mean (n, d) of each row and as many on either side: ``reach``, or as many as there are on both."""
    count = len(values)
    number = np.arange(count)
    reach_here = np.minimum(np.minimum(number, count - 1 - number), reach)
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values - values[0], axis=0)])
    total = sums[number + reach_here + 1] - sums[number - reach_here]
    mean: Float = values[0] + total / (2 * reach_here + 1)[:, None]
    return mean
