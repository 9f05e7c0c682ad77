"""Streets of a network that SUMO's netconvert made of an extract: lanes, junctions, crossings and signals.

A network has lanes as centre lines with a width, and junctions, their pavements and crossings as areas.
"""

import itertools
import math
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...base.errors import SeipError
from ...geometry.plan import beside, closed, opened, travelled, united, without
from ..opendrive.lanes import LaneSurface
from ..opendrive.objects import PlacedObject, PlacedSignal
from ..opendrive.profile import linear_profile
from ..opendrive.reference_line import Clothoid, ReferenceLine
from ..opendrive.road_map import Junction, Road, RoadLink, RoadMap
from ..streetscape.intersections import SAME_DIRECTION
from ..streetscape.named_places import CROSSING
from ..streetscape.road_surface import CARRIAGEWAY, in_groups, interpolated
from ..streetscape.street_map import JunctionArea, Profiles, StreetMap
from ..traffic_simulation.street_network import (
    LANE_WIDTH,
    MIN_STEP,
    NetworkLane,
    StreetNetwork,
    read_network,
    shape_points,
    shape_text,
)

_LANE = re.compile(r'(<lane id=")([^"]*)("[^>]*? shape=")([^"]*)"')
_Areas = defaultdict[str, list[BaseGeometry]]
PRECISION = 3  # decimal places of coordinates, metres
WALK_STEP = 2.0  # metres between the points of a pavement that is moved to a mapped sidewalk
MAX_WALK_SHIFT = 8.0  # metres by which it is moved at most
MIN_WALKED = 0.5  # share of it along which the sidewalk must run
MIN_ARMS = 3  # arms of a junction; where fewer meet, a street continues
ARM_GAP = 2.0  # metres between two ends of carriageways of one arm at most
MAX_MERGING = 4  # ends of edges where the directions of one street divide: two of each direction
SLIVER = 0.6  # metres: narrower parts of a junction between its pavements are no carriageway
CORNER = 2.0  # metres that the carriageway of a junction extends beyond the lanes through it, at most
BIKE_LANE = 0.75  # half the width of a cycle lane, metres: between lanes through a junction
MIN_LENGTH = 0.1  # metres: shorter lanes within junctions have no direction
LAMP_HEIGHT = 5.0  # metres above the road
RAILS = {"tram", "rail_urban", "rail", "rail_electric", "rail_fast"}
ROAD_VEHICLES = {"passenger", "bus", "delivery", "truck", "taxi", "private", "motorcycle"}


@dataclass(frozen=True, eq=False)
class _Lane:
    """A lane of a road: its type as in OpenDRIVE, "" without a surface, its width in metres, and its line (n, 3)."""

    type: str
    width: float
    line: Float


