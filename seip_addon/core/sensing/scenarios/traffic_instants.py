"""Sampled instants of traffic with the vehicles present."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.arrays import Float, Integer
from ...base.errors import SeipError
from ...geometry.orientation import rotations
from ..traffic.bodies import fitted_body
from ..traffic.trajectories import WARM_UP, Snapshot, Trajectories

BATCH_SECONDS = 12.0  # seconds of a run whose instants count as one draw, since the same queues block the view


@dataclass(frozen=True, eq=False)
class TrafficObstacles:
    """Bodies of the road users present at one instant; n triangles together.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
        Corners of the bodies' triangles, local site axes.
    reflectivity : (n,) float64, 0 to 1
        Reflectivity of each triangle.
    """

    triangles: Float
    reflectivity: Float


NO_TRAFFIC = TrafficObstacles(np.empty((0, 3, 3)), np.empty(0))  # the empty road


@dataclass(frozen=True, eq=False)
class Instants:
    """A sample of n instants of runs of traffic.

    Parameters
    ----------
    runs : tuple of Trajectories
        Trajectories in the scene's local axes.
    run : (n,) int64
        Run of each instant.
    time : (n,) float64, seconds
        Time of each instant.
    batch : (n,) int64
        Batch of time of each instant; instants of different batches are nearly independent.
    """

    runs: tuple[Trajectories, ...]
    run: Integer
    time: Float
    batch: Integer

    def __len__(self) -> int:
        return len(self.time)

    def snapshots(self) -> Iterator[tuple[Trajectories, Snapshot]]:
        """Yield the run of each instant and the road users present."""
        for run, time in zip(self.run.tolist(), self.time.tolist(), strict=True):
            yield self.runs[run], self.runs[run].at(time)

    def obstacles(self) -> list[TrafficObstacles]:
        """Return the bodies present at each instant."""
        return [obstacles_of(run, snapshot) for run, snapshot in self.snapshots()]

    @property
    def road_users(self) -> float:
        """Mean number of road users present."""
        return float(np.mean([len(snapshot) for _, snapshot in self.snapshots()]))


def spread_instants(runs: Sequence[Trajectories], number: int, seed: int) -> Instants:
    """Draw evenly spread instants: one at random in each of ``number`` equal parts of the runs' time.

    Raises
    ------
    SeipError
        The number is less than 1, or a run is too short.
    """
    if number < 1:
        raise SeipError(f"the number of instants of traffic must be at least 1, not {number}")
    begin = np.array([run.span[0] + WARM_UP for run in runs])
    lasts = np.array([run.span[1] for run in runs]) - begin
    if (lasts <= 0).any():
        short = runs[int(np.argmin(lasts))]
        raise SeipError(
            f"{short.description} is not longer than the {WARM_UP:g} s that are left out: simulate more traffic"
        )
    before = np.concatenate([[0.0], np.cumsum(lasts)])
    drawn = (np.arange(number) + np.random.default_rng(seed).random(number)) * before[-1] / number
    run = np.searchsorted(before[1:-1], drawn, side="right")
    into = drawn - before[run]
    parts = np.maximum(np.rint(lasts / BATCH_SECONDS), 1).astype(np.int64)
    part = np.minimum(into / lasts[run] * parts[run], parts[run] - 1).astype(np.int64)
    return Instants(tuple(runs), run, begin[run] + into, np.concatenate([[0], np.cumsum(parts)])[run] + part)


def obstacles_of(trajectories: Trajectories, snapshot: Snapshot) -> TrafficObstacles:
    """Return the bodies of the road users of an instant, at their poses."""
    if len(snapshot) == 0:
        return NO_TRAFFIC
    attitudes = rotations(snapshot.yaw, snapshot.pitch)
    triangles, reflectivity = [], []
    for user, position, attitude in zip(snapshot.user.tolist(), snapshot.position, attitudes, strict=True):
        body = fitted_body(trajectories.users[user])
        triangles.append(position + body.triangles @ attitude.T)
        reflectivity.append(body.reflectivity)
    return TrafficObstacles(np.concatenate(triangles), np.concatenate(reflectivity))
