"""Poses of road users during a revolution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.arrays import Float
from ...geometry.orientation import rotations
from ..traffic.trajectories import Snapshot, Trajectories


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of one road user during a revolution, linear between s samples.

    Parameters
    ----------
    user : int
        Index into the trajectories' road users.
    delay : (s,) float64, seconds
        Time of each sample after the beginning of the revolution, increasing; a single sample if it stands still.
    position : (s, 3) float64, metres
        Centre of the underside, local site axes.
    yaw, pitch : (s,) float64, radians
        Angles at the samples.
    attitude : (s, 3, 3) float64
        Rotations from the road user's axes to the site's.
    """

    user: int
    delay: Float
    position: Float
    yaw: Float
    pitch: Float
    attitude: Float

    @property
    def is_still(self) -> bool:
        """Whether the road user stands still for the whole revolution."""
        return len(self.delay) == 1

    def pose(self, delay: float) -> tuple[Float, float, float]:
        """Return position (3,), yaw and pitch at a delay in seconds."""
        position = np.array([np.interp(delay, self.delay, part) for part in self.position.T])
        return position, float(np.interp(delay, self.delay, self.yaw)), float(np.interp(delay, self.delay, self.pitch))

    def at(self, delay: Float) -> tuple[Float, Float]:
        """Return positions (n, 3) and rotations (n, 3, 3) at delays (n,) in seconds."""
        # angles are interpolated and rotations made from them: interpolated matrices would not be rotations
        position = np.stack([np.interp(delay, self.delay, part) for part in self.position.T], axis=1)
        yaw, pitch = (np.interp(delay, self.delay, angle) for angle in (self.yaw, self.pitch))
        return position, rotations(yaw, pitch)


def still(snapshot: Snapshot) -> list[Motion]:
    """Return motions in which the road users of an instant stand still: without a rolling shutter."""
    no_delay, attitude = np.zeros(1), rotations(snapshot.yaw, snapshot.pitch)
    each = [(int(user), slice(row, row + 1)) for row, user in enumerate(snapshot.user)]
    return [
        Motion(user, no_delay, snapshot.position[row], snapshot.yaw[row], snapshot.pitch[row], attitude[row])
        for user, row in each
    ]


def moving(trajectories: Trajectories, snapshot: Snapshot, duration: float) -> list[Motion]:
    """Return the motion of the road users present at a snapshot over ``duration`` seconds: for a rolling shutter.

    Road users whose samples end earlier keep their last pose.
    """
    return [_motion(trajectories, int(user), snapshot.time, duration) for user in snapshot.user]


def _motion(trajectories: Trajectories, user: int, begin: float, duration: float) -> Motion:
    """Return the motion of one road user from a time on."""
    own = slice(int(trajectories.first[user]), int(trajectories.first[user + 1]))
    known = trajectories.time[own]
    # The trajectory is linear between its samples. With those within the revolution as knots, and both ends added, the
    # motion is the same function, and not an approximation of it.
    between = known[(known > begin) & (known < begin + duration)]
    times = np.concatenate([[begin], between, [begin + duration]])

    def of(values: Float) -> Float:
        return np.interp(times, known, values[own])

    position = np.stack([of(part) for part in trajectories.position.T], axis=1)
    yaw, pitch = of(trajectories.yaw), of(trajectories.pitch)
    # parked and waiting road users become still motions, for which the scanner needs one transformation
    values = np.column_stack([position, yaw, pitch])
    if (values == values[0]).all():
        times, position, yaw, pitch = times[:1], position[:1], yaw[:1], pitch[:1]
    return Motion(user, times - begin, position, yaw, pitch, rotations(yaw, pitch))