@dataclass(frozen=True, eq=False)
class NetworkMap:
    """A network of SUMO: its streets, and the file that traffic is simulated on.

    Parameters
    ----------
    streets : StreetMap
        Streets of the network.
    text : str
        Content of the file.
    pieces : mapping of str to (str, float, float)
        Road of each lane in the file by the id of the lane, and the shares of the road where it begins and ends.
    """

    streets: StreetMap
    text: str
    pieces: Mapping[str, tuple[str, float, float]]

    def raised(self, profiles: Profiles) -> "NetworkMap":
        """Return the network with new heights of the roads in its file."""

        def raised(match: re.Match[str]) -> str:
            number, low, high = self.pieces.get(match[2], ("", 0.0, 1.0))
            if number not in profiles:
                return match[0]
            line = shape_points(match[4])
            along, heights = profiles[number]
            if len(line) < 2:
                return match[0]
            # A lane gets points where its height bends, besides those of its line.
            own, bends = _shares(line), (along / along[-1] - low) / (high - low)
            shares = np.unique(np.concatenate([own, bends[(bends > 0.0) & (bends < 1.0)]]))
            x, y = (np.interp(shares, own, line[:, axis]) for axis in (0, 1))
            z = np.interp((low + (high - low) * shares) * along[-1], along, heights)
            return f'{match[1]}{match[2]}{match[3]}{shape_text(np.column_stack([x, y, z]), PRECISION)}"'

        return replace(self, text=_LANE.sub(raised, self.text))

    def walking_on(self, sidewalks: BaseGeometry) -> "NetworkMap":
        """Return the network with its pavements moved to mapped sidewalks along them, given as lines.

        A mapped sidewalk within the carriageway says no more than that the pavement is narrow.
        """
        about = sidewalks.buffer(MAX_WALK_SHIFT)
        shapely.prepare(about)
        areas = [lane.polygon for lane in in_groups(self.streets.lanes, CARRIAGEWAY)]
        areas += [one.carriageway for one in self.streets.junctions]
        carriageway = united(area for area in areas if about.intersects(area))
        shapely.prepare(carriageway)
        mapped = without(sidewalks, carriageway.buffer(WALK_STEP / 2))

        def moved(match: re.Match[str]) -> str:
            if match[2].startswith(":") or ' allow="pedestrian"' not in match[3]:
                return match[0]
            line = _moved_walk(shape_points(match[4]), mapped, carriageway)
            if line is None or carriageway.intersects(shapely.LineString(line)):
                return match[0]
            return f'{match[1]}{match[2]}{match[3]}{shape_text(line, PRECISION)}" customShape="1"'

        return self if mapped.is_empty else replace(self, text=_LANE.sub(moved, self.text))


def _moved_walk(line: Float, mapped: BaseGeometry, carriageway: BaseGeometry) -> Float | None:
    """Return the line of a pavement (n, 3), moved sideways to mapped sidewalks; None if none runs along most of it."""
    places: Float = shapely.get_coordinates(shapely.segmentize(shapely.LineString(line), WALK_STEP), include_z=True)
    if len(places) < 2:
        return None
    plan = places[:, :2]
    ways = shapely.shortest_line(shapely.points(plan), mapped)
    aside = shapely.get_coordinates(ways)[1::2] - plan
    along = np.gradient(plan, axis=0)
    along /= np.maximum(np.hypot(*along.T), MIN_STEP)[:, None]
    # Beyond the end of a mapped sidewalk, the way to it leads along the street: there the line keeps its distance.
    known = (np.hypot(*aside.T) < MAX_WALK_SHIFT) & (np.abs((aside * along).sum(axis=1)) < WALK_STEP / 2)
    known &= ~shapely.intersects(carriageway, ways)
    if known.mean() < MIN_WALKED:
        return None
    left = (aside * np.column_stack([-along[:, 1], along[:, 0]])).sum(axis=1)
    by = np.interp(np.arange(len(plan)), np.flatnonzero(known), left[known])
    places[:, :2] += by[:, None] * np.column_stack([-along[:, 1], along[:, 0]])
    return places


def credited(text: str, attribution: Iterable[str]) -> str:
    """Return the text of a network with credits to the sources of its data, as comments."""
    lines = "".join(f"<!-- {one.replace('--', '-')} -->\n" for one in attribution)
    head, mark, rest = text.partition("<net ")
    return f"{head}{lines}{mark}{rest}"


def read_network_map(path: Path) -> NetworkMap:
    """Read a network of SUMO.

    Each edge is a road, and so is each group of parallel connections within a junction. Lane ids, edges and links are
    those that OpenDRIVE would have: lanes count from the middle of the street outwards, negative if traffic keeps to
    the right.

    Parameters
    ----------
    path : Path
        Network (.net.xml) with internal lanes.

    Raises
    ------
    SeipError
        The file cannot be read or is not a network.
    """
    network = read_network(path)
    pieces = {
        f"{edge.id}_{lane.index}": (edge.id, 0.0, 1.0)
        for edge in (*network.edges.values(), *network.inside.values())
        for lane in edge.lanes
    }
    try:
        streets = _streets(network, pieces)
    except (KeyError, IndexError) as error:
        raise SeipError(f"{path.name} is not a valid SUMO network ({error}); write it again with netconvert") from error
    if not streets.lanes:
        raise SeipError(f"{path.name} is a SUMO network without streets; write it again with netconvert")
    return NetworkMap(streets, path.read_text(encoding="utf-8"), pieces)


