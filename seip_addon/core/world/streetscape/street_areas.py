"""Areas in plan of the surfaces of a street, from the lanes and junctions of a network.

A network has lanes as strips that end where a junction begins, and junctions as areas. Their union, with small gaps
closed, is the carriageway; all other surfaces are what is left of their lanes outside it.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...geometry.plan import closed, opened, united, without
from ..opendrive.lanes import LaneSurface
from ..opendrive.road_map import Road
from .description import SideWay
from .road_surface import (
    CARRIAGEWAY,
    MAX_SEAM,
    Roadside,
    by_road,
    in_groups,
    inner_edge,
    outer_edge,
    roadside,
    side_pieces,
    with_rows_at,
    without_crumbs,
)
from .street_map import JunctionArea

NOTHING = shapely.Polygon()
MIN_HOLE = 0.01  # m²: smaller holes are rounding
MIN_ROAD_AREA = 5.0  # m²: smaller parts of a carriageway are crumbs
MAX_REFUGE = 60.0  # m²: smaller holes of a carriageway at junctions are where its lanes leave gaps
TOLERANCE = 0.02  # metres: corners of outlines nearer to the line between their neighbours are left out
GAP = 0.5  # metres: gaps up to twice this between lanes and junctions are closed
AROUND_JUNCTION = 3.0  # metres from a junction within which such gaps lie
MIN_ISLAND_AREA = 15.0  # m²: smaller holes of the carriageway are not islands
SMALL_NOTCH = 1.25  # metres: notches of a pavement up to twice this are closed
SPIKE = 0.1  # metres: narrower parts of outlines are left out
MIN_PAVEMENT_WIDTH = 0.6  # metres: narrower parts of pavements are left out
PAVEMENT_WIDTH = 2.5  # metres of pavement along the carriageway of a junction
RATE = 10.0  # metres along the road for each metre that it widens where a lane is added
MIN_JUMP, MAX_JUMP = 0.5, 8.0  # metres: smaller jumps of an edge need no taper, larger ones are not added lanes
MAX_SHARE = 0.9  # largest share of a road's length that its taper takes
MIN_MEDIAN = 4.0  # metres that remain to the next carriageway: otherwise a median would be closed
TAPER_STEP = 5.0  # metres between the rows of a taper
MIN_ASSUMED = 15.0  # m²: smaller rests of assumed pavements between mapped ones are left out
MAX_MAPPED = 12.0  # metres from the carriageway to a mapped sidewalk that is the pavement of its street


@dataclass(frozen=True, eq=False)
class StreetAreas:
    """Areas in plan of the surfaces of a street, none of which overlap.

    Parameters
    ----------
    groups : mapping of str to shapely geometry
        Area of each group of lanes of the carriageway.
    pavement : shapely geometry
        Pavements next to it.
    roadside : Roadside
        Carriageway and its sides.
    inside : shapely geometry
        Area of the junctions, without those where a street only continues.
    """

    groups: Mapping[str, BaseGeometry]
    pavement: BaseGeometry
    roadside: Roadside
    inside: BaseGeometry

    @cached_property
    def whole(self) -> BaseGeometry:
        """Carriageway and pavements, with seams between them closed."""
        return closed(united([self.roadside.carriageway, self.pavement]), MAX_SEAM)


def street_areas(
    lanes: Sequence[LaneSurface],
    junctions: Sequence[JunctionArea],
    roads: Sequence[Road],
    ways: Sequence[SideWay] = (),
    built_up: BaseGeometry = NOTHING,
) -> StreetAreas:
    """Return the areas of a street on one level.

    Parameters
    ----------
    lanes : sequence of LaneSurface
        Lanes of the level.
    junctions : sequence of JunctionArea
        Junctions of the map in the same axes; only those of the lanes count.
    roads : sequence of Road
        Roads of the map.
    ways : sequence of SideWay
        Ways next to the road. Where a sidewalk among them runs along a street, no pavement is assumed.
    built_up : shapely geometry, optional
        Area of buildings, where no pavement lies.
    """
    there = {lane.road_id for lane in lanes}
    junctions = [one for one in junctions if there & one.roads]
    widened = list(tapers(lanes, junctions, roads))
    strips = {
        group: united(lane.polygon for lane in in_groups(lanes, [group]) if lane.junction_id is None)
        for group in CARRIAGEWAY
    }
    carriageway = _carriageway([*strips.values(), *(one.road for one in widened)], junctions)
    inside = united(one.carriageway for one in junctions if not one.is_joint)
    side = roadside(lanes, carriageway)
    walked = _walked(lanes, junctions, widened, carriageway)
    # A mapped line within the carriageway says no more than that the pavement is narrow: the assumed one stays there.
    sidewalks = [(shapely.LineString(one.line), one.width) for one in ways if one.line is not None]
    lines = united(line for line, _ in sidewalks)
    lines = without(lines, carriageway.buffer(GAP))
    strips_mapped = (line.buffer(width / 2, cap_style="flat") for line, width in sidewalks)
    mapped = united(area for area in strips_mapped if area.dwithin(carriageway, MAX_MAPPED))
    # What lies between carriageways or on an island of the street is no pavement unless it is mapped as one.
    assumed = without(_filled(walked, carriageway), united([_towards(side, lines), medians(side)]))
    assumed = opened(assumed, MIN_PAVEMENT_WIDTH)
    assumed = without_crumbs(assumed, least=MIN_ASSUMED) if sidewalks else assumed
    pavement = without(united([assumed, _at_kerb(mapped, carriageway)]), carriageway)
    pavement = opened(without(pavement, built_up), SPIKE)
    return StreetAreas(dict(_groups(strips, carriageway, inside)), without_crumbs(pavement), side, inside)


def _carriageway(strips: Sequence[BaseGeometry], junctions: Sequence[JunctionArea]) -> BaseGeometry:
    """Return the union of strips and junctions, with gaps closed where they meet and small holes filled."""
    # Without corners that are hardly any: mitred buffers make spikes of these.
    area = closed(united([*strips, *(one.carriageway for one in junctions)]), MAX_SEAM).simplify(TOLERANCE)
    around = united(one.carriageway.buffer(AROUND_JUNCTION) for one in junctions)
    gaps = without(closed(area, GAP, "round"), area).intersection(around)
    whole = without_crumbs(united([area, gaps]), least=MIN_HOLE)
    holes = [shapely.Polygon(ring) for part in shapely.get_parts(whole) for ring in part.interiors]
    near = around.buffer(AROUND_JUNCTION)
    islands = [one for one in holes if one.area < (MAX_REFUGE if near.covers(one) else MIN_ISLAND_AREA)]
    return without_crumbs(united([whole, *islands]).simplify(TOLERANCE), least=MIN_ROAD_AREA)


def medians(side: Roadside) -> BaseGeometry:
    """Return the islands and medians of a carriageway; small gaps are corners."""
    between = shapely.get_parts(without(side.filled, side.carriageway))
    return united(part for part in between if part.area >= MIN_ISLAND_AREA)


def _groups(
    strips: Mapping[str, BaseGeometry], carriageway: BaseGeometry, inside: BaseGeometry
) -> Iterator[tuple[str, BaseGeometry]]:
    """Yield the area of each group of lanes: driving lanes come first, and have what no other lane covers."""
    taken = united([strips["driving"], inside])
    others = {}
    for group, area in strips.items():
        if group != "driving" and not area.is_empty:
            others[group] = without_crumbs(without(area.intersection(carriageway), taken))
            taken = united([taken, others[group]])
    yield "driving", without(carriageway, united(others.values()))
    yield from others.items()


def _walked(
    lanes: Sequence[LaneSurface],
    junctions: Sequence[JunctionArea],
    widened: Sequence["_Taper"],
    carriageway: BaseGeometry,
) -> BaseGeometry:
    """Return the pavements along the lanes and, in junctions, along the carriageway."""
    corners = united(one.walking for one in junctions).intersection(carriageway.buffer(PAVEMENT_WIDTH))
    strips = [lane.polygon for lane in in_groups(lanes, ["sidewalk"])]
    return united([*strips, corners, *(one.pavement for one in widened)])


def _filled(pavement: BaseGeometry, carriageway: BaseGeometry) -> BaseGeometry:
    """Return pavements outside the carriageway with small notches closed."""
    notches = without(closed(united([pavement, carriageway]), SMALL_NOTCH, "round"), carriageway)
    return without(united([pavement, notches.intersection(pavement.buffer(SMALL_NOTCH))]), carriageway)


def _at_kerb(mapped: BaseGeometry, carriageway: BaseGeometry) -> BaseGeometry:
    """Return mapped sidewalks, with narrow gaps between them and the carriageway closed."""
    street = united([mapped, carriageway])
    return united([mapped, without(closed(street, GAP, "round"), street).intersection(mapped.buffer(2 * GAP))])


def _towards(side: Roadside, mapped: BaseGeometry) -> BaseGeometry:
    """Return the ground from the carriageway to the mapped sidewalks along it, whose lines are given."""
    if mapped.is_empty:
        return mapped
    start, stop, outwards = side_pieces(side)
    beyond = MAX_MAPPED * outwards
    strips = shapely.polygons(np.stack([start, stop, stop + beyond, start + beyond], axis=1))
    shapely.prepare(mapped)
    return united(strips[shapely.intersects(mapped, strips)])


@dataclass(frozen=True, eq=False)
class _Taper:
    """Widening of a road towards a joint: the area that it adds, and the pavement beyond it."""

    road: BaseGeometry
    pavement: BaseGeometry


def tapers(lanes: Sequence[LaneSurface], junctions: Iterable[JunctionArea], roads: Sequence[Road]) -> Iterator[_Taper]:
    """Yield the tapers where a street gets more lanes or wider ones, along its narrower road; see `street_areas`."""
    joints = {one.id for one in junctions if one.is_joint}
    through = [road for road in roads if road.junction_id in joints and road.predecessor and road.successor]
    pairs = [(road.predecessor.id, road.successor.id) for road in through if road.predecessor and road.successor]
    # A slip road that leaves or joins a street is no other part of it.
    starts, stops = (Counter(ends) for ends in zip(*pairs, strict=True)) if pairs else (Counter[str](), Counter[str]())
    own = by_road([lane for lane in lanes if lane.lane_type])
    paved = {road: [lane for lane in group if lane in in_groups(group, CARRIAGEWAY)] for road, group in own.items()}
    outside = {road.id for road in roads if road.junction_id is None}
    areas = {road: united(lane.polygon for lane in group) for road, group in paved.items() if road in outside}
    for before, after in pairs:
        if not paved.get(before) or not paved.get(after) or starts[before] > 1 or stops[after] > 1:
            continue
        for outer in (True, False):
            ends = _edge_end(paved[before], -1, outer=outer), _edge_end(paved[after], 0, outer=outer)
            aside = ends[0][1] + ends[1][1]
            jump = float((ends[1][0] - ends[0][0]) @ aside / max(np.hypot(*aside), 1e-9))
            if not MIN_JUMP <= abs(jump) <= MAX_JUMP:
                continue
            narrow, row, (edge, out), (far, _) = (before, -1, *ends) if jump > 0 else (after, 0, *ends[::-1])
            # A median to another carriageway stays open.
            beyond = shapely.LineString([edge + MIN_JUMP * out, edge + (abs(jump) + MIN_MEDIAN) * out])
            if not any(beyond.intersects(area) for one, area in areas.items() if one not in (before, after)):
                yield _taper(own[narrow], row, abs(jump), far, outer=outer)


def _outermost(lanes: Sequence[LaneSurface], *, outer: bool) -> LaneSurface:
    return (max if outer else min)(lanes, key=lambda lane: abs(lane.lane_id))


def _edge_end(lanes: Sequence[LaneSurface], row: int, *, outer: bool) -> tuple[Float, Float]:
    """Return the end of an edge of a carriageway (2,), and the direction away from the carriageway (2,)."""
    lane = _outermost(lanes, outer=outer)
    edge, other = (outer_edge(lane), inner_edge(lane)) if outer else (inner_edge(lane), outer_edge(lane))
    away = edge[row, :2] - other[row, :2]
    return edge[row, :2], away / max(float(np.hypot(*away)), 1e-9)


def _taper(lanes: Sequence[LaneSurface], row: int, jump: float, far: Float, *, outer: bool) -> _Taper:
    """Return the taper of a road by ``jump`` metres at its start (0) or end (-1), and on to the wider at ``far``."""
    lane = _outermost(in_groups(lanes, CARRIAGEWAY), outer=outer)
    whole = float(lane.s[-1] - lane.s[0])
    length = min(RATE * jump, MAX_SHARE * whole)
    lane = with_rows_at(lane, lane.s[row] + np.arange(-length, length + TAPER_STEP, TAPER_STEP))
    edge, other = (outer_edge(lane), inner_edge(lane)) if outer else (inner_edge(lane), outer_edge(lane))
    aside = (edge - other)[:, :2]
    aside /= np.maximum(np.hypot(*aside.T), 1e-9)[:, None]
    by = jump * np.clip(1.0 - np.abs(lane.s - lane.s[row]) / length, 0.0, 1.0)[:, None]
    widened = edge[:, :2] + by * aside
    # Through the joint the widened edge leads straight to that of the wider road.
    at = len(widened) if row else 0
    widened, aside = np.insert(widened, at, far, axis=0), np.insert(aside, at, aside[row], axis=0)
    walked = [one for one in in_groups(lanes, ["sidewalk"]) if outer]
    width = max((float(np.hypot(*(one.left - one.right)[row, :2])) for one in walked), default=0.0)
    beyond = shapely.Polygon([*widened, *(widened + width * aside)[::-1]]) if width else shapely.Polygon()
    near = shapely.Point(lane.left[row, :2]).buffer(length + 2 * MAX_JUMP)
    road = shapely.Polygon([*edge[:, :2], *widened[::-1]])
    return _Taper(shapely.make_valid(road), shapely.make_valid(beyond).intersection(near))
