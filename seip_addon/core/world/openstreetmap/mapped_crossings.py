"""Pedestrian crossings in the map of an extract: mapped crossings replace those that netconvert guesses."""

import itertools
import math
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...arrays import Float
from ..opendrive.lanes import LaneSurface
from ..opendrive.road_map import Road, RoadMap, RoadObject
from ..streetscape.named_places import ASSUMED_CROSSING, CROSSING
from ..streetscape.road_surface import CARRIAGEWAY, MAX_SEAM, in_groups
from .extract import Extract
from .keep_off import CROSSING_WIDTH, MAX_CROSSING_LENGTH, MAX_CROSSING_WIDTH
from .plan_shapes import PlanShapes
from .quantities import metres
from .streets import StreetFile

MAPPED_AROUND = 40.0  # metres from a mapped crossing within which no crossing is guessed
MAX_AWAY = 15.0  # metres from a crossing to the lanes of its street: in the map these end where a junction begins
ALONG_STREET = math.radians(30.0)  # between a crossed street and its lanes
LINE_STEP = 1.0  # metres between the points of a road among which the nearest to a crossing is found
_OBJECTS = re.compile(r"<objects\s*/>|<objects>.*?</objects>", re.DOTALL)
_ROAD = re.compile(r'<road [^>]*?id="([^"]*)".*?</road>', re.DOTALL)
_GUESSED_AT = re.compile(r":(.*)_c\d+")
"""Id of a crossing that netconvert guesses: the name of its junction, and its number there."""
_GUESSED = re.compile(r'<object id="([^"]*)" type="crosswalk".*?</object>\s*', re.DOTALL)


@dataclass(frozen=True, eq=False)
class _Crossed:
    """A mapped crossing: its node, middle (2,), direction of the street (2,) and extent along it, metres."""

    node: int
    middle: Float
    along: Float
    depth: float


def with_mapped_crossings(
    road_map: RoadMap,
    text: str,
    lanes: Mapping[str, Sequence[LaneSurface]],
    streets: StreetFile,
    shapes: PlanShapes,
    joints: Collection[str] = (),
) -> tuple[RoadMap, str]:
    """Return a map, and its text, with the crossings of the extract.

    A guessed crossing remains where streets meet and the extract maps none nearby; its name marks it as assumed.

    Parameters
    ----------
    road_map : RoadMap
        Map of the streets.
    text : str
        The same map as text.
    lanes : mapping of str to sequence of LaneSurface
        Lanes of each road of the map by its id.
    streets : StreetFile
        Streets that the map was made from.
    shapes : PlanShapes
        Shapes of the extract in map coordinates.
    joints : collection of str
        Names of junctions where a street only continues: crossings guessed there have no evidence.
    """
    driven = [lane for own in lanes.values() for lane in in_groups(own, CARRIAGEWAY) if lane.junction_id is None]
    crossed = [_on_carriageway(one, driven) for one in _crossed_places(streets, shapes)]
    own = _by_road(crossed, road_map)
    mapped = shapely.union_all(shapely.points(np.array([one.middle for one in crossed]).reshape(-1, 2)))
    roads = tuple(
        replace(road, objects=(*_kept(road, mapped, joints), *own.get(road.id, ()))) for road in road_map.roads
    )
    return replace(road_map, roads=roads), _written(text, roads)


def guessed_crossings(road_map: RoadMap, area: BaseGeometry) -> int:
    """Return the number of assumed crossings of a map in an area."""
    places = [
        shapely.Point(road.place(np.array([one.s]), np.array([one.t]))[0, :2])
        for road in road_map.roads
        for one in road.objects
        if one.kind == CROSSING and one.name == ASSUMED_CROSSING
    ]
    return int(shapely.intersects(area, places).sum())


