"""Heights of the streets of an extract: on the ground, on bridges with their ramps, and in underpasses.

OpenStreetMap contains which street leads over which, but not how high. Each street on a bridge is raised by the
clearance that it needs over the way below; the streets next to it lead up to it at a realistic grade, and are raised no
more than necessary. With grades as limits between neighbouring places of the ways, and clearances at crossings, these
are the smallest heights ``h ≥ ground`` that satisfy

    |h[u] − h[v]| ≤ grade · distance(u, v)    for places u, v next to each other
    h[u] ≥ h[v] + rise                        where the street at u crosses above the one at v

The smallest solution is a longest path from the ground (a system of difference constraints): raise each crossing in
turn and propagate its height over the streets as in Dijkstra's algorithm, highest first. Each round settles one more
crossing of the path, so that more rounds than crossings mean that there is no solution. Underpasses are solved first,
with all heights negated.
"""

import heapq
import itertools
import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float, Integer
from ...geometry.plan import beside, travelled
from ..opendrive.road_map import Road, RoadMap
from ..streetscape.street_map import Profiles
from .bridges import Crossing, corridors, half_width
from .plan_shapes import PlanShapes
from .streets import StreetFile, is_link, joined, way_id

STEP = 5.0  # metres along a street between places whose heights are computed, at most
GRADE, LINK_GRADE = 0.06, 0.08
"""Steepest grades of streets, and of slip roads and ramps, where the ground is not steeper."""
MAX_RISE = 30.0  # metres that a street lies above or below the ground at most
SAME_SURFACE = 3.0  # metres between places of streets whose lanes lie on each other
PARALLEL = math.radians(35.0)  # largest angle between a street and the one that continues it
BANK = 8.0  # metres beyond the end of a bridge, where smoothed ground is as high as the bank that carries it
_TOLERANCE = 1e-6  # metres


@dataclass(frozen=True, eq=False)
class StreetHeights:
    """Heights along the roads of a map.

    Parameters
    ----------
    above_ground : Profiles
        Heights of all roads above the ground of the map; on bridges above the straight line between their ends.
    profiles : Profiles
        Heights of all roads with the ground added.
    bridges : frozenset of str
        Ids of the roads on bridges.
    notes : tuple of str
        Crossings that could not be separated.
    """

    above_ground: Profiles
    profiles: Profiles
    bridges: frozenset[str]
    notes: tuple[str, ...]


Ground = Callable[[Float], Float]
"""Heights (n,) of the ground at places (n, 2) of a map, metres."""


def street_heights(
    road_map: RoadMap, streets: StreetFile, shapes: PlanShapes, ground: Ground | None = None
) -> StreetHeights:
    """Return the heights of streets on the ground, with bridges and underpasses where they cross.

    The heights of an extract that has some are those of its bridges, too.

    Parameters
    ----------
    road_map : RoadMap
        Map made by netconvert. The id of a road is that of its way, with a minus sign if it leads the opposite way.
    streets : StreetFile
        Streets with their bridges and underpasses.
    shapes : PlanShapes
        Shapes of the extract in map coordinates.
    ground : callable, optional
        Height of the ground above the heights of the map; zero by default.
    """
    crossings = () if streets.elevated else streets.structures.crossings
    if not crossings and ground is None:
        return StreetHeights({}, {}, frozenset(), ())
    graph = _Graph(streets, shapes, ground or (lambda xy: np.zeros(len(xy))))
    graph.limit_turns(road_map)
    heights, flat = _separated(graph, list(_crossing_places(graph, crossings, shapes)))
    above = _above_ground(graph, road_map, heights)
    bridges = frozenset(road.id for road in road_map.roads if way_id(road.id) in streets.structures.bridges)
    profiles = {}
    for road in road_map.roads:
        along, height = above[road.id]
        rise = graph.ground(_places(road, along))
        rise = np.linspace(rise[0], rise[-1], len(rise)) if road.id in bridges else rise
        profiles[road.id] = along, height + rise
    return StreetHeights(above, profiles, bridges, tuple(_flat_notes(flat)))


