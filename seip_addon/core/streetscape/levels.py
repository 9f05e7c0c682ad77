"""Grade separation: the roads on the studied level of a place, from their connections and heights."""

import math
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..arrays import Float
from ..errors import SeipError
from ..opendrive import LaneSurface
from .road_surface import MAX_SEAM, by_road, group, is_near
from .terrain import Terrain

MAX_JOINT_STEP = 1.0  # roads that meet within so many metres of height lead into each other
MIN_LEVEL_HEIGHT = 2.0  # a road that lies more than this (metres) above another one crosses it on a level of its own
MIN_OVERLAP = 1.0  # square metres in plan: roads that overlap less do not cross


@dataclass(frozen=True, eq=False)
class Crossing:
    """A road above another one, and where, in map coordinates."""

    above: str
    below: str
    height: float
    place: tuple[float, float]

    def __str__(self) -> str:
        x, y = (round(value) + 0 for value in self.place)
        return f"road {self.above} lies {self.height:.1f} m above road {self.below} at ({x}, {y})"


@dataclass(frozen=True, eq=False)
class Levels:
    """The lanes of a place on the level that is studied, and on others.

    Parameters
    ----------
    studied, others : tuple of LaneSurface
        In map coordinates.
    crossings : tuple of Crossing
        Why there are others.
    """

    studied: tuple[LaneSurface, ...]
    others: tuple[LaneSurface, ...]
    crossings: tuple[Crossing, ...]

    def other_roads(self) -> frozenset[str]:
        """Return the ids of the roads on other levels."""
        return frozenset(lane.road_id for lane in self.others)


def split_levels(
    surfaces: Sequence[LaneSurface], around: BaseGeometry, anchors: Iterable[str], level: Sequence[str] = ()
) -> Levels:
    """Divide lanes into those on the level of a place and those that cross above or below.

    Of two crossing roads the one that is fewer joints away from the anchors in the graph of roads is on the studied
    level. Each other road takes the level of the crossing road that is fewer joints away; ties are decided by height.

    Parameters
    ----------
    surfaces : sequence of LaneSurface
        All lanes of the map, map coordinates.
    around : shapely geometry
        The place, map coordinates. What lies beyond it counts as studied.
    anchors : iterable of str
        Ids of the roads in the middle of the place.
    level : sequence of str
        Ids of roads that are on the level, in place of the anchors.

    Raises
    ------
    SeipError
        Roads cross and neither is nearer to the place (both are named), or a road of ``level`` is not here.
    """
    shapely.prepare(around)
    near = [lane for lane in surfaces if group(lane) and is_near(lane, around)]
    roads = _roads(near, around)
    for road in level:
        if road not in roads:
            raise SeipError(f"no road {road!r} at this place: the level is named by the id of a road that lies on it")
    crossings = _crossings(roads) if roads else ()
    if not crossings:
        return Levels(tuple(surfaces), (), ())
    joined = _joined(roads)
    start = set(level or anchors) & roads.keys()
    others = _roads_farther_off(crossings, joined, start)
    winners = {road for crossing in crossings for road in (crossing.above, crossing.below)} | start
    to_level, to_others = _hops(joined, winners - others), _hops(joined, others)
    even = {road for road in roads if to_others[road] == to_level[road] < math.inf}
    others |= {road for road in roads if to_others[road] < to_level[road]}
    others |= {road for road in even - start if _lies_with_others(roads[road], roads, crossings, others)}
    apart = {road for road in roads if to_others[road] == to_level[road] == math.inf}
    others |= {road for road in sorted(apart) if _next_to(road, roads, roads.keys() - apart) in others}
    for crossing in crossings:
        if not {crossing.above, crossing.below} & others:
            raise _ambiguous(crossing)
    away = {id(lane) for lane in near if lane.road_id in others}
    return Levels(
        tuple(lane for lane in surfaces if id(lane) not in away),
        tuple(lane for lane in near if lane.road_id in others),
        crossings,
    )


@dataclass(frozen=True, eq=False)
class _RoadArea:
    """A road within the place: its outline in plan and its heights, (low, high) and everywhere."""

    outline: BaseGeometry
    heights: tuple[float, float]
    terrain: Terrain

    @property
    def middle(self) -> float:
        """Half-way between the lowest and the highest place, metres."""
        return sum(self.heights) / 2


def _roads(lanes: Sequence[LaneSurface], around: BaseGeometry) -> dict[str, _RoadArea]:
    roads = {}
    for road, own in by_road(lanes).items():
        outline = shapely.union_all([shapely.make_valid(lane.polygon) for lane in own]).intersection(around)
        if outline.area > 0:
            triangles = np.concatenate([lane.triangles for lane in own])
            heights = (float(triangles[:, :, 2].min()), float(triangles[:, :, 2].max()))
            roads[road] = _RoadArea(outline, heights, Terrain(triangles))
    return roads


