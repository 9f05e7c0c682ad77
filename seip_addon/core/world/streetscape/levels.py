"""Grade separation: the roads on the studied level of a place, from their connections and heights."""

import heapq
import math
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...base.errors import SeipError
from ..opendrive.lanes import LaneSurface
from .road_surface import MAX_SEAM, by_road, group, is_near
from .terrain import Terrain

MAX_JOINT_STEP = 1.0  # metres of height within which roads that meet lead into each other
MIN_LEVEL_HEIGHT = 2.0  # metres: a road more than this above another one crosses it on a different level
MIN_LEAD = 10.0  # metres along the roads by which one of two roads that cross is the nearer one
UNNAMED_ROAD = "a street without a name"
MIN_OVERLAP = 1.0  # square metres in plan: roads that overlap less do not cross


class UnclearLevelError(SeipError):
    """Error: roads cross in the middle of a place, and it is unclear which one to study."""


@dataclass(frozen=True, eq=False)
class Crossing:
    """A road above another one, in map coordinates.

    Parameters
    ----------
    above, below : str
        Ids of the roads.
    height : float, metres
        Difference of their heights.
    place : (x, y), metres
        Middle of their overlap.
    streets : (str, str)
        Names of the streets above and below, or "".
    """

    above: str
    below: str
    height: float
    place: tuple[float, float]
    streets: tuple[str, str] = ("", "")

    @property
    def levels(self) -> tuple[str, str]:
        """Names of the upper and the lower level: streets if these differ, otherwise roads."""
        upper, lower = (name or road for name, road in zip(self.streets, (self.above, self.below), strict=True))
        return (self.above, self.below) if upper.casefold() == lower.casefold() else (upper, lower)

    def called(self, road: str) -> str:
        """Return the name of one of the two roads in messages: that of its street if the map has names."""
        name, other = self.streets if road == self.above else self.streets[::-1]
        if not name:
            return UNNAMED_ROAD if other else f"road {road}"
        return name if name.casefold() != other.casefold() else f"{name} (road {road})"

    def __str__(self) -> str:
        x, y = (round(value) + 0 for value in self.place)
        return f"{self.called(self.above)} lies {self.height:.1f} m above {self.called(self.below)} at ({x}, {y})"


@dataclass(frozen=True, eq=False)
class Levels:
    """Lanes of a place on the studied level and on other levels.

    Parameters
    ----------
    studied, others : tuple of LaneSurface
        Lanes in map coordinates.
    crossings : tuple of Crossing
        Crossings that separate the levels.
    """

    studied: tuple[LaneSurface, ...]
    others: tuple[LaneSurface, ...]
    crossings: tuple[Crossing, ...]

    def other_roads(self) -> frozenset[str]:
        """Return the ids of the roads on other levels."""
        return frozenset(lane.road_id for lane in self.others)