class _Graph:
    """Places along the ways of streets, with the largest difference in height between neighbouring places.

    Places at the nodes of the extract are shared by the ways that meet there.
    """

    def __init__(self, streets: StreetFile, shapes: PlanShapes, ground: Ground) -> None:
        self.streets, self.ground, self.continued = streets, ground, _continued(streets)
        self.nodes: dict[int, Integer] = {}
        """Places of each way, in its order."""
        points: list[Float] = []
        known: dict[int, int] = {}

        def place(point: Float) -> int:
            points.append(point)
            return len(points) - 1

        for number, way in streets.ways.items():
            at: list[int] = []
            for node in way.nodes:
                if node not in known:
                    known[node] = place(shapes.point(shapes.extract.nodes[node]))
                if at:
                    start, stop = points[at[-1]], points[known[node]]
                    between = max(math.ceil(float(np.hypot(*(stop - start))) / STEP), 1)
                    at += [place(start + share * (stop - start)) for share in np.arange(1, between) / between]
                at.append(known[node])
            self.nodes[number] = np.array(at)
        self.xy = np.array(points).reshape(-1, 2)
        # Heights of the ground, straight between the ends of bridges, and of bridges between their banks, metres. Under
        # a bridge the ground drops to a valley, water or another street.
        self.start, self.banks = ground(self.xy), np.full(len(points), -np.inf)
        for number in sorted(streets.structures.bridges):
            nodes, line = self.nodes[number], self.line(number)
            ends = np.array([line[0] - line[1], line[-1] - line[-2]])
            outside = line[[0, -1]] + BANK * ends / np.maximum(np.hypot(*ends.T), _TOLERANCE)[:, None]
            share = travelled(line) / max(travelled(line)[-1], _TOLERANCE)
            for heights, two in ((self.start, self.start[nodes[[0, -1]]]), (self.banks, ground(outside))):
                heights[nodes] = two[0] + share * (two[1] - two[0])
        # Where ground is smoothed, on a bridge and next to its end, its steps are no slopes of the streets.
        self.on_bank = np.isfinite(self.banks)
        if self.on_bank.any():
            near = shapely.STRtree(shapely.points(self.xy[self.on_bank]))
            self.on_bank[near.query(shapely.points(self.xy), predicate="dwithin", distance=BANK)[0]] = True
        self.limits: list[list[tuple[int, float]]] = [[] for _ in points]
        self._limit_ways()

    def line(self, way: int) -> Float:
        """Return the places of a way, (n, 2) metres."""
        line: Float = self.xy[self.nodes[way]]
        return line

    def half(self, way: int) -> float:
        """Return half the width of a way, metres."""
        return half_width(self.streets.ways[way].tags)

    def cells(self, way: int) -> NDArray[np.object_]:
        """Return the area in plan around each place of a way."""
        line = self.line(way)
        middles = (line[:-1] + line[1:]) / 2
        pieces = np.stack([np.vstack([line[:1], middles]), line, np.vstack([middles, line[-1:]])], axis=1)
        cells: NDArray[np.object_] = shapely.buffer(shapely.linestrings(pieces), self.half(way), cap_style="flat")
        return cells

    def onward(self, way: int) -> Iterator[int]:
        """Yield the ways that continue a way straight from its ends."""
        for number, nodes in self.nodes.items():
            for own, other in itertools.product((0, -1), repeat=2):
                if number != way and self.nodes[way][own] == nodes[other]:
                    turn = _leaving(self.line(way), own) - _leaving(self.line(number), other)
                    if abs(math.remainder(turn, math.pi)) < PARALLEL:
                        yield number

    def feet(self, places: Float, way: int) -> tuple[Integer, Integer, Float]:
        """Return where points (k, 2) are nearest to a way, or to those that netconvert may have merged with it.

        Returns
        -------
        first, last : (k,) int64
            Places next to each other; empty if the way is not known.
        share : (k,) float64
            How far the nearest point is from the first to the last one, from 0 to 1.
        """
        ways = self.continued.get(way, {way} & self.nodes.keys())
        pieces = [np.column_stack([self.nodes[one][:-1], self.nodes[one][1:]]) for one in sorted(ways)]
        if not pieces:
            return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0)
        first, last = np.concatenate(pieces).T
        segments = shapely.linestrings(np.stack([self.xy[first], self.xy[last]], axis=1))
        points = shapely.points(places)
        nearest = shapely.STRtree(segments).nearest(points)
        return first[nearest], last[nearest], shapely.line_locate_point(segments[nearest], points, normalized=True)

    def limit_turns(self, road_map: RoadMap) -> None:
        """Limit the grades of the roads within junctions, which may be shorter than the ways between their ends."""
        ends: dict[tuple[str, str], int] = {}
        for road in road_map.roads:
            if road.junction_id is None:
                first, last, share = self.feet(_places(road, np.array([0.0, road.length])), way_id(road.id))
                nearest = np.where(share < 0.5, first, last).tolist()
                ends |= {(road.id, contact): node for contact, node in zip(("start", "end"), nearest, strict=False)}
        for road in road_map.roads:
            links = [link for link in (road.predecessor, road.successor) if link is not None]
            known = [ends[key] for link in links if (key := (link.id, link.contact)) in ends]
            if road.junction_id is not None and len(known) == 2:
                self._limit(known[0], known[1], GRADE * road.length)

    def _limit(self, one: int, other: int, most: float) -> None:
        """Limit the difference in height of two places, metres.

        Terrain may be steeper than the grade, so the limit is never below the difference that exists already: the start
        is then feasible, and heights move only where a crossing needs it.
        """
        smoothed = self.on_bank[one] and self.on_bank[other]
        natural = 0.0 if smoothed else abs(float(self.start[one] - self.start[other]))
        self.limits[one].append((other, max(most, natural)))
        self.limits[other].append((one, max(most, natural)))

    def _limit_ways(self) -> None:
        """Limit the grades of the ways, and the steps between the lanes of different ways that lie on each other."""
        layers: dict[int, int] = {}
        ways: dict[int, set[int]] = {}
        for number, nodes in self.nodes.items():
            # The lane on the inside of a bend is shorter than the line of the way, and so the steepest.
            line, grade = self.line(number), LINK_GRADE if is_link(self.streets.ways[number].tags) else GRADE
            aside = (0.0, self.half(number), -self.half(number))
            steps = np.min([np.diff(travelled(beside(line, by))) for by in aside], axis=0)
            for one, other, length in zip(nodes[:-1].tolist(), nodes[1:].tolist(), steps.tolist(), strict=True):
                self._limit(one, other, grade * length)
            for node in nodes.tolist():
                layers[node] = max(layers.get(node, 0), self.streets.structures.layers.get(number, 0), key=abs)
                ways.setdefault(node, set()).add(number)
        # Where lanes of different streets lie on each other, as at a fork, their surfaces must not come apart. Streets
        # of different layers may well lie above each other there.
        points = shapely.points(self.xy)
        for one, other in shapely.STRtree(points).query(points, "dwithin", distance=SAME_SURFACE).T.tolist():
            if one < other and ways[one].isdisjoint(ways[other]) and layers[one] == layers[other]:
                self._limit(one, other, GRADE * float(np.hypot(*(self.xy[other] - self.xy[one]))))