def _crossed_places(streets: StreetFile, shapes: PlanShapes) -> Iterator[_Crossed]:
    """Yield the places where streets are crossed: nodes tagged as crossings, and nodes shared with a crossing way."""
    extract = shapes.extract
    widths = dict(_crossing_nodes(extract))
    ways = [way for way in streets.ways.values() if "highway" in way.tags]
    # Number of street segments at each node: a node with more than two is a junction.
    arms = Counter(itertools.chain.from_iterable(pair for way in ways for pair in itertools.pairwise(way.nodes)))
    done: set[int] = set()
    for way in ways:
        known = [number for number in way.nodes if number in extract.nodes]
        for index, number in enumerate(known):
            if number not in widths or number in done or arms[number] > 2:  # a junction has no single street direction
                continue
            done.add(number)
            # The chord between the neighbouring nodes gives the direction of the street; at an end the node itself
            # serves.
            before, middle, after = (
                shapes.point(extract.nodes[known[min(max(place, 0), len(known) - 1)]])
                for place in (index - 1, index, index + 1)
            )
            length = float(np.hypot(*(after - before)))
            if length > 0.0:
                yield _Crossed(number, middle, (after - before) / length, widths[number])


def _crossing_nodes(extract: Extract) -> Iterator[tuple[int, float]]:
    """Yield the nodes that are crossings, and the extent of each along the street, metres."""
    for way in extract.ways.values():
        if "crossing" in (way.tags.get(key) for key in ("footway", "cycleway", "path")):
            width = metres(way.tags.get("width"), MAX_CROSSING_WIDTH) or CROSSING_WIDTH
            yield from ((number, width) for number in way.nodes)
    for number, node in extract.nodes.items():
        if node.tags.get("highway") == "crossing" and node.tags.get("crossing") != "no":
            yield number, metres(node.tags.get("width"), MAX_CROSSING_WIDTH) or CROSSING_WIDTH


@dataclass(frozen=True, eq=False)
class _Laid:
    """A crossing fitted to the carriageway: its node, middle (2,), street heading, and size along and across it."""

    node: int
    middle: Float
    heading: float
    depth: float
    width: float


def _on_carriageway(crossed: _Crossed, lanes: Sequence[LaneSurface]) -> _Laid:
    """Return a crossing that spans the carriageway of its street from edge to edge.

    Its width is measured where the lanes of the street are nearest: in the map, a junction may begin before it.
    """
    heading = math.atan2(crossed.along[1], crossed.along[0])
    aside = np.array([-crossed.along[1], crossed.along[0]])
    here = shapely.Point(crossed.middle)
    along_street = [
        shapely.make_valid(lane.polygon)
        for lane in lanes
        if _is_along(lane, heading) and lane.polygon.dwithin(here, MAX_AWAY + MAX_CROSSING_LENGTH / 2)
    ]
    if along_street:
        # The buffer closes seams between lanes; it is taken off the measured width again at the end.
        area = shapely.union_all(along_street).buffer(MAX_SEAM, join_style="mitre")
        nearest = shapely.get_coordinates(shapely.shortest_line(here, area))[1]
        # Move the section along the street to its nearest lanes, just beyond their end, and measure there. The crossing
        # itself keeps its place along the street, and moves sideways to the middle of the carriageway.
        shift = float((nearest - crossed.middle) @ crossed.along)
        middle = crossed.middle + (shift + math.copysign(MAX_SEAM, shift) * (shift != 0.0)) * crossed.along
        reach = MAX_CROSSING_LENGTH / 2 * aside
        across = shapely.LineString([middle - reach, middle + reach]).intersection(area)
        # Carriageways divided by an island give several sections, of which the nearest is crossed here.
        parts = [part for part in shapely.get_parts(across) if part.length > 2 * MAX_SEAM]
        part = min(parts, key=lambda one: float(one.distance(shapely.Point(middle))), default=None)
        if part is not None and part.dwithin(shapely.Point(middle), MAX_AWAY):
            centre = shapely.get_coordinates(part).mean(axis=0)
            moved = crossed.middle + float((centre - middle) @ aside) * aside
            return _Laid(crossed.node, moved, heading, crossed.depth, part.length - 2 * MAX_SEAM)
    return _Laid(crossed.node, crossed.middle, heading, crossed.depth, 2 * CROSSING_WIDTH)


