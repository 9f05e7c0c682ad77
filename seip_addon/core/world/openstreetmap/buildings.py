"""Buildings of an extract: footprints, parts and heights.

Heights follow the Simple 3D Buildings scheme of the OpenStreetMap wiki: ``height`` is the height of the ridge,
``min_height`` that of the foot of the walls, and parts replace the outline that contains them. Roofs are flat, at the
height of the ridge.
"""

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...geometry.plan import without
from ...site.scene_geometry import FROM_EXTRACT
from ..streetscape.clearing import CLEARANCE
from ..streetscape.description import Building
from .extract import Relation, Tags, Way
from .plan_shapes import DRAWN_TWICE, PlanShapes, polygons
from .quantities import count, metres

STOREY = 3.0  # metres
MAX_HEIGHT, MAX_LEVELS = 900.0, 200.0
LOW_BUILDINGS = {
    **dict.fromkeys(("garage", "garages", "carport", "shed", "hut", "kiosk", "service", "container", "cabin"), 2.8),
    **dict.fromkeys(("roof", "canopy"), 4.5),
    **dict.fromkeys(("house", "detached", "semidetached_house", "bungalow", "terrace", "farm"), 7.0),
    **dict.fromkeys(("greenhouse", "toilets", "transformer_tower", "static_caravan"), 3.0),
}
"""Heights (metres) that are assumed for kinds of buildings that are similar everywhere."""
USUAL_HEIGHT = 9.0  # metres: assumed height of other buildings if too few heights in the extract are known
MIN_KNOWN = 5  # buildings of known height from which on their median is assumed for others
NO_BUILDINGS = {"no", "none", "proposed", "construction", "ruins", "demolished", "razed", "abandoned:building"}
NO_PARTS = {"no", "balcony", "steps", "ramp", "base"}
SLAB = 0.4  # metres: thickness of a roof that stands on posts
USUAL_ROOF = 2.5  # metres: height of a pitched roof without one
PASSAGE_REACH = 8.0  # metres from the middle of a street through a building to the edge of its carriageway at most
FULLY_PARTED = 0.1  # share of an outline outside its parts from which on the rest is a separate building
_NOWHERE = shapely.Polygon()


@dataclass(frozen=True, eq=False)
class _Footprint:
    area: BaseGeometry
    tags: Tags
    is_part: bool


def buildings(shapes: PlanShapes, area: BaseGeometry, passages: BaseGeometry = _NOWHERE) -> list[Building]:
    """Return the buildings that reach into an area.

    Parameters
    ----------
    area, passages : shapely geometry
        Areas in map coordinates; passages are carriageways over which buildings begin at `CLEARANCE`.
    """
    found = [one for one in _footprints(shapes) if one.area.intersects(area)]
    usual = _usual_height([one.tags for one in found])
    parts = [one for one in found if one.is_part]
    tree = shapely.STRtree([part.area for part in parts])
    solids = []
    for one in found:
        body = one.area
        # Parts describe a building in detail, so the outline around them only remains where no part covers it. A part
        # belongs to an outline that contains more than half of it: mapped edges do not match exactly. A part that
        # begins at the top of the outline, such as a tower, stands on it.
        if not one.is_part and parts:
            top = known_height(one.tags) or math.inf
            within = [
                parts[index].area
                for index in tree.query(one.area, predicate="intersects")
                if parts[index].area.intersection(one.area).area > 0.5 * parts[index].area.area
                and _foot(parts[index].tags) < top
            ]
            if within:
                body = one.area.difference(shapely.union_all(within))
                if body.area < FULLY_PARTED * one.area.area:
                    continue
        # A building over a passage is split in plan: outside the passage it stands on the ground, over it at a height.
        above = body.intersection(passages)
        for piece, least in ((body if above.is_empty else without(body, passages), 0.0), (above, CLEARANCE)):
            solids += [_building(part, one.tags, usual, least, is_part=one.is_part) for part in polygons(piece)]
    return [solid for solid in solids if solid is not None]


def passages(shapes: PlanShapes, carriageway: BaseGeometry, strips: Sequence[BaseGeometry] = ()) -> BaseGeometry:
    """Return the part of the carriageway that leads through buildings, with that of ways next to it.

    Parameters
    ----------
    carriageway : shapely geometry
        Map coordinates.
    strips : sequence of shapely geometry
        Areas of footways, cycle tracks and driveways that lead through buildings.
    """
    lines = [
        shapes.line(way)
        for way in shapes.extract.ways.values()
        if "highway" in way.tags and way.tags.get("tunnel") == "building_passage"
    ]
    bands = [shapely.LineString(line).buffer(PASSAGE_REACH, cap_style="square") for line in lines if len(line) > 1]
    return shapely.union_all([carriageway.intersection(shapely.union_all(bands)), *strips])