def _leaving(line: Float, end: int) -> float:
    """Return the direction in which a line (n, 2) leads away from its start (0) or end (-1), radians."""
    x, y = (line[1] - line[0]) if end == 0 else (line[-2] - line[-1])
    return math.atan2(y, x)


def _places(road: Road, along: Float) -> Float:
    """Return the points (n, 2) of a reference line at stations (n,), metres."""
    x, y, _ = road.reference_line(along)
    return np.column_stack([x, y])


def _above_ground(graph: _Graph, road_map: RoadMap, heights: Float) -> Profiles:
    """Return stations along each road and heights above the ground there, from the heights (n,) of places."""
    found: dict[str, tuple[Float, Float]] = {}
    for road in road_map.roads:
        number = way_id(road.id)
        if road.junction_id is None:
            along = _stations(road.length)
            found[road.id] = along, road.elevation(along) + _rise(graph, heights, _places(road, along), number)
    for road in road_map.roads:
        if road.id not in found:
            along = _stations(road.length)
            own = road.elevation(along)
            # A connecting road keeps its own shape in height, shifted linearly so that both ends meet its streets.
            links = [link for link in (road.predecessor, road.successor) if link is not None and link.id in found]
            known = [float(found[link.id][1][-1 if link.contact == "end" else 0]) for link in links]
            if known:
                own += np.interp(along, [0.0, road.length], [known[0] - own[0], known[-1] - own[-1]])
            found[road.id] = along, own
    return found


