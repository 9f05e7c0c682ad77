"""Removal of objects of an extract from the carriageway, where they would block the view of the road."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TypeVar

import shapely
from shapely.geometry.base import BaseGeometry

from ...geometry.plan import without
from ...site.scene_geometry import DESCRIBED
from .description import Building, Poles, SiteDescription, Slab, Trees, Wall

CLEARANCE = 4.5  # metres above the road from which on objects may extend over it
NEAR_EDGE = 3.0  # metres inside the carriageway up to which trees and posts are moved to its edge
SETBACK = 0.2  # metres that they then stand from it
MAX_IN_LANE = 0.5  # metres inside the carriageway up to which a post is taken to stand at its edge
MIN_OVERLAP, MIN_REST = 0.1, 2.0  # m²: smaller overlaps with the carriageway are ignored, smaller rests left out

_CLIPPED = "buildings cut off at the edge of the carriageway, which they overlapped"
_MOVED = f"trees and posts moved to the edge of the carriageway, from up to {NEAR_EDGE:g} m inside it"
_IN_LANE = f"posts that carry no sensor, because the map has them in a lane, more than {MAX_IN_LANE:g} m from its edge"
_DROPPED = "trees and posts left out, because they stood in the middle of the carriageway"
_CUT = "walls, fences and shelters cut off at the edge of the carriageway, which they crossed"

Row = TypeVar("Row", Trees, Poles)
Solid = TypeVar("Solid", Building, Slab)


def clear(
    description: SiteDescription, carriageway: BaseGeometry, mouths: BaseGeometry
) -> tuple[SiteDescription, tuple[str, ...]]:
    """Return a description without objects on the carriageway, except those from a site file, and notes.

    Parameters
    ----------
    description : SiteDescription
        Description to clear.
    carriageway : shapely geometry
        Carriageway on the studied level, in the axes of the description.
    mouths : shapely geometry
        Lines across it where the road continues.
    """
    shapely.prepare(carriageway)
    lanes = carriageway.buffer(-MAX_IN_LANE)
    # Objects move to the sides of the road only, never to the end of the modelled carriageway.
    sides = without(shapely.boundary(carriageway.buffer(SETBACK)), mouths.buffer(2 * SETBACK))
    counted = Counter[str]()

    def at_edge(rows: Sequence[Row]) -> tuple[Row, ...]:
        return tuple(_beside(row, carriageway, sides, counted) for row in rows)

    def posts(rows: Sequence[Poles]) -> tuple[Poles, ...]:
        return at_edge(tuple(_split_at_lanes(rows, lanes, counted)))

    cleared = replace(
        description,
        buildings=tuple(_clipped(description.buildings, carriageway, counted, _CLIPPED)),
        trees=at_edge(description.trees),
        walls=tuple(_cut(description.walls, carriageway, counted)),
        street_lights=posts(description.street_lights),
        signal_poles=posts(description.signal_poles),
        slabs=tuple(_clipped(description.slabs, carriageway, counted, _CUT)),
        posts=posts(description.posts),
    )
    return cleared, tuple(
        f"{reason}: {counted[reason]}" for reason in (_CLIPPED, _CUT, _MOVED, _IN_LANE, _DROPPED) if counted[reason]
    )


def _split_at_lanes(rows: Sequence[Poles], lanes: BaseGeometry, counted: Counter[str]) -> Iterator[Poles]:
    """Yield posts; those in a lane become rows that carry no sensors, because their real position is unknown."""
    for row in rows:
        inside = shapely.intersects_xy(lanes, row.positions)
        if row.source == DESCRIBED or not inside.any():
            yield row
            continue
        counted[_IN_LANE] += int(inside.sum())
        yield replace(row, positions=row.positions[inside], carries=False)
        yield replace(row, positions=row.positions[~inside])


def _beside(row: Row, carriageway: BaseGeometry, sides: BaseGeometry, counted: Counter[str]) -> Row:
    """Return a row of trees or posts with those on the carriageway moved to lines next to it, or left out."""
    inside = shapely.intersects_xy(carriageway, row.positions)
    if row.source == DESCRIBED or not inside.any():
        return row
    places, lost = row.positions.copy(), inside.copy()
    ways = shapely.shortest_line(shapely.points(places[inside]), sides)
    places[inside] = shapely.get_coordinates(ways)[1::2]
    lost[inside] = shapely.length(ways) > NEAR_EDGE + SETBACK
    counted[_DROPPED] += int(lost.sum())
    counted[_MOVED] += int((inside & ~lost).sum())
    return replace(row, positions=places[~lost])


def _clipped(solids: Sequence[Solid], carriageway: BaseGeometry, counted: Counter[str], reason: str) -> Iterator[Solid]:
    for solid in solids:
        on_road = solid.base < CLEARANCE and carriageway.intersects(solid.outline)
        if solid.source == DESCRIBED or not on_road or carriageway.intersection(solid.outline).area < MIN_OVERLAP:
            yield solid
            continue
        counted[reason] += 1
        for rest in shapely.get_parts(without(solid.outline, carriageway)):
            if rest.geom_type == "Polygon" and rest.area >= MIN_REST:
                yield replace(solid, outline=rest)


def _cut(walls: Sequence[Wall], carriageway: BaseGeometry, counted: Counter[str]) -> Iterator[Wall]:
    for wall in walls:
        line = shapely.LineString(wall.line)
        if wall.source == DESCRIBED or not carriageway.intersects(line):
            yield wall
            continue
        counted[_CUT] += 1
        for rest in shapely.get_parts(without(line, carriageway)):
            if rest.length > SETBACK:
                yield replace(wall, line=shapely.get_coordinates(rest))
