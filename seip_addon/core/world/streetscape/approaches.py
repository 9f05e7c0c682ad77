"""Approaches of a junction: its streets up to a distance along the roads."""

import heapq
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ..opendrive.lanes import LaneSurface
from .road_surface import by_road, cut_along, in_groups

JOINT_GAP, MIN_JOINT = 0.3, 0.5  # metres: gap between ends of roads that are joined, and width along which they meet
MIN_HEIGHT_STEP = 1.0  # metres of height between ends that are not joined
MAX_STRAIGHT_TURN = math.radians(35.0)  # an approach continues through other junctions on lanes that turn by less
Key = tuple[str, int]  # a road and one of its ends: 0 where it starts, 1 where it stops


@dataclass(frozen=True, eq=False)
class _End:
    """End of a road's driving lanes: lines across them, their height, and the direction along the road (2,)."""

    across: BaseGeometry
    height: float
    along: Float


@dataclass(frozen=True, eq=False)
class _ApproachRoad:
    """Driving lanes of a road: range of s, ends, turn between them (radians), whether an approach can follow it."""

    start: float
    stop: float
    ends: tuple[_End, _End]
    turn: float
    leads_on: bool


def approach_lanes(
    surfaces: Sequence[LaneSurface],
    junctions: Collection[str],
    distance: float,
    names: Mapping[str, str] | None = None,
) -> tuple[LaneSurface, ...]:
    """Return the driving lanes of junctions that form one place, and of their approaches up to a distance.

    An approach continues over the roads joined to it, and straight through other junctions. There it enters every road
    that turns little; if names are given, only the road in which the street continues.

    Parameters
    ----------
    surfaces : sequence of LaneSurface
        All lanes of a map.
    junctions : collection of str
        Ids of the junctions.
    distance : float, metres
        Length of the approaches along the roads, from the end of the junction.
    names : mapping of str to str, optional
        Names of the streets by the ids of their roads.

    Returns
    -------
    tuple of LaneSurface
        Lanes, cut at the distance.
    """
    driving = in_groups(surfaces, ["driving"])
    roads = by_road(driving)
    inside = {lane.road_id for lane in driving if lane.junction_id in junctions}
    if not inside:
        return ()
    streets = {road: _street(lanes) for road, lanes in roads.items()}
    joints = _joints(streets)
    closed = frozenset[Key]() if names is None else _side_ways(roads, streets, joints, names)
    away = _distances(streets, joints, inside, closed, distance)
    return tuple(
        piece
        for road, street in streets.items()
        if road in inside or street.leads_on
        for lane in roads[road]
        for piece in _pieces(lane, street, [away[road, 0], away[road, 1]], distance)
    )


def _street(lanes: Sequence[LaneSurface]) -> _ApproachRoad:
    start, stop = min(lane.s[0] for lane in lanes), max(lane.s[-1] for lane in lanes)
    first = _end([(lane, 0) for lane in lanes if lane.s[0] == start])
    last = _end([(lane, -1) for lane in lanes if lane.s[-1] == stop])
    turn = math.acos(float(np.clip(first.along @ last.along, -1.0, 1.0)))
    return _ApproachRoad(start, stop, (first, last), turn, lanes[0].junction_id is None or turn < MAX_STRAIGHT_TURN)


def _end(rows: Sequence[tuple[LaneSurface, int]]) -> _End:
    across = np.array([(lane.left[row], lane.right[row]) for lane, row in rows])
    lane, row = rows[0]
    way = (lane.left[1] - lane.left[0] if row == 0 else lane.left[-1] - lane.left[-2])[:2]
    length = float(np.hypot(*way))
    along = way / length if length > 0 else np.array([1.0, 0.0])
    return _End(shapely.multilinestrings(across[:, :, :2]), float(across[:, :, 2].mean()), along)