def _rise(graph: _Graph, heights: Float, places: Float, way: int) -> Float:
    """Return how high (k,) a road made from a way is above the ground at its places (k, 2), metres."""
    first, last, share = graph.feet(places, way)
    if not len(first):
        return np.zeros(len(places))
    height = heights[first] + share * (heights[last] - heights[first])
    if way in graph.streets.structures.bridges:
        ends = graph.ground(places[[0, -1]])
        return np.asarray(height - np.linspace(ends[0], ends[1], len(places)))
    moved = np.abs(heights - graph.start) > _TOLERANCE
    foot = graph.xy[first] + share[:, None] * (graph.xy[last] - graph.xy[first])
    return np.where(moved[first] | moved[last], height - graph.ground(foot), 0.0)


def _continued(streets: StreetFile) -> dict[int, frozenset[int]]:
    """Return the ways that netconvert may have merged with each way, because nothing else meets where they join."""
    apart = streets.structures.apart
    ends = {number: (way.nodes[0], way.nodes[-1]) for number, way in streets.ways.items() if number not in apart}
    used = Counter(itertools.chain.from_iterable(way.nodes for way in streets.ways.values()))
    groups = joined(tuple(node for node in two if used[node] == 2) for two in ends.values())
    members: dict[int, frozenset[int]] = {}
    for group in groups:
        ways = frozenset(number for number, two in ends.items() if not group.isdisjoint(two))
        members |= dict.fromkeys(ways, ways)
    return members


@dataclass(frozen=True, eq=False)
class _Place:
    """Location of a grade-separated crossing.

    Parameters
    ----------
    crossing : Crossing
        Ways that cross.
    upper, lower : (n,) and (m,) int64
        Places of the upper and of the lower street; empty for a crossed way that is not a street.
    ground : float, metres
        Height of a crossed way that is not a street.
    """

    crossing: Crossing
    upper: Integer
    lower: Integer
    ground: float


def _crossing_places(graph: _Graph, crossings: Iterable[Crossing], shapes: PlanShapes) -> Iterator[_Place]:
    """Yield the locations of crossings on bridges and in underpasses."""
    pieces: dict[int, list[int]] = {}
    for number, way in graph.streets.ways.items():
        pieces.setdefault(id(way.tags), []).append(number)  # pieces of one way share their tags
    for crossing in crossings:
        crossed = pieces.get(id(crossing.other.tags), [])
        own, other = shapes.line(crossing.way), shapes.line(crossing.other)
        for street_area, other_area in corridors(crossing, own, other):
            common = street_area.intersection(other_area)
            if not common.is_empty:
                # The clearance must hold wherever the street covers the crossed way, on the street and on what
                # continues it straight.
                ways = {crossing.street, *graph.onward(crossing.street)}.difference(crossed)
                middle = shapely.get_coordinates(common.centroid)
                mine = np.concatenate([_within(graph, way, other_area, beyond=1) for way in sorted(ways)])
                found = [np.empty(0, dtype=np.int64), *(_within(graph, way, street_area) for way in crossed)]
                others = np.concatenate(found)
                upper, lower = (mine, others) if crossing.is_bridge else (others, mine)
                yield _Place(crossing, upper, lower, float(graph.ground(middle)[0]))