def _streets(network: StreetNetwork, pieces: dict[str, tuple[str, float, float]]) -> StreetMap:
    joints = frozenset(_joints(network))
    roads = list(_roads(network, pieces, joints))
    road_map = RoadMap(
        name="",
        header_offset=np.array([*-network.offset, 0.0, 0.0]),
        geo_reference=network.projection,
        roads=tuple(road for road, _ in roads),
        junctions=tuple(Junction(number, number) for number in network.shapes),
        objects=tuple(_crossings(network)),
        signals=tuple(_signals(network)),
    )
    lanes = tuple(itertools.chain.from_iterable(lanes for _, lanes in roads))
    areas = tuple(_junction_areas(network, lanes, joints))
    return StreetMap(road_map, lanes, areas)


def _type(lane: NetworkLane) -> str:
    """Return the lane type of OpenDRIVE that a lane with some permissions has, "" if it has no surface."""
    if lane.allowed == {"pedestrian"}:
        return "sidewalk"
    if lane.allowed == {"bicycle"}:
        return "biking"
    if lane.allowed and "all" not in lane.allowed:
        if lane.allowed & ROAD_VEHICLES:
            return "driving"
        return "tram" if lane.allowed & RAILS else ""
    return "" if "all" in lane.closed else "driving"


def _joints(network: StreetNetwork) -> Iterator[str]:
    """Yield the junctions where no more than two arms meet, so that a street only continues.

    Carriageways of both directions are one arm if they leave in one direction next to each other, as where a median
    begins.
    """
    neighbours: defaultdict[str, set[str]] = defaultdict(set)
    ends: defaultdict[str, list[tuple[shapely.LineString, float]]] = defaultdict(list)
    for edge in network.edges.values():
        driven = [lane for lane in edge.lanes if _type(lane) not in ("", "sidewalk") and len(lane.line) > 1]
        if not driven:
            continue
        neighbours[edge.from_node].add(edge.to_node)
        neighbours[edge.to_node].add(edge.from_node)
        for node, row, onward in ((edge.from_node, 0, 1), (edge.to_node, -1, -2)):
            outer, inner = driven[0].line, driven[-1].line
            x, y = inner[onward] - inner[row]
            ends[node].append((shapely.LineString([outer[row], inner[row]]), math.atan2(y, x)))
    for node in network.shapes:
        across = shapely.union_all([line.buffer((LANE_WIDTH + ARM_GAP) / 2) for line, _ in ends[node]])
        arms = max(len(shapely.get_parts(across)), _directions([heading for _, heading in ends[node]]))
        if arms < MIN_ARMS and (len(neighbours[node]) < MIN_ARMS or len(ends[node]) <= MAX_MERGING):
            yield node


def _directions(headings: Sequence[float]) -> int:
    """Return the number of headings that differ by more than `SAME_DIRECTION` from each other."""
    found: list[float] = []
    for heading in headings:
        if all(abs(math.remainder(heading - other, math.tau)) > SAME_DIRECTION for other in found):
            found.append(heading)
    return len(found)


def _roads(
    network: StreetNetwork, pieces: dict[str, tuple[str, float, float]], joints: frozenset[str]
) -> Iterator[tuple[Road, list[LaneSurface]]]:
    """Yield the roads outside and within junctions, with their lanes; add the roads of internal lanes to ``pieces``."""
    for edge in network.edges.values():
        links = tuple(RoadLink("junction", node) for node in (edge.from_node, edge.to_node))
        own = {
            lane.index: _Lane(_type(lane), lane.width, lane.points)
            for lane in edge.lanes
            if _type(lane) and len(lane.line) > 1
        }
        if own:
            is_track = {lane.type for lane in own.values()} - {"sidewalk"} == {"tram"}
            yield _road(edge.id, "" if is_track else edge.name, None, own, links, left_hand=network.left_hand)
    for (number, before, after), lanes in _connecting(network, pieces).items():
        junction = network.edges[before].to_node
        links = (RoadLink("road", before, "end"), RoadLink("road", after, "start"))
        road, surfaces = _road(number, "", junction, lanes, links, left_hand=network.left_hand)
        # Where a street only continues, its lanes are those of the street.
        yield road, [replace(one, junction_id=None) for one in surfaces] if junction in joints else surfaces


