"""Poses of road users during a revolution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Float
from ..traffic.trajectories import Snapshot, Trajectories


@dataclass(frozen=True, eq=False)
class Motion:
    """One road user's way during a revolution: straight from each of s samples to the next.

    Parameters
    ----------
    user : int
        Index into the trajectories' road users.
    delay : (s,) float64, seconds
        After the beginning of the revolution, increasing; one sample alone means that it stays.
    position : (s, 3) float64, metres
        Middle of the underside, local site axes.
    yaw, pitch : (s,) float64, radians
    attitude : (s, 3, 3) float64
        Rotations from its own axes to the site's.
    """

    user: int
    delay: Float
    position: Float
    yaw: Float
    pitch: Float
    attitude: Float

    @property
    def is_still(self) -> bool:
        """Whether it is at one place in one attitude all the time."""
        return len(self.delay) == 1

    def same_as(self, other: Motion | None) -> bool:
        """Whether both stay, at one place and in one attitude."""
        if other is None or not (self.is_still and other.is_still):
            return False
        return all(
            (one == two).all()
            for one, two in ((self.position, other.position), (self.yaw, other.yaw), (self.pitch, other.pitch))
        )

    def pose(self, delay: float) -> tuple[Float, float, float]:
        """Return position (3,), yaw and pitch at a delay in seconds."""
        position = np.array([np.interp(delay, self.delay, part) for part in self.position.T])
        return position, float(np.interp(delay, self.delay, self.yaw)), float(np.interp(delay, self.delay, self.pitch))

    def at(self, delay: Float) -> tuple[Float, Float]:
        """Return positions (n, 3) and rotations (n, 3, 3) at delays (n,) in seconds."""
        position = np.stack([np.interp(delay, self.delay, part) for part in self.position.T], axis=1)
        yaw, pitch = (np.interp(delay, self.delay, angle) for angle in (self.yaw, self.pitch))
        return position, rotations(yaw, pitch)


def rotations(yaw: Float, pitch: Float) -> Float:
    """Return rotations (n, 3, 3) from a road user's axes (forward, left, up) to the site's."""
    zero = np.zeros_like(yaw)
    forward = np.stack([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)], axis=-1)
    left = np.stack([-np.sin(yaw), np.cos(yaw), zero], axis=-1)
    return np.stack([forward, left, np.cross(forward, left)], axis=-1)


def still(snapshot: Snapshot) -> list[Motion]:
    """Return the road users of an instant, as if they stayed there."""
    nought, attitude = np.zeros(1), rotations(snapshot.yaw, snapshot.pitch)
    each = [(int(user), slice(row, row + 1)) for row, user in enumerate(snapshot.user)]
    return [
        Motion(user, nought, snapshot.position[row], snapshot.yaw[row], snapshot.pitch[row], attitude[row])
        for user, row in each
    ]


def moving(trajectories: Trajectories, snapshot: Snapshot, duration: float) -> list[Motion]:
    """Return the way of an instant's road users from then on, for so many seconds.

    Whose samples end earlier stays where the last one is.
    """
    return [_way(trajectories, int(user), snapshot.time, duration) for user in snapshot.user]


def _way(trajectories: Trajectories, user: int, begin: float, duration: float) -> Motion:
    own = slice(int(trajectories.first[user]), int(trajectories.first[user + 1]))
    known = trajectories.time[own]
    between = known[(known > begin) & (known < begin + duration)]
    times = np.concatenate([[begin], between, [begin + duration]])

    def of(values: Float) -> Float:
        return np.interp(times, known, values[own])

    position = np.stack([of(part) for part in trajectories.position.T], axis=1)
    yaw, pitch = of(trajectories.yaw), of(trajectories.pitch)
    values = np.column_stack([position, yaw, pitch])
    if (values == values[0]).all():
        times, position, yaw, pitch = times[:1], position[:1], yaw[:1], pitch[:1]
    return Motion(user, times - begin, position, yaw, pitch, rotations(yaw, pitch))