def _within(graph: _Graph, way: int, area: BaseGeometry, beyond: int = 0) -> Integer:
    """Return the places of a way whose lanes reach into an area, and some beyond these."""
    inside = np.flatnonzero(shapely.intersects(graph.cells(way), area))
    nodes = graph.nodes[way]
    places = inside[:, None] + np.arange(-beyond, beyond + 1)
    reached: Integer = nodes[np.unique(np.clip(places, 0, len(nodes) - 1))]
    return reached


def _separated(graph: _Graph, places: Sequence[_Place]) -> tuple[Float, list[Crossing]]:
    """Return the heights (n,) of all places, and the crossings that cannot be separated within the grades.

    Each bridge is added in turn; one that leaves no solution stays flat.
    """
    banks = {node: float(graph.banks[node]) for node in np.flatnonzero(np.isfinite(graph.banks)).tolist()}
    # Underpasses first, with all heights negated, then bridges on top of the result. All crossings of one street form a
    # group: a bridge that clears only some of the ways below it would be of no use. Groups accepted before are solved
    # again with each new one, because it may raise the streets that they cross.
    heights, flat, settled = _spread(graph.limits, graph.start, banks), [], list[_Place]()
    for down in (True, False):
        streets: dict[int, list[_Place]] = {}
        for one in places:
            if one.crossing.is_bridge != down:
                streets.setdefault(one.crossing.street, []).append(one)
        for group in streets.values():
            tried = _settled(graph, heights, [*settled, *group], down=down)
            if tried is None:
                flat += list(dict.fromkeys(one.crossing for one in group))
            else:
                heights, settled = tried, [*settled, *group]
    return heights, flat


def _settled(graph: _Graph, heights: Float, places: Sequence[_Place], *, down: bool) -> Float | None:
    """Return heights (n,) that separate all crossings, starting from `heights`; None if the grades do not allow it."""
    sign = -1.0 if down else 1.0
    heights = sign * heights
    # One round raises every street that is too low over the highest place that it crosses, and propagates this. A
    # street raised in one round may be crossed by another: chains of n crossings need n rounds, and one more to
    # confirm.
    for _ in range(len(places) + 1):
        wanted: dict[int, float] = {}
        for place in places:
            # With heights negated the lower street of an underpass is the one to be "raised". Crossings of the other
            # kind only count where the crossed way is a street, whose height may have changed.
            moved, still = (place.lower, place.upper) if down else (place.upper, place.lower)
            if len(moved) and (place.crossing.is_bridge != down or len(still)):
                other = float(heights[still].max()) if len(still) else sign * place.ground
                for node in moved.tolist():
                    least = other + place.crossing.rise
                    if heights[node] < least - _TOLERANCE:
                        wanted[node] = max(least, wanted.get(node, -math.inf))
        if not wanted:
            return sign * heights
        heights = _spread(graph.limits, heights, wanted)
        if np.abs(sign * heights - graph.start).max() > MAX_RISE:
            return None
    return None


def _spread(limits: Sequence[Sequence[tuple[int, float]]], heights: Float, wanted: Mapping[int, float]) -> Float:
    """Return the smallest heights (n,) within the limits that are at least `heights` and at least `wanted`."""
    heights = heights.copy()
    waiting = [(-height, node) for node, height in wanted.items()]
    heapq.heapify(waiting)
    # Dijkstra's algorithm with the highest place first (heapq is a min-heap, hence negated heights). Limits are not
    # negative, so a place has its final height when it is first taken from the heap; later entries are lower.
    while waiting:
        negative, node = heapq.heappop(waiting)
        if -negative > heights[node]:
            heights[node] = -negative
            for other, allowed in limits[node]:
                if -negative - allowed > heights[other] + _TOLERANCE:
                    heapq.heappush(waiting, (negative + allowed, other))
    return heights


def _flat_notes(crossings: Iterable[Crossing]) -> Iterator[str]:
    """Yield a note for each crossing that is built on one level."""
    for text in dict.fromkeys(map(str, crossings)):
        yield (
            f"{text} is built flat: the streets that connect both are too short to climb there at {GRADE:.0%} "
            f"({LINK_GRADE:.0%} on ramps)"
        )


def _stations(length: float) -> Float:
    return np.linspace(0.0, length, max(math.ceil(length / STEP), 1) + 1)
