"""Pedestrian crossings of the streets of an extract: mapped crossings replace those that netconvert guesses."""

import itertools
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ..opendrive.lanes import LaneSurface
from ..opendrive.objects import PlacedObject
from ..streetscape.named_places import ASSUMED_CROSSING
from ..streetscape.road_surface import CARRIAGEWAY, MAX_SEAM, in_groups
from ..streetscape.street_map import StreetMap
from .extract import Extract, Tags, Way
from .network_map import crossing
from .plan_shapes import PlanShapes
from .quantities import metres
from .streets import StreetFile

CROSSING_WIDTH, MAX_CROSSING_WIDTH = 4.0, 15.0  # metres: of a crossing without a width, and of any
MAX_CROSSING_LENGTH = 30.0
MAPPED_AROUND = 40.0  # metres from a mapped crossing within which no crossing is guessed
MAX_AWAY = 15.0  # metres from a crossing to the lanes of its street: in the map these end where a junction begins
ALONG_STREET = math.radians(30.0)  # between a crossed street and its lanes
_GUESSED_AT = re.compile(r":(.*)_c\d+")
"""Id of a crossing that netconvert guesses: the name of its junction, and its number there."""


@dataclass(frozen=True, eq=False)
class Crossed:
    """A mapped crossing: its node, middle (2,), direction of the street (2,) and extent along it, metres."""

    node: int
    middle: Float
    along: Float
    depth: float


def with_mapped_crossings(streets: StreetMap, source: StreetFile, shapes: PlanShapes) -> StreetMap:
    """Return streets with the crossings of the extract.

    A guessed crossing remains where streets meet and the extract maps none nearby; its name marks it as assumed.

    Parameters
    ----------
    streets : StreetMap
        Streets of a network.
    source : StreetFile
        Streets that the network was made from.
    shapes : PlanShapes
        Shapes of the extract in map coordinates.
    """
    driven = [lane for lane in in_groups(streets.lanes, CARRIAGEWAY) if lane.junction_id is None]
    mapped = [_on_carriageway(one, driven) for one in crossed_places(source.ways.values(), shapes)]
    places = shapely.multipoints(np.array([one.position[:2] for one in mapped]).reshape(-1, 2))
    joints = {one.id for one in streets.junctions if one.is_joint}
    guessed = [
        replace(one, name=ASSUMED_CROSSING)
        for one in streets.road_map.objects
        # Crossings guessed where a street only continues have no evidence.
        if (found := _GUESSED_AT.fullmatch(one.id)) is not None
        and found[1] not in joints
        and not places.dwithin(shapely.Point(one.position[:2]), MAPPED_AROUND)
    ]
    return replace(streets, road_map=replace(streets.road_map, objects=(*mapped, *guessed)))


def guessed_crossings(streets: StreetMap, area: BaseGeometry) -> int:
    """Return the number of assumed crossings of streets in an area."""
    places = [shapely.Point(one.position[:2]) for one in streets.road_map.objects if one.name == ASSUMED_CROSSING]
    return int(shapely.intersects(area, places).sum())


def crossed_places(streets: Iterable[Way], shapes: PlanShapes) -> Iterator[Crossed]:
    """Yield the places where streets are crossed: nodes tagged as crossings, and nodes shared with a crossing way."""
    extract = shapes.extract
    widths = dict(_crossing_nodes(extract))
    ways = [way for way in streets if "highway" in way.tags]
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
                yield Crossed(number, middle, (after - before) / length, widths[number])


def _crossing_nodes(extract: Extract) -> Iterator[tuple[int, float]]:
    """Yield the nodes that are crossings, and the extent of each along the street, metres."""
    for way in extract.ways.values():
        if "crossing" in (way.tags.get(key) for key in ("footway", "cycleway", "path")):
            yield from ((number, crossing_width(way.tags)) for number in way.nodes)
    for number, node in extract.nodes.items():
        if node.tags.get("highway") == "crossing" and node.tags.get("crossing") != "no":
            yield number, crossing_width(node.tags)


def crossing_width(tags: Tags) -> float:
    """Return the width of a crossing along the street, metres."""
    return metres(tags.get("width"), MAX_CROSSING_WIDTH) or CROSSING_WIDTH


def _on_carriageway(crossed: Crossed, lanes: Sequence[LaneSurface]) -> PlacedObject:
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
            return _crossing(crossed, moved, part.length - 2 * MAX_SEAM)
    return _crossing(crossed, crossed.middle, 2 * CROSSING_WIDTH)


def _crossing(crossed: Crossed, middle: Float, width: float) -> PlacedObject:
    across = width / 2 * np.array([-crossed.along[1], crossed.along[0]])
    return crossing(f"crossing {crossed.node}", "", np.array([middle - across, middle + across]), crossed.depth)


def _is_along(lane: LaneSurface, heading: float) -> bool:
    """Return whether some part of a lane is parallel to a street heading."""
    x, y = np.diff((lane.left + lane.right)[:, :2], axis=0).T
    turns = np.arctan2(y, x) - heading
    return bool((np.abs(np.remainder(turns + math.pi / 2, math.pi) - math.pi / 2) < ALONG_STREET).any())