def _footprints(shapes: PlanShapes) -> Iterator[_Footprint]:
    extract = shapes.extract
    drawn: set[int] = set()  # ways that are the outlines of relations
    known: set[tuple[object, ...]] = set()
    everything: list[Mapping[int, Way | Relation]] = [extract.relations, extract.ways]
    # Relations come first, so that the ways that form their outlines are not read as further buildings.
    for elements in everything:
        for number, element in elements.items():
            tags = element.tags
            if isinstance(element, Relation):
                outlines = {ref for member, ref, role in element.members if member == "way" and role != "inner"}
                if tags.get("type") != "multipolygon":
                    continue
                if _kind(tags) is None:
                    tags = _tags_of_outlines(shapes, outlines)
            kind = _kind(tags)
            if kind is None or (number in drawn and isinstance(element, Way)):
                continue
            area = shapes.footprint(element)
            if area is None:
                continue
            if isinstance(element, Relation):
                drawn |= outlines
            # Parts, and buildings on others, may stand on one outline at different heights.
            foot, top = _foot(tags), known_height(tags) if kind == "part" else None
            same = (kind, foot, top, area.normalize().wkb)
            if same in known:
                shapes.dropped[DRAWN_TWICE] += 1
                continue
            known.add(same)
            yield _Footprint(area, tags, kind == "part")


def _tags_of_outlines(shapes: PlanShapes, outlines: Collection[int]) -> Tags:
    """Return the tags of the outlines of a multipolygon without own tags, as in older data; empty if they differ."""
    ways = [shapes.extract.ways[number].tags for number in outlines if number in shapes.extract.ways]
    return ways[0] if ways and all(tags == ways[0] for tags in ways) else {}


def _kind(tags: Tags) -> str | None:
    """Return ``building`` or ``part``; None for elements that are neither, or underground."""
    if tags.get("location") == "underground" or re.fullmatch(r"-[1-9]\d*", tags.get("layer", "")):
        return None
    if tags.get("building:part", "no") not in NO_PARTS:
        return "part"
    return "building" if tags.get("building", "no") not in NO_BUILDINGS else None


def known_height(tags: Tags) -> float | None:
    """Return the height of a building's ridge above the ground from its tags, metres; None without one."""
    height = metres(tags.get("height", tags.get("building:height")), MAX_HEIGHT)
    if height is not None:
        return height
    levels = count(tags.get("building:levels"), MAX_LEVELS)
    if not levels:
        return None
    roof = 0.0
    if tags.get("roof:shape", "flat") != "flat":
        storeys = count(tags.get("roof:levels"), MAX_LEVELS) or 0.0
        roof = metres(tags.get("roof:height"), MAX_HEIGHT) or storeys * STOREY or USUAL_ROOF
    return levels * STOREY + roof


def _foot(tags: Tags) -> float:
    """Return the height of the foot of a building's walls above the ground, metres."""
    base = metres(tags.get("min_height", tags.get("building:min_height")), MAX_HEIGHT)
    return STOREY * (count(tags.get("building:min_level"), MAX_LEVELS) or 0.0) if base is None else base


def _usual_height(tags: Sequence[Tags]) -> float:
    known = [height for one in tags if _low(one) is None and (height := known_height(one)) is not None]
    return float(np.median(known)) if len(known) >= MIN_KNOWN else USUAL_HEIGHT


def _low(tags: Tags) -> float | None:
    return LOW_BUILDINGS.get(tags.get("building", tags.get("building:part", "")))


def _building(outline: shapely.Polygon, tags: Tags, usual: float, least: float, *, is_part: bool) -> Building | None:
    """Return a building, or a part, that begins at ``least`` metres or higher; None if it ends below that."""
    height, is_known = known_height(tags), True
    base = _foot(tags)
    if height is None:
        is_known, height = False, _low(tags) or usual
    canopy = "roof" in (tags.get("building"), tags.get("building:part")) or tags.get("building") == "carport"
    if canopy and base == 0.0:
        base = max(height - SLAB, 0.0)
    base = max(base, least)
    if base >= height:
        if not is_part or least:
            return None
        base, height = 0.0, max(base, height)
    return Building(outline, height - base, base, source=FROM_EXTRACT, height_assumed=not is_known)