def _joints(streets: Mapping[str, _ApproachRoad]) -> dict[Key, list[Key]]:
    """Return the ends that each end of a road leads into."""
    keys = [(road, which) for road in streets for which in (0, 1)]
    ends = [streets[road].ends[which] for road, which in keys]
    lines = [end.across for end in ends]
    joints: dict[Key, list[Key]] = {key: [] for key in keys}
    for a, b in shapely.STRtree(lines).query(lines, predicate="dwithin", distance=JOINT_GAP).T.tolist():
        # Ends that only touch at a corner are neighbouring lanes, and ends at different heights cross on a bridge.
        level = abs(ends[a].height - ends[b].height) < MIN_HEIGHT_STEP
        if a != b and level and lines[a].buffer(JOINT_GAP, cap_style="flat").intersection(lines[b]).length > MIN_JOINT:
            joints[keys[a]].append(keys[b])
    return joints


def _side_ways(
    roads: Mapping[str, Sequence[LaneSurface]],
    streets: Mapping[str, _ApproachRoad],
    joints: Mapping[Key, Sequence[Key]],
    names: Mapping[str, str],
) -> frozenset[Key]:
    """Return the ends of roads in junctions where a street does not continue, because it continues in another road.

    A street continues in the road of the same name; among several, in the one that turns least.
    """
    ways: dict[Key, list[tuple[tuple[bool, float], frozenset[str], Key]]] = {}
    for road, street in streets.items():
        if roads[road][0].junction_id is not None and street.leads_on:
            for which in (0, 1):
                leads_to = frozenset(other for other, _ in joints[road, 1 - which] if _is_street(roads[other]))
                for key in joints[road, which]:
                    if _is_street(roads[key[0]]) and leads_to:
                        own = names.get(key[0], "")
                        other_name = not own or all(names.get(other) != own for other in leads_to)
                        ways.setdefault(key, []).append(((other_name, street.turn), leads_to, (road, which)))
    # Lanes that lead into the same road as the best one stay open: they are parallel lanes of the same connection.
    closed: set[Key] = set()
    for found in ways.values():
        _, best, _ = min(found, key=lambda way: way[0])
        closed.update(key for _, leads_to, key in found if leads_to.isdisjoint(best))
    return frozenset(closed)


def _is_street(lanes: Sequence[LaneSurface]) -> bool:
    return lanes[0].junction_id is None


def _distances(
    streets: Mapping[str, _ApproachRoad],
    joints: Mapping[Key, Sequence[Key]],
    inside: set[str],
    closed: Collection[Key],
    most: float,
) -> dict[Key, float]:
    """Return the distance of each road end from a junction along the roads, metres; infinity beyond ``most``."""
    away = {(road, which): math.inf for road in streets for which in (0, 1)}
    waiting = [(0.0, (road, which)) for road in inside for which in (0, 1)]
    away.update({key: 0.0 for _, key in waiting})
    while waiting:
        travelled, key = heapq.heappop(waiting)
        road, which = key
        if travelled > away[key]:
            continue
        # Dijkstra's algorithm over road ends: joints cost nothing, the way along a road costs its length. Roads within
        # the starting junctions are at distance zero at both ends, and roads that turn are not followed.
        steps = [(travelled, other) for other in joints[key] if other not in closed]
        if road not in inside and streets[road].leads_on:
            steps.append((travelled + streets[road].stop - streets[road].start, (road, 1 - which)))
        for total, other in steps:
            if total < away[other] and total <= most:
                away[other] = total
                heapq.heappush(waiting, (total, other))
    return away


def _pieces(lane: LaneSurface, street: _ApproachRoad, away: Sequence[float], distance: float) -> Iterator[LaneSurface]:
    """Yield the parts of a lane within the distance of the junction, measured from both ends of its road."""
    from_start, from_stop = street.start + distance - away[0], street.stop - distance + away[1]
    # A road may be reached from both ends. The reached parts overlap, and the whole lane remains, or leave a gap.
    ranges = [(-math.inf, math.inf)] if from_start >= from_stop else [(-math.inf, from_start), (from_stop, math.inf)]
    for low, high in ranges:
        piece = cut_along(lane, max(low, lane.s[0]), min(high, lane.s[-1]))
        if piece is not None:
            yield piece
