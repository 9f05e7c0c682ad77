"""Intersections of maps made from centre lines of streets, in which one intersection has several junctions.

SUMO's netconvert makes a junction wherever two ways meet or a lane begins, and several where the carriageways of two
wide streets cross.
"""

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import shapely
from shapely.affinity import rotate
from shapely.geometry.base import BaseGeometry

from ...geometry.plan import closed, united
from ..opendrive.junctions import junction_area
from ..opendrive.lanes import LaneSurface
from ..opendrive.road_map import Road

SAME_DIRECTION = math.radians(40.0)  # roads whose ends differ by less lead the same way
TOUCH = 0.5  # metres between a junction and the end of a road that meets it at most
JOINT = 1.0  # metres: gaps up to twice this between the lanes of a ring are closed
JUNCTION_REACH = 20.0  # metres between two junctions of one intersection at most
PARALLEL = math.radians(15.0)  # largest angle between the carriageways of a street
MAX_MEDIAN = 22.0  # metres between the middles of lanes of two carriageways of one street at most
MAX_INTERSECTION = 45.0  # metres from the junction in the middle to the farthest of an intersection at most


def intersection(
    surfaces: Sequence[LaneSurface], junction_id: str, roundabouts: Iterable[frozenset[str]] = ()
) -> frozenset[str]:
    """Return the ids of the junctions that form one intersection with a given junction.

    Parameters
    ----------
    surfaces : sequence of LaneSurface
        Lanes of the map.
    junction_id : str
        Id of the junction in the middle.
    roundabouts : iterable of frozenset of str
        Junction ids of each roundabout.
    """
    areas = _areas(surfaces)
    if junction_id not in areas:
        return frozenset({junction_id})
    # A junction of a roundabout stands for the whole roundabout, however large. The limit on the size of the
    # intersection then counts from its middle and includes it.
    found = {junction_id}.union(*(one & areas.keys() for one in roundabouts if junction_id in one))
    middle = shapely.union_all([areas[number] for number in found]).centroid
    away = max(areas[number].centroid.distance(middle) for number in found)
    most = max(MAX_INTERSECTION, away + JUNCTION_REACH)
    # Flood fill over junctions that are near each other. Without the limit on the distance from the middle, a row of
    # close junctions along a street would grow into one intersection.
    waiting = sorted(found)
    while waiting:
        area = areas[waiting.pop()]
        near = {
            number
            for number, other in areas.items()
            if number not in found
            and area.distance(other) <= JUNCTION_REACH
            and other.centroid.distance(middle) <= most
        }
        found |= near
        waiting += sorted(near)
    return frozenset(found)


def ring_roads(
    roads: Iterable[Road], roundabouts: Iterable[frozenset[str]], junctions: frozenset[str] | None = None
) -> frozenset[str]:
    """Return the ids of the roads that form the rings of roundabouts.

    Parameters
    ----------
    roads : iterable of Road
        Roads of the map.
    roundabouts : iterable of frozenset of str
        Junction ids of each roundabout.
    junctions : frozenset of str, optional
        Junctions of an intersection; roundabouts without any of these do not count.
    """
    rings = [one for one in roundabouts if junctions is None or one & junctions]

    def in_ring(road: Road, ring: frozenset[str]) -> bool:
        # Part of the ring: within one of its junctions, or between two of them.
        ends = (road.predecessor, road.successor)
        return road.junction_id in ring or all(end is not None and end.id in ring for end in ends)

    return frozenset(road.id for road in roads if any(in_ring(road, ring) for ring in rings))


def enclosed(ring: Iterable[BaseGeometry]) -> BaseGeometry:
    """Return what the areas of the lanes of a ring enclose."""
    area = closed(united(ring), JOINT)
    return united(shapely.Polygon(hole) for part in _polygons(area) for hole in part.interiors)


def _polygons(area: BaseGeometry) -> list[shapely.Polygon]:
    return [part for part in shapely.get_parts(area) if part.geom_type == "Polygon"]


