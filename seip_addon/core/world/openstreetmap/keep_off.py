"""Ground next to the streets of an extract where new posts are not allowed: ways, crossing landings, private ground."""

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...geometry.plan import united
from ...site.post_rules import RULES, KeepOffArea, RuleName
from ..streetscape.description import SideWay, Wall
from ..streetscape.map_furniture import LANDING_DEPTH
from .extract import Relation, Tags, Way
from .mapped_crossings import MAX_CROSSING_LENGTH, crossed_places, crossing_width
from .plan_shapes import PlanShapes
from .streets import is_street

CROSSING_REACH = 8.0  # metres by which a mapped crossing may end before the kerb, or beyond it
PUBLIC = {"yes", "public", "permissive", "designated"}
PUBLIC_GARDENS = {"botanical", "community", "public"}
NOT_PUBLIC = {"private", "no", "customers", "permit", "residents", "delivery"}
"""Values of ``access`` of ground that the public may use, and may not."""
PRIVATE_KINDS = {
    ("leisure", "garden"),
    ("leisure", "swimming_pool"),
    ("landuse", "allotments"),
    ("landuse", "construction"),
    ("landuse", "military"),
    ("amenity", "parking"),
    ("amenity", "fuel"),
}
"""Areas that are private ground unless tagged as public."""
AREA_KINDS = ("leisure", "landuse", "amenity", "natural", "surface", "place")
"""Keys of areas of ground that ``access`` may make private."""
BOUNDARIES = {"Wall", "Fence", "Hedge", "Wire fence", "City wall", "Noise barrier"}
"""Barriers behind which the ground is private."""
MIN_PUBLIC_STRIP, BEHIND = 1.0, 5.0
"""Metres between carriageway and a barrier that leave room for a post in front, and depth of the ground behind."""
STEP = 2.0  # metres: length of the pieces of a barrier whose far sides are determined separately


def keep_off_areas(
    shapes: PlanShapes, area: BaseGeometry, carriageway: BaseGeometry, ways: Sequence[SideWay], walls: Sequence[Wall]
) -> Iterator[KeepOffArea]:
    """Yield the areas around a place from which rules exclude new posts, map coordinates.

    Parameters
    ----------
    area : shapely geometry
        Surroundings of the place, prepared.
    carriageway : shapely geometry
        Carriageway of the map.
    ways : sequence of SideWay
        Ways next to the road, some of which have a rule.
    walls : sequence of Wall
        Barriers.
    """
    found: dict[RuleName, list[BaseGeometry]] = {rule: [] for rule in RULES}
    for way in ways:
        if way.keep_off is not None:
            found[way.keep_off].append(way.area)
    found["landings"] += _landings(shapes, area, carriageway)
    found["private"] += [*_private_areas(shapes, area), *_behind_barriers(walls, carriageway)]
    for rule, areas in found.items():
        if areas:
            yield KeepOffArea(RULES[rule].title, united(areas), rule)


def _landings(shapes: PlanShapes, area: BaseGeometry, carriageway: BaseGeometry) -> Iterator[BaseGeometry]:
    """Yield the ground in front of crossings, mapped as ways or as single nodes of a street."""
    # Crossings mapped as ways come first; their nodes are remembered, because the shared node of the street usually has
    # tags of a crossing too, and would count twice.
    kerbside = carriageway.buffer(LANDING_DEPTH).difference(carriageway)
    shapely.prepare(kerbside)
    crossed: set[int] = set()
    for key in ("footway", "cycleway", "path"):
        for way, line in shapes.lines(area, key, {"crossing"}):
            crossed.update(way.nodes)
            if not carriageway.intersects(shapely.LineString(line)):
                continue  # it crosses a driveway
            corridor = shapely.LineString(_extended(line)).buffer(crossing_width(way.tags) / 2, cap_style="flat")
            yield corridor.intersection(kerbside)
    streets = (way for way, _ in shapes.lines(area, "highway", None) if is_street(way.tags, service=True))
    for one in crossed_places(streets, shapes):
        if one.node not in crossed:
            # A strip that is long enough for any street; other parts of it lie on a different carriageway.
            aside = MAX_CROSSING_LENGTH / 2 * np.array([-one.along[1], one.along[0]])
            across = shapely.LineString([one.middle - aside, one.middle + aside])
            reached = across.buffer(one.depth / 2, cap_style="flat").intersection(carriageway.buffer(LANDING_DEPTH))
            here = shapely.Point(one.middle)
            yield from (
                part.intersection(kerbside) for part in shapely.get_parts(reached) if part.dwithin(here, LANDING_DEPTH)
            )


def _extended(line: Float) -> Float:
    """Return a line (n, 2) extended straight at both ends."""
    outwards = line[[0, -1]] - line[[1, -2]]
    ends = line[[0, -1]] + CROSSING_REACH * outwards / np.maximum(np.hypot(*outwards.T), 1e-9)[:, None]
    return np.vstack([ends[:1], line, ends[1:]])


def _private_areas(shapes: PlanShapes, area: BaseGeometry) -> Iterator[BaseGeometry]:
    elements: list[Way | Relation] = [*shapes.extract.ways.values(), *shapes.extract.relations.values()]
    for element in elements:
        if _is_private(element.tags):
            outline = shapes.footprint(element)
            if outline is not None and area.intersects(outline):
                yield outline


def _is_private(tags: Tags) -> bool:
    """Return whether an area is ground that the public may not use."""
    if "building" in tags or "highway" in tags:
        return False
    access = tags.get("access")
    if any(tags.get(key) == value for key, value in PRIVATE_KINDS):
        return access not in PUBLIC and tags.get("garden:type") not in PUBLIC_GARDENS
    return access in NOT_PUBLIC and any(key in tags for key in AREA_KINDS)


def _behind_barriers(walls: Sequence[Wall], carriageway: BaseGeometry) -> Iterator[BaseGeometry]:
    """Yield the ground behind walls, fences and hedges, seen from the carriageway.

    A barrier at the kerb itself protects a pavement and has public ground behind it.
    """
    lines = [shapely.LineString(wall.line) for wall in walls if wall.name in BOUNDARIES]
    if not lines or carriageway.is_empty:
        return
    # For each short piece of a barrier, "behind" is the continuation of the shortest line from the carriageway to its
    # middle. Strips that meet a carriageway again belong to barriers between two roads, with no private ground behind.
    pieces = [shapely.get_coordinates(line) for line in shapely.segmentize(lines, STEP)]
    start, stop = (np.concatenate([piece[cut] for piece in pieces]) for cut in (slice(-1), slice(1, None)))
    middle = (start + stop) / 2
    ways = shapely.shortest_line(carriageway, shapely.points(middle))
    outwards = middle - shapely.get_coordinates(ways)[::2]
    distance = np.hypot(*outwards.T)
    near = (distance >= MIN_PUBLIC_STRIP) & (distance <= 2 * BEHIND)
    outwards = BEHIND * outwards[near] / distance[near, None]
    corners = np.stack([start[near], stop[near], stop[near] + outwards, start[near] + outwards], axis=1)
    behind = shapely.convex_hull(shapely.multipoints(corners))
    yield from behind[~shapely.intersects(carriageway, behind)]
