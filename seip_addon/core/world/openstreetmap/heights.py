"""Heights of the streets of an extract: on the ground, on bridges with their ramps, and in underpasses.

OpenStreetMap contains which street leads over which, but not how high. Each street on a bridge is raised by the
clearance that it needs over the way below; the streets next to it lead up to it at a realistic grade, and are raised no
more than necessary. With grades as limits between neighbouring places, and clearances at crossings, these are the
smallest heights ``h ≥ ground`` that satisfy

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
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...arrays import Boolean, Float, Integer
from ..opendrive.lanes import LaneSurface
from ..opendrive.road_map import Road, RoadLink, RoadMap
from ..streetscape.road_surface import CARRIAGEWAY, in_groups
from ..streetscape.street_map import Profiles
from .bridges import Crossing, Structures, corridors
from .edge_lines import way_id
from .extract import Tags, Way
from .plan_shapes import PlanShapes
from .streets import StreetFile

STEP = 5.0  # metres along a street between places whose heights are computed, at most
GRADE, LINK_GRADE = 0.06, 0.08
"""Steepest grades of streets, and of slip roads and ramps, where the ground is not steeper."""
MAX_RISE = 30.0  # metres that a street lies above or below the ground at most
SAME_SURFACE = 3.0  # metres between places of streets whose lanes lie on each other
SAME_LINE = 2.0  # metres between the lines of both directions of a street at most
PARALLEL = math.radians(35.0)  # largest angle between a street and the way that it was made from
BANK = 8.0  # metres beyond the end of a bridge, where smoothed ground is as high as the bank that carries it
NEAR_CROSSING = 40.0  # metres from a crossing within which the ends of streets give the height of a junction
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
    road_map: RoadMap,
    lanes: Mapping[str, Sequence[LaneSurface]],
    sources: Mapping[str, str],
    streets: StreetFile,
    shapes: PlanShapes,
    ground: Ground | None = None,
) -> StreetHeights:
    """Return the heights of streets on the ground, with bridges and underpasses where they cross.

    Parameters
    ----------
    road_map : RoadMap
        Map made by netconvert.
    lanes : mapping of str to sequence of LaneSurface
        Lanes of each road by its id.
    sources : mapping of str to str
        Way that each road was made from, as returned by `netconvert.convert`.
    streets : StreetFile
        Streets with their bridges and underpasses.
    shapes : PlanShapes
        Shapes of the extract in map coordinates.
    ground : callable, optional
        Height of the ground above the heights of the map; zero by default.
    """
    if not streets.structures.crossings and ground is None:
        return StreetHeights({}, {}, frozenset(), ())
    network = _Network(road_map, lanes, sources, streets.ways, streets.structures, ground)
    heights, flat = _separated(network, _crossing_places(network, shapes))
    above = network.above_ground(heights)
    profiles = {road.id: network.on_ground(road, *above[road.id]) for road in road_map.roads}
    bridges = frozenset(road.id for one in network.strands if one.is_bridge for road, _ in one.roads)
    return StreetHeights(above, profiles, bridges, tuple(_flat_notes(flat)))


def has_heights(road_map: RoadMap) -> bool:
    """Return whether a map has heights of its own."""
    return any(road.elevation.coefficients.any() for road in road_map.roads)


@dataclass(frozen=True, eq=False)
class _Strand:
    """A street between two junctions, with the roads of both directions, which share their heights.

    Parameters
    ----------
    nodes : (n,) int64
        Indices of its places, in the order of the first road.
    roads : tuple of (Road, bool)
        Roads, and whether each leads opposite to the first.
    layer : int
        Layer of the way, 0 on the ground.
    is_bridge : bool
        Whether the street lies on a bridge.
    grade : float
        Steepest grade.
    street : int
        Id of the way that it was made from, 0 if unknown.
    """

    nodes: Integer
    roads: tuple[tuple[Road, bool], ...]
    layer: int
    is_bridge: bool
    grade: float
    street: int

    def node_at(self, road: str, contact: str) -> int:
        """Return the place at the start or end of one of its roads."""
        back = next(back for one, back in self.roads if one.id == road)
        return int(self.nodes[-1 if (contact == "end") != back else 0])


class _Network:
    """Graph of places along streets, with the largest height difference between neighbouring places."""

    def __init__(
        self,
        road_map: RoadMap,
        lanes: Mapping[str, Sequence[LaneSurface]],
        sources: Mapping[str, str],
        ways: Mapping[int, Way],
        structures: Structures,
        ground: Ground | None,
    ) -> None:
        self.road_map, self.lanes, self.sources = road_map, lanes, sources
        self.ways, self.structures, self.ground = ways, structures, ground
        self.strands: list[_Strand] = []
        self.strand_of: dict[str, _Strand] = {}
        # Places are sampled along streets only. Roads within junctions get no places: they link the ends of streets,
        # and their heights follow from these ends (`above_ground`).
        own = [road for road in self.road_map.roads if road.junction_id is None]
        places, headings, grounds = [np.empty((0, 2))], [np.empty(0)], [np.empty(0)]
        count = 0
        for roads in _both_directions(own, self.sources):
            road = roads[0][0]
            along = _stations(road.length)
            x, y, heading = road.reference_line(along)
            strand = self._strand(count + np.arange(len(along)), roads)
            self.strands.append(strand)
            self.strand_of |= {one.id: strand for one, _ in roads}
            places.append(np.column_stack([x, y]))
            headings.append(heading)
            grounds.append(road.elevation(along))
            count += len(along)
        self.xy, self.heading = np.concatenate(places), np.concatenate(headings)
        # Heights of the ground, straight between the ends of bridges, and of bridges between their banks, metres.
        self.rise = self._rise(self.xy)
        self.banks = np.full(count, -np.inf)
        of_strand = np.repeat(np.arange(len(self.strands)), [len(one.nodes) for one in self.strands])
        self.layers = np.array([one.layer for one in self.strands], dtype=np.int64)[of_strand]
        self.streets = np.array([one.street for one in self.strands], dtype=np.int64)[of_strand]
        for strand in self.strands:
            # Under a bridge the ground drops to a valley, water or another street. Its baseline is the straight line
            # between its ends, and it lies no lower than the banks just beyond them.
            if strand.is_bridge:
                ends = strand.nodes[[0, -1]]
                self.rise[strand.nodes] = _straight(self.rise[ends], len(strand.nodes))
                if self.ground is not None:
                    self.banks[strand.nodes] = _straight(self._rise(self._outside(ends)), len(strand.nodes))
        self.start = np.concatenate(grounds) + self.rise  # heights of the map on that ground, metres
        self.limits: list[list[tuple[int, float]]] = [[] for _ in range(count)]
        on_bank = self._on_bank()
        for one, other, limit in self._pairs():
            # Terrain may be steeper than the grade, so the limit is never below the difference that exists already: the
            # start is then feasible, and heights move only where a crossing needs it. On a bank that difference is an
            # artefact of smoothed ground, and does not count.
            natural = 0.0 if on_bank[one] and on_bank[other] else abs(float(self.start[one] - self.start[other]))
            allowed = max(limit, natural)
            self.limits[one].append((other, allowed))
            self.limits[other].append((one, allowed))

    def _strand(self, nodes: Integer, roads: tuple[tuple[Road, bool], ...]) -> _Strand:
        number = way_id(self.sources.get(roads[0][0].id, ""))
        way = self.ways.get(number)
        tags: Tags = way.tags if way is not None else {}
        grade = LINK_GRADE if tags.get("highway", "").endswith("_link") else GRADE
        layer = self.structures.layers.get(number, 0)
        return _Strand(nodes, roads, layer, number in self.structures.bridges, grade, number)

    def _rise(self, xy: Float) -> Float:
        return np.zeros(len(xy)) if self.ground is None else self.ground(xy)

    def _outside(self, ends: Integer) -> Float:
        """Return the points (2, 2) `BANK` metres beyond both ends of a bridge."""
        along = np.column_stack([np.cos(self.heading[ends]), np.sin(self.heading[ends])])
        outside: Float = self.xy[ends] + BANK * along * [[-1.0], [1.0]]
        return outside

    def _on_bank(self) -> Boolean:
        """Return which places (n,) are on a bridge or next to its end, where ground heights are not reliable."""
        on_bank: Boolean = np.isfinite(self.banks)
        if on_bank.any():
            tree = shapely.STRtree(shapely.points(self.xy[on_bank]))
            on_bank[tree.query(shapely.points(self.xy), predicate="dwithin", distance=BANK)[0]] = True
        return on_bank

    def _pairs(self) -> Iterator[tuple[int, int, float]]:
        """Yield pairs of neighbouring places, and the largest difference of their heights, metres."""
        for strand in self.strands:
            # Along each street: the lane on the inside of a bend is shorter than the reference line, and so the
            # steepest.
            steps = np.min([self._steps(road, len(strand.nodes), back=back) for road, back in strand.roads], axis=0)
            for one, other, length in zip(strand.nodes[:-1].tolist(), strand.nodes[1:].tolist(), steps, strict=True):
                yield one, other, strand.grade * float(length)
        # Across junctions: between all ends of streets, and along each connecting road.
        for ends in self.meeting.values():
            for one, other in itertools.combinations(sorted(ends), 2):
                yield one, other, GRADE * float(np.hypot(*(self.xy[other] - self.xy[one])))
        for road in self.road_map.roads:
            start, end = self._end(road.predecessor), self._end(road.successor)
            if road.junction_id is not None and start is not None and end is not None:
                yield start, end, GRADE * float(self._steps(road, 2, back=False)[0])
        # Where lanes of different streets lie on each other, as at a fork, their surfaces must not come apart. Streets
        # of different layers may well lie above each other there.
        points = shapely.points(self.xy)
        first, second = shapely.STRtree(points).query(points, predicate="dwithin", distance=SAME_SURFACE)
        known = {node: number for number, strand in enumerate(self.strands) for node in strand.nodes.tolist()}
        for one, other in zip(first.tolist(), second.tolist(), strict=True):
            if one < other and known[one] != known[other] and self.layers[one] == self.layers[other]:
                yield one, other, GRADE * float(np.hypot(*(self.xy[other] - self.xy[one])))

    def _steps(self, road: Road, places: int, *, back: bool) -> Float:
        """Return the lengths in plan between places along a road on its shortest lane, (n - 1,) metres."""
        along = np.linspace(0.0, road.length, places)
        lengths = [np.diff(along)]
        for lane in in_groups(self.lanes[road.id], CARRIAGEWAY):
            if lane.s[0] < _TOLERANCE and lane.s[-1] > road.length - _TOLERANCE:
                middle = (lane.left + lane.right)[:, :2] / 2
                x, y = (np.interp(along, lane.s, middle[:, axis]) for axis in (0, 1))
                lengths.append(np.hypot(np.diff(x), np.diff(y)))
        shortest: Float = np.min(lengths, axis=0)
        return shortest[::-1] if back else shortest

    def _end(self, link: RoadLink | None) -> int | None:
        """Return the place at the end of a linked road, None without one."""
        if link is None or link.id not in self.strand_of:
            return None
        return self.strand_of[link.id].node_at(link.id, link.contact)

    @cached_property
    def meeting(self) -> dict[str, set[int]]:
        """Places at the ends of streets by junction id; a joint of two roads outside junctions has a key of its own."""
        meeting: dict[str, set[int]] = {}
        for strand in self.strands:
            for road, _ in strand.roads:
                for link, contact in ((road.predecessor, "start"), (road.successor, "end")):
                    if link is not None:
                        node = strand.node_at(road.id, contact)
                        if link.kind == "junction":
                            meeting.setdefault(link.id, set()).add(node)
                        elif (other := self._end(link)) is not None:
                            meeting[f"{min(node, other)} {max(node, other)}"] = {node, other}
        return meeting

    def cells(self) -> list[shapely.Polygon]:
        """Return the area in plan covered by the lanes around each place."""
        found: list[list[Float]] = [[] for _ in range(len(self.xy))]
        for strand in self.strands:
            for road, back in strand.roads:
                lanes = self.lanes[road.id]
                nodes = strand.nodes[::-1] if back else strand.nodes
                along = np.linspace(0.0, road.length, len(nodes))
                half = along[1] / 2
                for node, s in zip(nodes.tolist(), along.tolist(), strict=True):
                    found[node] += _across(lanes, np.clip([s - half, s, s + half], 0.0, road.length))
        return [shapely.convex_hull(shapely.multipoints(np.concatenate([np.empty((0, 2)), *one]))) for one in found]

    def of_way(self, nodes: Integer, ids: Sequence[int], layer: int, heading: float) -> Integer:
        """Return those of `nodes` that belong to a way, by its ids; without any, by layer and direction."""
        named: Integer = nodes[np.isin(self.streets[nodes], ids)]
        # netconvert may merge ways into one road, which then has the id of only one of them
        similar: Integer = nodes[(self.layers[nodes] == layer) & self._is_parallel(nodes, heading)]
        return named if len(named) else similar

    def leads_on(self, nodes: Integer, street: int, heading: float) -> Integer:
        """Return those of `nodes` on streets that continue straight from the ends of a street."""
        ends = {node for one in self.strands if one.street == street for node in one.nodes[[0, -1]].tolist()}
        met = set().union(*(nodes_there for nodes_there in self.meeting.values() if nodes_there & ends))
        streets = [one.street for one in self.strands if met & set(one.nodes[[0, -1]].tolist())]
        following: Integer = nodes[np.isin(self.streets[nodes], streets) & self._is_parallel(nodes, heading)]
        return following

    def _is_parallel(self, nodes: Integer, heading: float) -> Boolean:
        turned = np.remainder(self.heading[nodes] - heading + np.pi / 2, np.pi) - np.pi / 2
        parallel: Boolean = np.abs(turned) < PARALLEL
        return parallel

    def above_ground(self, heights: Float) -> Profiles:
        """Return stations along each road and heights above the ground there, from the heights (n,) of places."""
        above = heights - self.rise
        found: dict[str, tuple[Float, Float]] = {}
        for strand in self.strands:
            for road, back in strand.roads:
                nodes = strand.nodes[::-1] if back else strand.nodes
                found[road.id] = np.linspace(0.0, road.length, len(nodes)), above[nodes]
        for road in self.road_map.roads:
            if road.id not in found:
                along = _stations(road.length)
                own = road.elevation(along)
                ends = [self._linked(link, found) for link in (road.predecessor, road.successor)]
                # A connecting road keeps its own shape in height, shifted linearly so that both ends meet its streets.
                known = [end for end in ends if end is not None]
                if known:
                    own += np.interp(along, [0.0, road.length], [known[0] - own[0], known[-1] - own[-1]])
                found[road.id] = along, own
        return found

    def on_ground(self, road: Road, along: Float, above: Float) -> tuple[Float, Float]:
        """Return stations (n,) along a road and heights there, from the heights above the ground."""
        x, y, _ = road.reference_line(along)
        rise = self._rise(np.column_stack([x, y]))
        if road.id in self.strand_of and self.strand_of[road.id].is_bridge:
            rise = np.linspace(rise[0], rise[-1], len(rise))
        return along, above + rise

    def _linked(self, link: RoadLink | None, found: Profiles) -> float | None:
        """Return the height of the end of a linked road, metres; None without one."""
        if link is None or link.id not in found:
            return None
        return float(found[link.id][1][-1 if link.contact == "end" else 0])


@dataclass(frozen=True, eq=False)
class _Place:
    """Location of a grade-separated crossing.

    Parameters
    ----------
    crossing : Crossing
        Ways that cross.
    own : (n,) int64
        Places of the street on the bridge or in the underpass.
    others : (m,) int64
        Places of the crossed street; empty if the crossed way is not a street.
    ground : float, metres
        Height of a crossed way that is not a street.
    """

    crossing: Crossing
    own: Integer
    others: Integer
    ground: float

    @property
    def upper(self) -> Integer:
        """Places of the upper street."""
        return self.own if self.crossing.is_bridge else self.others

    @property
    def lower(self) -> Integer:
        """Places of the lower street."""
        return self.others if self.crossing.is_bridge else self.own


def _crossing_places(network: _Network, shapes: PlanShapes) -> list[_Place]:
    """Return the locations of crossings on bridges and in underpasses."""
    crossings = network.structures.crossings
    if not crossings:
        return []
    cells = network.cells()
    tree = shapely.STRtree(cells)
    numbers: dict[int, list[int]] = {}
    for number, way in network.ways.items():
        numbers.setdefault(id(way.tags), []).append(number)  # pieces of one way share their tags
    found = []
    for crossing in crossings:
        ids = numbers.get(id(crossing.other.tags), [])
        if not ids and has_heights(network.road_map):
            continue  # heights of the extract are those of its bridges, too
        own, other = shapes.line(crossing.way), shapes.line(crossing.other)
        for street_area, other_area in corridors(crossing, own, other):
            # The clearance must hold wherever the street covers the crossed way, including lanes next to its centre
            # line: take all places whose lanes overlap the crossed area, on the street and on what continues it
            # straight.
            common = street_area.intersection(other_area)
            if common.is_empty:
                continue
            middle = shapely.get_coordinates(common.centroid)
            others = _places_of(network, tree, common, ids, crossing.layers[1], _heading(other, middle[0]))
            crossed = shapely.union_all([other_area, *(cells[node] for node in others.tolist())])
            near = np.sort(tree.query(crossed, predicate="intersects"))
            mine = near[network.streets[near] == crossing.street]
            if len(mine):
                leads_on = network.leads_on(near, crossing.street, _heading(own, middle[0]))
                mine = np.union1d(mine, np.setdiff1d(leads_on, others))
                ground = 0.0 if network.ground is None else float(network.ground(middle)[0])
                found.append(_Place(crossing, mine, others, ground))
    return found


def _places_of(
    network: _Network, tree: shapely.STRtree, common: BaseGeometry, ids: Sequence[int], layer: int, heading: float
) -> Integer:
    """Return the places of a crossed street in the common area, or else near it, as within a junction."""
    for area in (common, common.centroid.buffer(NEAR_CROSSING)):
        near = np.sort(tree.query(area, predicate="intersects"))
        found = network.of_way(near, ids, layer, heading) if ids else near[:0]
        if len(found):
            break
    return found


def _heading(line: Float, place: Float) -> float:
    """Return the direction of the segment of a line (n, 2) nearest to a point (2,), radians."""
    pieces = shapely.linestrings(np.stack([line[:-1], line[1:]], axis=1))
    x, y = np.diff(line, axis=0)[int(np.argmin(shapely.distance(pieces, shapely.Point(place))))]
    return math.atan2(y, x)


def _separated(network: _Network, places: Sequence[_Place]) -> tuple[Float, list[Crossing]]:
    """Return the heights (n,) of all places, and the crossings that cannot be separated within the grades.

    Each bridge is added in turn; one that leaves no solution stays flat.
    """
    banks = {node: float(network.banks[node]) for node in np.flatnonzero(np.isfinite(network.banks)).tolist()}
    # Underpasses first, with all heights negated, then bridges on top of the result. All crossings of one street form a
    # group: a bridge that clears only some of the ways below it would be of no use. Groups accepted before are solved
    # again with each new one, because it may raise the streets that they cross.
    heights, flat, settled = _spread(network.limits, network.start, banks), [], list[_Place]()
    for down in (True, False):
        streets: dict[int, list[_Place]] = {}
        for one in places:
            if one.crossing.is_bridge != down:
                streets.setdefault(one.crossing.street, []).append(one)
        for group in streets.values():
            tried = _settled(network, heights, [*settled, *group], down=down)
            if tried is None:
                flat += list(dict.fromkeys(one.crossing for one in group))
            else:
                heights, settled = tried, [*settled, *group]
    return heights, flat


def _settled(network: _Network, heights: Float, places: Sequence[_Place], *, down: bool) -> Float | None:
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
        heights = _spread(network.limits, heights, wanted)
        if np.abs(sign * heights - network.start).max() > MAX_RISE:
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


def _both_directions(roads: Sequence[Road], sources: Mapping[str, str]) -> list[tuple[tuple[Road, bool], ...]]:
    """Return the roads grouped by street, with a flag for each that leads opposite to the first of its group."""
    found: dict[str, list[tuple[Road, bool]]] = {}
    for road in roads:
        # netconvert marks the backward direction of a way with a minus sign. Both roads share heights only if they also
        # lie on the same line; carriageways that were drawn apart stay separate.
        source = sources.get(road.id, f"road {road.id}")
        key = source.removeprefix("-")
        if key in found and _is_other_direction(found[key][0][0], road):
            found[key].append((road, True))
        else:
            found.setdefault(key if key not in found else f"{key} {road.id}", []).append((road, False))
    return [tuple(one) for one in found.values()]


def _is_other_direction(one: Road, other: Road) -> bool:
    places = [np.column_stack(road.reference_line(np.linspace(0.0, road.length, 9))[:2]) for road in (one, other)]
    return bool(np.hypot(*(places[0] - places[1][::-1]).T).max() < SAME_LINE)


def _stations(length: float) -> Float:
    return np.linspace(0.0, length, max(math.ceil(length / STEP), 1) + 1)


def _straight(ends: Float, places: int) -> Float:
    """Return heights (n,) at places of a straight line between two heights (2,)."""
    return np.linspace(float(ends[0]), float(ends[1]), places)


def _across(lanes: Sequence[LaneSurface], along: Float) -> list[Float]:
    """Return the edge points of lanes at stations along their road, a list of (n, 2)."""
    found = []
    for lane in lanes:
        inside = along[(along >= lane.s[0] - _TOLERANCE) & (along <= lane.s[-1] + _TOLERANCE)]
        found += [
            np.column_stack([np.interp(inside, lane.s, edge[:, axis]) for axis in (0, 1)])
            for edge in (lane.left, lane.right)
        ]
    return found