def split_levels(
    surfaces: Sequence[LaneSurface],
    around: BaseGeometry,
    anchors: Iterable[str],
    level: Sequence[str] = (),
    names: Mapping[str, str] | None = None,
) -> Levels:
    """Divide lanes into those on the level of a place and those that cross above or below.

    Of two crossing roads, the one that is nearer to the anchors along the roads is on the studied level. Each remaining
    road takes the level of the crossing road that is nearer along the roads. A road that shares its surface with a
    studied one is studied too, as where a street that leads to the other level branches off.

    Parameters
    ----------
    surfaces : sequence of LaneSurface
        All lanes of the map, map coordinates.
    around : shapely geometry
        Area of the place, map coordinates. Lanes beyond it count as studied.
    anchors : iterable of str
        Ids of the roads in the middle of the place.
    level : sequence of str
        Streets on the studied level, instead of the anchors: their names, or ids of roads.
    names : mapping of str to str, optional
        Names of the streets by the ids of their roads.

    Raises
    ------
    UnclearLevelError
        Roads cross and neither is nearer to the place (both are named).
    SeipError
        A road of ``level`` is not at the place.
    """
    shapely.prepare(around)
    near = [lane for lane in surfaces if group(lane) and is_near(lane, around)]
    roads = _roads(near, around)
    names = names or {}
    on_level = _on_level(level, roads, names)
    crossings = _crossings(roads, names) if roads else ()
    if not crossings:
        return Levels(tuple(surfaces), (), ())
    # The graph of roads that lead into each other. Only one road of each crossing can be on the studied level; the
    # other one seeds the other levels, and the rest of the graph follows the nearer seed.
    joined = _joined(roads)
    start = (on_level or set(anchors)) & roads.keys()
    others = _roads_farther_off(crossings, _away(joined, roads, start))
    winners = {road for crossing in crossings for road in (crossing.above, crossing.below)} | start
    to_level, to_others = _away(joined, roads, winners - others), _away(joined, roads, others)
    others |= {road for road in roads if to_others[road] < to_level[road]}
    # Roads that no joint connects with a crossing within this area take the level of the nearest road of their height.
    apart = {road for road in roads if to_others[road] == to_level[road] == math.inf}
    others |= {road for road in sorted(apart) if _next_to(road, roads, roads.keys() - apart) in others}
    for crossing in crossings:
        # Both roads of a crossing would be studied, as where a loop connects them: one level cannot hold both.
        if not {crossing.above, crossing.below} & others:
            raise _ambiguous(crossing)
    # Where a ramp branches off, its first metres are the surface of the studied street. Leaving them out would cut a
    # hole into that street.
    others -= _on_studied_surface(roads, others - winners, roads.keys() - others)
    away = {id(lane) for lane in near if lane.road_id in others}
    return Levels(
        tuple(lane for lane in surfaces if id(lane) not in away),
        tuple(lane for lane in near if lane.road_id in others),
        crossings,
    )


def _on_level(level: Sequence[str], roads: Mapping[str, object], names: Mapping[str, str]) -> set[str]:
    """Return the ids of the roads here that have given ids or street names."""
    found = set()
    for given in level:
        named = {road for road in roads if names.get(road, "").casefold() == given.strip().casefold()}
        if given not in roads and not named:
            known = ", ".join(sorted({names[road] for road in roads if names.get(road)}))
            raise SeipError(
                f"no road {given!r} at this place: name a street that lies on the level{known and ': '}{known}"
            )
        found |= {given} if given in roads else named
    return found


@dataclass(frozen=True, eq=False)
class _RoadArea:
    """Outline in plan of a road within the place, its lowest and highest height, and its surface."""

    outline: BaseGeometry
    heights: tuple[float, float]
    terrain: Terrain


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
    """Return the pairs of roads within `distance` metres of each other in plan."""
    if not roads:
        return []  # the tree takes no query without geometries
    names = list(roads)
    outlines = [roads[name].outline for name in names]
    first, second = shapely.STRtree(outlines).query(outlines, predicate="dwithin", distance=distance)
    # The query returns every pair in both orders, and each road with itself.
    return [(names[a], names[b]) for a, b in zip(first.tolist(), second.tolist(), strict=True) if a < b]


def _crossings(roads: Mapping[str, _RoadArea], names: Mapping[str, str]) -> tuple[Crossing, ...]:
    """Return all places where one road lies above another one."""
    found = []
    for one, other in _pairs(roads, 0.0):
        first, second = roads[one], roads[other]
        # Heights that cannot differ enough anywhere need no intersection of outlines.
        if max(first.heights[1] - second.heights[0], second.heights[1] - first.heights[0]) < MIN_LEVEL_HEIGHT:
            continue
        for part in shapely.get_parts(first.outline.intersection(second.outline)):
            if part.area < MIN_OVERLAP:
                continue
            points = _points_in(part)
            # One road must be above the other over the whole overlap. Where a ramp leaves a street, the overlap begins
            # at no difference in height, and the two do not cross.
            rise = first.terrain.height(points) - second.terrain.height(points)
            if np.abs(rise).min() > MIN_LEVEL_HEIGHT:
                above, below = (one, other) if rise[0] > 0 else (other, one)
                x, y = part.centroid.coords[0]
                streets = (names.get(above, ""), names.get(below, ""))
                found.append(Crossing(above, below, float(np.abs(rise).min()), (x, y), streets))
    return tuple(sorted(found, key=lambda one: (one.above, one.below, one.place)))