def _connecting(
    network: StreetNetwork, pieces: dict[str, tuple[str, float, float]]
) -> dict[tuple[str, str, str], dict[int, _Lane]]:
    """Return the lanes within junctions by road: the first internal edge, and the edges before and after it."""
    # A turn on which vehicles wait inside the junction has several internal lanes in a row.
    onward = {f"{one['from']}_{one['fromLane']}": one for one in network.connections if one["from"].startswith(":")}
    found: dict[tuple[str, str, str], dict[int, _Lane]] = {}
    for one in network.connections:
        via = one.get("via")
        if one["from"].startswith(":") or via is None:
            continue
        first, _, index = via.rpartition("_")
        if network.inside[first].function != "internal":
            continue
        chain = []
        while via is not None:
            chain.append(via)
            via = onward[via].get("via") if via in onward else None
        parts = [network.lane(one).points for one in chain]
        ends = np.concatenate([[0.0], np.cumsum([max(travelled(part)[-1], MIN_STEP) for part in parts])])
        ends /= ends[-1]
        pieces |= {one: (first, *span) for one, span in zip(chain, itertools.pairwise(ends.tolist()), strict=True)}
        line = np.concatenate(parts)
        line = line[np.concatenate([[True], np.hypot(*np.diff(line[:, :2], axis=0).T) > MIN_STEP])]
        source, target = (network.lane(f"{one[end]}_{one[f'{end}Lane']}") for end in ("from", "to"))
        kinds = {_type(source), _type(target)}
        if travelled(line)[-1] > MIN_LENGTH and "" not in kinds:
            # A cycle lane that leads into a driving lane ends where the junction begins.
            kind = kinds.pop() if len(kinds) == 1 else "driving"
            lanes = found.setdefault((first, one["from"], one["to"]), {})
            lanes[int(index)] = _Lane(kind, min(source.width, target.width), line)
    return found


def _road(
    number: str,
    name: str,
    junction: str | None,
    lanes: Mapping[int, _Lane],
    links: Sequence[RoadLink],
    *,
    left_hand: bool,
) -> tuple[Road, list[LaneSurface]]:
    """Return a road and its lanes; its reference line is the inner edge of the innermost lane."""
    order = sorted(lanes, reverse=True)  # from the middle of the street outwards
    # All lanes get the same rows: at the same share of their length, so that neighbours keep a common edge.
    shares = [_shares(lanes[one].line) for one in order]
    rows: Float = np.unique(np.round(np.concatenate(shares), 9))
    lines = (interpolated(rows, share, lanes[one].line) for one, share in zip(order, shares, strict=True))
    halves = [lanes[one].width / 2 for one in order]
    edges = [(beside(line, half), beside(line, -half)) for line, half in zip(lines, halves, strict=True)]
    reference = edges[0][1 if left_hand else 0]
    steps = np.hypot(*np.diff(reference[:, :2], axis=0).T)
    s = np.concatenate([[0.0], np.cumsum(np.maximum(steps, MIN_STEP))])
    away = 1 if left_hand else -1
    surfaces = [
        LaneSurface(number, junction, 0, away * place, lanes[one].type, left_hand, s, left, right)
        for place, (one, (left, right)) in enumerate(zip(order, edges, strict=True), start=1)
    ]
    heading = np.arctan2(*np.diff(reference[:, :2], axis=0).T[::-1])
    line = ReferenceLine(
        s[:-1], np.diff(s), np.column_stack([reference[:-1, :2], heading]), (Clothoid(0.0, 0.0),) * (len(s) - 1)
    )
    road = Road(
        id=number,
        name=name,
        junction_id=junction,
        keeps_left=left_hand,
        reference_line=line,
        elevation=linear_profile(s, reference[:, 2]),
        predecessor=links[0],
        successor=links[1],
    )
    return road, [surface for surface in surfaces if len(surface.triangles)]