def _is_along(lane: LaneSurface, heading: float) -> bool:
    """Return whether some part of a lane is parallel to a street heading."""
    x, y = np.diff((lane.left + lane.right)[:, :2], axis=0).T
    turns = np.arctan2(y, x) - heading
    return bool((np.abs(np.remainder(turns + math.pi / 2, math.pi) - math.pi / 2) < ALONG_STREET).any())


def _by_road(crossed: Sequence[_Laid], road_map: RoadMap) -> dict[str, list[RoadObject]]:
    """Return the crossings as road objects, by the id of the nearest road."""
    if not crossed:
        return {}
    roads = [road for road in road_map.roads if road.length > 0.0]
    places = [np.linspace(0.0, road.length, 2 + int(road.length / LINE_STEP)) for road in roads]
    lines = [shapely.LineString(road.frame(s).origin[:, :2]) for road, s in zip(roads, places, strict=True)]
    tree = shapely.STRtree(lines)
    found: dict[str, list[RoadObject]] = {}
    for one in crossed:
        point = shapely.Point(one.middle)
        index = int(tree.nearest(point))
        found.setdefault(roads[index].id, []).append(_object(one, roads[index], lines[index].project(point)))
    return found


def _object(crossed: _Laid, road: Road, s: float) -> RoadObject:
    frame = road.frame(np.array([s]))
    away = crossed.middle - frame.origin[0, :2]
    return RoadObject(
        id=f"crossing {crossed.node}",
        name="",
        kind=CROSSING,
        s=round(s, 4),
        t=round(float(away @ frame.level_left[0, :2]), 4),
        z_offset=0.0,
        heading=round(math.remainder(crossed.heading - float(frame.heading[0]), math.tau), 6),
        pitch=0.0,
        roll=0.0,
        length=round(crossed.depth, 3),
        width=round(crossed.width, 3),
        height=0.0,
        radius=0.0,
        outlines=(),
        repeats=(),
    )


def _kept(road: Road, mapped: BaseGeometry, joints: Collection[str]) -> Iterator[RoadObject]:
    """Yield the objects of a road except guessed crossings at joints and near mapped crossings."""
    for one in road.objects:
        if one.kind != CROSSING:
            yield one
        elif (of := _GUESSED_AT.fullmatch(one.id)) is not None and of[1] in joints:
            continue
        elif not mapped.dwithin(shapely.Point(road.place(np.array([one.s]), np.array([one.t]))[0, :2]), MAPPED_AROUND):
            yield replace(one, name=ASSUMED_CROSSING)


def _written(text: str, roads: Sequence[Road]) -> str:
    """Return the text of a map of netconvert with the crossings of `roads`."""
    objects = {road.id: road.objects for road in roads}

    def road_text(match: re.Match[str]) -> str:
        # Guessed crossings are removed from the text or marked by a name; mapped ones, which have no outline, are
        # added.
        kept = {one.id for one in objects[match[1]]}
        new = "".join(_element(one) for one in objects[match[1]] if not one.outlines)

        def crossings(part: re.Match[str]) -> str:
            content = part[0].removeprefix("<objects>").removesuffix("</objects>") * (not part[0].endswith("/>"))
            named = _GUESSED.sub(
                lambda one: one[0].replace('id="', f'name="{ASSUMED_CROSSING}" id="', 1) * (one[1] in kept), content
            )
            return f"<objects>{named}{new}</objects>" if named.strip() or new else "<objects/>"

        return _OBJECTS.sub(crossings, match[0], count=1)

    return _ROAD.sub(road_text, text)


def _element(crossing: RoadObject) -> str:
    return (
        f'<object id="{crossing.id}" type="{crossing.kind}" s="{crossing.s}" t="{crossing.t}" '
        f'hdg="{crossing.heading}" length="{crossing.length}" width="{crossing.width}"/>'
    )