def _joined(roads: Mapping[str, _RoadArea]) -> dict[str, set[str]]:
    """Return the neighbours of each road: those that touch it in plan at the same height."""
    joined: dict[str, set[str]] = {road: set() for road in roads}
    for one, other in _pairs(roads, MAX_SEAM):
        first, second = roads[one], roads[other]
        common = first.outline.buffer(MAX_SEAM).intersection(second.outline.buffer(MAX_SEAM))
        points = np.concatenate([np.empty((0, 2)), *map(_points_in, shapely.get_parts(common))])
        # One point of equal height is enough: a ramp has it only where it begins.
        rise = np.abs(first.terrain.height(points) - second.terrain.height(points))
        if rise.min(initial=math.inf) < MAX_JOINT_STEP:
            joined[one].add(other)
            joined[other].add(one)
    return joined


def _points_in(part: BaseGeometry) -> Float:
    """Return points (n, 2) of a polygon: one in it, and its corners."""
    return np.concatenate([shapely.get_coordinates(part.representative_point()), shapely.get_coordinates(part)])


def _on_studied_surface(roads: Mapping[str, _RoadArea], others: set[str], studied: Iterable[str]) -> set[str]:
    """Return the other roads that share the surface of a studied one, if neither climbs to a different level."""
    level = {road for road, own in roads.items() if own.heights[1] - own.heights[0] < MIN_LEVEL_HEIGHT}
    others, known = others & level, level.intersection(studied)
    pairs = _pairs({road: own for road, own in roads.items() if road in others | known}, 0.0)
    return {
        road
        for pair in pairs
        for road, other in (pair, pair[::-1])
        if road in others and other in known and _share_surface(roads[road], roads[other])
    }


def _share_surface(one: _RoadArea, other: _RoadArea) -> bool:
    """Return whether roads overlap, with a height difference below `MAX_JOINT_STEP` everywhere."""
    parts = shapely.get_parts(one.outline.intersection(other.outline))
    points = [_points_in(part) for part in parts if part.area >= MIN_OVERLAP]
    return bool(points) and all(
        np.abs(one.terrain.height(each) - other.terrain.height(each)).max() < MAX_JOINT_STEP for each in points
    )


def _next_to(road: str, roads: Mapping[str, _RoadArea], reached: Iterable[str]) -> str:
    """Return the nearest reached road at about the height of a road without joints; "" if there is none."""
    own = roads[road]
    for other in sorted(reached, key=lambda name: (float(own.outline.distance(roads[name].outline)), name)):
        ends = shapely.get_coordinates(shapely.shortest_line(own.outline, roads[other].outline))
        rise = own.terrain.height(ends[:1]) - roads[other].terrain.height(ends[1:])
        if abs(float(rise[0])) < MIN_LEVEL_HEIGHT:
            return other
    return ""


def _roads_farther_off(crossings: Iterable[Crossing], away: Mapping[str, float]) -> set[str]:
    """Return the road of each crossing that is farther from the place, from the distances of roads in metres.

    Crossings without a joint to either road are skipped: their level follows from the roads next to them.
    """
    losers = set()
    for crossing in crossings:
        above, below = away[crossing.above], away[crossing.below]
        if above == below == math.inf:
            continue
        if abs(above - below) < MIN_LEAD:
            raise _ambiguous(crossing)
        losers.add(crossing.above if above > below else crossing.below)
    return losers


def _away(joined: Mapping[str, set[str]], roads: Mapping[str, _RoadArea], start: Iterable[str]) -> dict[str, float]:
    """Return the distance of each road from the start along the roads between, metres; infinity without a path."""
    away = dict.fromkeys(joined, math.inf)
    waiting = [(0.0, road) for road in sorted(start)]
    away.update({road: 0.0 for _, road in waiting})
    while waiting:
        travelled, road = heapq.heappop(waiting)
        if travelled > away[road]:
            continue
        # Dijkstra's algorithm. Half the perimeter of a long, narrow outline is about the length of the road.
        onwards = travelled + float(roads[road].outline.length) / 2
        for following in sorted(joined[road]):
            if onwards < away[following]:
                away[following] = onwards
                heapq.heappush(waiting, (onwards, following))
    return away


def _ambiguous(crossing: Crossing) -> UnclearLevelError:
    upper, lower = map(shlex.quote, crossing.levels)
    return UnclearLevelError(
        f"{crossing}, and a scene has one level: choose it by a road that lies on it (level {upper} or level {lower})"
    )
