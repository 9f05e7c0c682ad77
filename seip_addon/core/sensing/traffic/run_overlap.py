"""Overlap of two runs of traffic: share of vehicles at the same place at the same instant."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ...base.arrays import Float
from ...base.errors import SeipError
from .trajectories import Trajectories

MATCH_RADIUS = 1.0  # metres in plan within which two vehicles are at the same place

MAX_OVERLAP = 0.5
"""Share of the vehicles above which two runs are treated as copies. Independent runs have queues in the same places."""

_INTERVAL = 1.0
_SAME_TIME = 1e-3


@dataclass(frozen=True, eq=False)
class VehiclePositions:
    """Positions of the vehicles of a run, at some instants.

    Parameters
    ----------
    name : str
        Name of the run, for messages.
    time : (n,) float64, seconds
        Times of the instants, ascending.
    xy : sequence of (k, 2) float64, metres
        Positions in plan at each instant.
    """

    name: str
    time: Float
    xy: Sequence[Float]


def vehicle_positions(name: str, trajectories: Trajectories) -> VehiclePositions:
    """Return the positions of the vehicles of a run, without pedestrians, at every full second."""
    begin, end = trajectories.span
    time = np.arange(np.ceil(begin / _INTERVAL), end / _INTERVAL + _SAME_TIME) * _INTERVAL
    rolls = np.array([user.category != "pedestrian" for user in trajectories.users], dtype=bool)
    snapshots = [trajectories.at(float(instant)) for instant in time]
    return VehiclePositions(name, time, [snapshot.position[rolls[snapshot.user], :2] for snapshot in snapshots])


def overlap_of(one: VehiclePositions, other: VehiclePositions) -> float | None:
    """Return the share of vehicles of a run within `MATCH_RADIUS` of one of the other run at the same instant.

    Instants are compared by time, and by time since the first instant. The result is the larger share of both
    comparisons and of both runs.

    Returns
    -------
    float or None
        The share, or None if the runs have no instant in common.
    """
    if not len(one.time) or not len(other.time):
        return None
    shares = [_aligned(one, other, shift) for shift in {0.0, float(other.time[0] - one.time[0])}]
    return max((share for share in shares if share is not None), default=None)


def _aligned(one: VehiclePositions, other: VehiclePositions, shift: float) -> float | None:
    """Return the share if the time of the first run is shifted by some seconds."""
    wanted = one.time + shift
    after = np.clip(np.searchsorted(other.time, wanted - _SAME_TIME), 0, len(other.time) - 1)
    both = np.flatnonzero(np.abs(other.time[after] - wanted) <= _SAME_TIME)
    if not len(both):
        return None
    close = np.zeros(2)
    there = np.zeros(2)
    for here, then in zip(both.tolist(), after[both].tolist(), strict=True):
        pair = one.xy[here], other.xy[then]
        there += [len(xy) for xy in pair]
        if all(len(xy) for xy in pair):
            close += [_near(*pair), _near(*pair[::-1])]
    return float(np.max(close / np.maximum(there, 1)))


def _near(xy: Float, others: Float) -> int:
    """Return the number of points (n, 2) that have one of others (k, 2) nearby."""
    nearby = shapely.STRtree(shapely.points(others)).query(
        shapely.points(xy), predicate="dwithin", distance=MATCH_RADIUS
    )
    return len(np.unique(nearby[0]))


def require_independent(pairs: Iterable[tuple[VehiclePositions, VehiclePositions]]) -> str:
    """Return a message on the largest overlap of the runs of a pair.

    Raises
    ------
    SeipError
        A pair overlaps by more than `MAX_OVERLAP`.
    """
    known = [(0.0, "none")]
    for one, other in pairs:
        share = overlap_of(one, other)
        if share is not None and share > MAX_OVERLAP:
            raise SeipError(
                f"{one.name} and {other.name} are nearly the same traffic: {share:.0%} of the vehicles of one are "
                f"within {MATCH_RADIUS:g} m of one of the other at the same instant, and independent runs must be "
                f"below {MAX_OVERLAP:.0%}: use runs that were simulated with different demand and different seeds"
            )
        known += [] if share is None else [(share, f"{one.name} and {other.name}")]
    most, names = max(known)
    return (
        f"runs of traffic are independent (below {MAX_OVERLAP:.0%}): at most {most:.0%} of the vehicles of one run are "
        f"within {MATCH_RADIUS:g} m of one of another at the same instant ({names})"
    )