def _pairs(roads: Mapping[str, _RoadArea], distance: float) -> list[tuple[str, str]]:
    """Return the pairs of roads that come so near to each other in plan, metres."""
    names = list(roads)
    outlines = [roads[name].outline for name in names]
    first, second = shapely.STRtree(outlines).query(outlines, predicate="dwithin", distance=distance)
    return [(names[a], names[b]) for a, b in zip(first.tolist(), second.tolist(), strict=True) if a < b]


def _crossings(roads: Mapping[str, _RoadArea]) -> tuple[Crossing, ...]:
    """Return where roads lie above each other, the greatest overlap of each two."""
    found = []
    for one, other in _pairs(roads, 0.0):
        first, second = roads[one], roads[other]
        if max(first.heights[1] - second.heights[0], second.heights[1] - first.heights[0]) < MIN_LEVEL_HEIGHT:
            continue
        for part in shapely.get_parts(first.outline.intersection(second.outline)):
            if part.area < MIN_OVERLAP:
                continue
            points = _points_in(part)
            rise = first.terrain.height(points) - second.terrain.height(points)
            if np.abs(rise).min() > MIN_LEVEL_HEIGHT:
                above, below = (one, other) if rise[0] > 0 else (other, one)
                x, y = part.centroid.coords[0]
                found.append(Crossing(above, below, float(np.abs(rise).min()), (x, y)))
    return tuple(sorted(found, key=lambda one: (one.above, one.below, one.place)))


def _joined(roads: Mapping[str, _RoadArea]) -> dict[str, set[str]]:
    """Return for each road those that meet it in plan and in height."""
    joined: dict[str, set[str]] = {road: set() for road in roads}
    for one, other in _pairs(roads, MAX_SEAM):
        first, second = roads[one], roads[other]
        common = first.outline.buffer(MAX_SEAM).intersection(second.outline.buffer(MAX_SEAM))
        points = np.concatenate([np.empty((0, 2)), *map(_points_in, shapely.get_parts(common))])
        rise = np.abs(first.terrain.height(points) - second.terrain.height(points))
        if rise.min(initial=math.inf) < MAX_JOINT_STEP:
            joined[one].add(other)
            joined[other].add(one)
    return joined


def _points_in(part: BaseGeometry) -> Float:
    """Return points (n, 2) of a polygon: one in it, and its corners."""
    return np.concatenate([shapely.get_coordinates(part.representative_point()), shapely.get_coordinates(part)])


def _hops(joined: Mapping[str, set[str]], start: Iterable[str]) -> dict[str, float]:
    """Return over how many joints each road is reached; infinity where it is not."""
    hops = dict.fromkeys(joined, math.inf)
    waiting = deque(start)
    hops.update(dict.fromkeys(waiting, 0.0))
    while waiting:
        road = waiting.popleft()
        for following in sorted(joined[road]):
            if hops[following] == math.inf:
                hops[following] = hops[road] + 1
                waiting.append(following)
    return hops


def _lies_with_others(
    plan: _RoadArea, roads: Mapping[str, _RoadArea], crossings: Iterable[Crossing], others: set[str]
) -> bool:
    """Return whether a road lies nearer in height to the other road of the nearest crossing than to the studied one."""
    crossing = min(crossings, key=lambda one: float(plan.outline.distance(shapely.Point(one.place))))
    away = {road: abs(roads[road].middle - plan.middle) for road in (crossing.above, crossing.below)}
    return min(away, key=lambda road: away[road]) in others


def _next_to(road: str, roads: Mapping[str, _RoadArea], reached: Iterable[str]) -> str:
    """Return the nearest road at about the height of one that is joined to none here; empty where there is none."""
    own = roads[road]
    for other in sorted(reached, key=lambda name: (float(own.outline.distance(roads[name].outline)), name)):
        ends = shapely.get_coordinates(shapely.shortest_line(own.outline, roads[other].outline))
        rise = own.terrain.height(ends[:1]) - roads[other].terrain.height(ends[1:])
        if abs(float(rise[0])) < MIN_LEVEL_HEIGHT:
            return other
    return ""


def _roads_farther_off(crossings: Iterable[Crossing], joined: Mapping[str, set[str]], start: set[str]) -> set[str]:
    """Return of each two roads that cross the one that more joints part from the place."""
    hops = _hops(joined, start)
    losers = set()
    for crossing in crossings:
        above, below = hops[crossing.above], hops[crossing.below]
        if above == below:
            raise _ambiguous(crossing)
        losers.add(crossing.above if above > below else crossing.below)
    return losers


def _ambiguous(crossing: Crossing) -> SeipError:
    return SeipError(
        f"{crossing}, and a scene has one level: choose it by a road that lies on it, "
        f"--level {crossing.above} or --level {crossing.below}"
    )