def _shares(line: Float) -> Float:
    """Return how far along a line (n, 3) each point is, (n,) from 0 to 1."""
    along = travelled(line)
    return np.asarray(along / along[-1])


def _junction_areas(
    network: StreetNetwork, lanes: Sequence[LaneSurface], joints: frozenset[str]
) -> Iterator[JunctionArea]:
    """Yield the areas of the junctions."""
    roads, walking, driven = defaultdict[str, set[str]](set), _Areas(list), _Areas(list)
    for edge in network.inside.values():
        if edge.function == "walkingarea":
            walking[edge.id[1:].rpartition("_w")[0]] += [_polygon(lane.line) for lane in edge.lanes]
    for edge in network.edges.values():
        roads[edge.from_node].add(edge.id)
        roads[edge.to_node].add(edge.id)
    for lane in lanes:
        if lane.junction_id is not None:
            roads[lane.junction_id].add(lane.road_id)
            driven[lane.junction_id] += [lane.polygon] * (lane.lane_type == "driving")
    for node, shape in network.shapes.items():
        whole = _polygon(shape)
        area = _driven_area(without(whole, united(walking[node])), united(driven[node]))
        walked = united([*walking[node], without(whole, area)])
        yield JunctionArea(node, area, walked, frozenset(roads[node]), node in joints)


def _driven_area(area: BaseGeometry, lanes: BaseGeometry) -> BaseGeometry:
    """Return the carriageway of a junction from its area without pavements, and from the lanes through it.

    Pavements of edges shorter than the junction reach into it, and some between wide angles lie beyond it: the
    carriageway is where vehicles drive, and a little more at corners where none turns.
    """
    area = opened(area, SLIVER)  # where a pavement does not quite reach the outline of the junction
    if lanes.is_empty:
        return area
    filled = united(shapely.Polygon(part.exterior) for part in shapely.get_parts(closed(lanes, BIKE_LANE)))
    return united([area.intersection(filled.buffer(CORNER)), lanes])


def _polygon(line: Float) -> BaseGeometry:
    """Return the area within a line (n, 3); where that crosses itself, all parts of it."""
    parts = shapely.get_parts(shapely.make_valid(shapely.Polygon(line[:, :2]))) if len(line) > 2 else []
    return shapely.union_all([part for part in parts if shapely.get_dimensions(part) == 2])


def _crossings(network: StreetNetwork) -> Iterator[PlacedObject]:
    """Yield the crossings that netconvert guesses, as areas across the street."""
    for edge in network.inside.values():
        if edge.function == "crossing":
            for lane in edge.lanes:
                yield crossing(edge.id, "", lane.line, lane.width)


def crossing(number: str, name: str, line: Float, depth: float) -> PlacedObject:
    """Return a crossing along a line (n, 2) from kerb to kerb, ``depth`` metres wide."""
    first, last = line[0], line[-1]
    x, y = last - first
    position = np.array([*(first + last) / 2, 0.0])
    width = float(math.hypot(x, y))
    heading = math.atan2(y, x) - math.pi / 2
    return PlacedObject("", number, name, CROSSING, position, heading, length=depth, width=width)


def _signals(network: StreetNetwork) -> Iterator[PlacedSignal]:
    """Yield the traffic lights: one at the end of each lane that leads into a junction with signals."""
    seen = set()
    for one in network.connections:
        lane = (one["from"], one.get("fromLane", ""))
        edge = network.edges.get(one["from"])
        if "tl" in one and lane not in seen and edge is not None:
            seen.add(lane)
            own = edge.lanes[int(lane[1])]
            if _type(own) in ("driving", "tram") and len(own.line) > 1:
                x, y = own.line[-1] - own.line[-2]
                yield PlacedSignal(edge.id, "", own.points[-1] + [0.0, 0.0, LAMP_HEIGHT], math.atan2(y, x))