def with_other_carriageways(
    lanes: Sequence[LaneSurface], surfaces: Sequence[LaneSurface], names: Mapping[str, str]
) -> BaseGeometry:
    """Return the area of lanes together with the opposite carriageways of their streets next to them.

    A street whose directions lie next to each other is not an opposite carriageway of another street, and a street with
    a different name that runs parallel is not a link between two carriageways.

    Parameters
    ----------
    lanes : sequence of LaneSurface
        Some driving lanes.
    surfaces : sequence of LaneSurface
        All driving lanes.
    names : mapping of str to str
        Names of the streets by the ids of their roads.
    """
    area = united(lane.polygon for lane in lanes)
    # Bands on both sides of the given lanes, as wide as a median may be, for each street name: the opposite carriageway
    # lies within them. Closing fills the gaps between bands at junctions, where lanes have no band.
    bands: dict[str, list[tuple[BaseGeometry, float]]] = {}
    for lane in lanes:
        middle = (lane.left[:, :2] + lane.right[:, :2]) / 2
        if names.get(lane.road_id) and lane.junction_id is None and np.ptp(middle, axis=0).max() > 0:
            # Flat caps end the band with its lane, so that it does not reach into other arms of the junction.
            band = shapely.LineString(middle).buffer(MAX_MEDIAN, cap_style="flat")
            bands.setdefault(names[lane.road_id], []).append((band, _heading(lane)))
    # A road with its opposite direction right next to it is a whole street, not one carriageway of a divided one; if
    # that direction is among the given lanes, this one is the other half of their street.
    facing, given = _facing_roads(surfaces), {lane.road_id for lane in lanes}
    sides = {name: closed(united(band for band, _ in own), JUNCTION_REACH) for name, own in bands.items()}
    # Opposite carriageways: one-way roads of the same name, parallel to a lane whose band they meet. They are clipped
    # to the bands, so that they end where the given lanes end.
    others = [
        # Headings are compared modulo 180 degrees below, because the opposite carriageway leads the other way.
        shapely.make_valid(lane.polygon).intersection(sides[names[lane.road_id]])
        for lane in surfaces
        if (lane.road_id not in facing or facing[lane.road_id] & given)
        and any(
            abs(math.remainder(_heading(lane) - heading, math.pi)) < PARALLEL and band.intersects(lane.polygon)
            for band, heading in bands.get(names.get(lane.road_id, ""), ())
        )
    ]
    streets = united([area, *others])
    headings = [heading for own in bands.values() for _, heading in own]
    # Links across the median: lanes that begin and end at these carriageways, such as turns within a junction.
    links = [
        lane.polygon
        for lane in surfaces
        if names.get(lane.road_id) not in bands
        and not (names.get(lane.road_id) and _runs_along(lane, headings))
        and leads_between(lane, streets)
    ]
    return united([streets, united(links).intersection(united(sides.values()))])


def _facing_roads(surfaces: Sequence[LaneSurface]) -> dict[str, set[str]]:
    """Return the roads in the opposite direction on whose inner edge a one-way road lies, by the ids of such roads."""
    # The inner edge of the innermost lane is the centre line of a street whose directions are not divided: there both
    # roads touch. Comparing the middles of edges keeps out roads that only meet end to end.
    innermost: dict[str, LaneSurface] = {}
    for lane in surfaces:
        found = innermost.get(lane.road_id)
        if lane.junction_id is None and (found is None or abs(lane.lane_id) < abs(found.lane_id)):
            innermost[lane.road_id] = lane
    edges = [shapely.LineString((lane.right if lane.lane_id > 0 else lane.left)[:, :2]) for lane in innermost.values()]
    roads = list(innermost)
    middles = [edge.interpolate(0.5, normalized=True) for edge in edges]
    one, other = shapely.STRtree(edges).query(middles, predicate="dwithin", distance=TOUCH)
    facing: dict[str, set[str]] = {}
    for a, b in zip(one.tolist(), other.tolist(), strict=True):
        turn = math.remainder(_heading(innermost[roads[a]]) - _heading(innermost[roads[b]]), math.tau)
        if a != b and abs(turn) > math.pi / 2:
            facing.setdefault(roads[a], set()).add(roads[b])
    return facing


def _runs_along(lane: LaneSurface, headings: Iterable[float]) -> bool:
    """Return whether a lane is longer than a median is wide, and nearly parallel to one of the headings."""
    length = float(np.hypot(*(lane.left[-1] - lane.left[0])[:2]))
    own = _heading(lane)
    is_parallel = any(abs(math.remainder(own - heading, math.pi)) < SAME_DIRECTION for heading in headings)
    return length > MAX_MEDIAN and is_parallel


def box_along(area: BaseGeometry, lanes: Iterable[LaneSurface]) -> BaseGeometry:
    """Return the smallest rectangle around a junction's area that is aligned with one of its roads."""
    meeting = [
        lane
        for lane in lanes
        if lane.junction_id is None and lane.polygon.distance(area) < TOUCH and not leads_between(lane, area)
    ]
    # Turn the area so that a road lies along x, take its bounding box and turn that back. The rectangle of least area
    # overall would lie askew to all roads where the area is irregular.
    boxes = [
        rotate(shapely.envelope(rotate(area, -heading, (0, 0), use_radians=True)), heading, (0, 0), use_radians=True)
        for heading in map(_heading, meeting)
    ]
    return min(boxes, key=lambda box: float(box.area), default=shapely.minimum_rotated_rectangle(area))


def leads_between(lane: LaneSurface, area: BaseGeometry) -> bool:
    """Return whether a lane begins and ends at an area."""
    ends = [shapely.Point((lane.left[row, :2] + lane.right[row, :2]) / 2) for row in (0, -1)]
    return all(area.distance(end) < TOUCH for end in ends)


def _heading(lane: LaneSurface) -> float:
    """Return the direction from the start of a lane to its end, radians."""
    x, y = (lane.left[-1] + lane.right[-1] - lane.left[0] - lane.right[0])[:2].tolist()
    return math.atan2(y, x)


def _areas(surfaces: Sequence[LaneSurface]) -> dict[str, BaseGeometry]:
    """Return the area of each junction, by its id."""
    lanes: dict[str, list[LaneSurface]] = {}
    for lane in surfaces:
        if lane.junction_id is not None:
            lanes.setdefault(lane.junction_id, []).append(lane)
    return {number: junction_area(own, number) for number, own in lanes.items()}
