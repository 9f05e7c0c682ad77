"""Removal of overlapping road users from simulated traffic."""

from collections.abc import Generator

import numpy as np
import shapely

from ...base.arrays import Float, Integer
from ...base.progress import Progress
from .trajectories import Snapshot, Trajectories, some_users

MIN_OVERLAP = 0.02  # square metres; smaller overlaps of two footprints are only contact


def footprints(trajectories: Trajectories, snapshot: Snapshot) -> Float:
    """Return the corners (k, 4, 2) in plan of an instant's road users, counter-clockwise from the front left."""
    half = np.array([(user.length / 2.0, user.width / 2.0) for user in trajectories.users])[snapshot.user]
    heading = np.stack([np.cos(snapshot.yaw), np.sin(snapshot.yaw)], axis=1)
    ahead = heading * half[:, :1]
    left = np.stack([-heading[:, 1], heading[:, 0]], axis=1) * half[:, 1:]
    corners: Float = snapshot.position[:, None, :2] + np.stack(
        [ahead + left, left - ahead, -ahead - left, ahead - left], axis=1
    )
    return corners


def find_overlaps(trajectories: Trajectories, interval: float = 0.2) -> Generator[Progress, None, Integer]:
    """Find road users that overlap, at instants ``interval`` seconds apart.

    Returns
    -------
    (k, 2) int64
        Pairs of indices of road users, in ascending order, the smaller index first.
    """
    begin, end = trajectories.span
    instants = np.arange(begin, end + interval / 2.0, interval)
    pairs = np.zeros((0, 2), dtype=np.int64)
    for done, time in enumerate(instants.tolist()):
        snapshot = trajectories.at(time)
        polygons = shapely.polygons(footprints(trajectories, snapshot))
        one, other = shapely.STRtree(polygons).query(polygons, predicate="intersects")
        one, other = one[one < other], other[one < other]
        deep = shapely.area(shapely.intersection(polygons[one], polygons[other])) > MIN_OVERLAP
        pairs = np.unique(np.concatenate([pairs, snapshot.user[np.stack([one, other], axis=1)][deep]]), axis=0)
        yield Progress(done + 1, len(instants), "looking for collisions")
    return pairs


def without_overlaps(trajectories: Trajectories) -> Generator[Progress, None, tuple[Trajectories, tuple[str, ...]]]:
    """Remove road users until no two overlap, each time the one with most overlaps, and among these the shortest stay.

    Returns
    -------
    trajectories : Trajectories
        Trajectories of the others.
    names : tuple of str
        Names of the road users removed.
    """
    pairs = yield from find_overlaps(trajectories)
    stay = np.diff(trajectories.first)
    gone: list[int] = []
    while len(pairs):
        user, others = np.unique(pairs, return_counts=True)
        gone.append(int(user[np.lexsort((user, stay[user], -others))[0]]))
        pairs = pairs[(pairs != gone[-1]).all(axis=1)]
    names = tuple(trajectories.users[number].name for number in sorted(gone))
    kept = np.ones(len(trajectories), dtype=np.bool_)
    kept[gone] = False
    return some_users(trajectories, kept), names
