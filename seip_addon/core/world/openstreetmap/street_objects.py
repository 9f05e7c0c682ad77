"""Objects next to the streets of an extract: trees, lamps, posts, walls, shelters, and ways that are not roads."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...site.post_rules import RuleName
from ...site.scene_geometry import ASSUMED, FROM_EXTRACT
from ..streetscape.description import Poles, SideWay, SiteDescription, Slab, Trees, Wall
from ..streetscape.map_furniture import CROWN_SHARE, LIGHT_ARM, LIGHT_HEIGHT, TREE_HEIGHT
from .bridges import layer
from .buildings import buildings, passages
from .extract import Node, Tags
from .keep_off import keep_off_areas
from .plan_shapes import PlanShapes, polygons, spaced
from .quantities import metres

MAX_TREE, MAX_CROWN, MAX_POST, MAX_BARRIER = 80.0, 40.0, 60.0, 20.0  # metres
TREE_SPACING = 8.0  # metres between the trees of a row
BARRIERS = {
    "wall": (2.0, 0.25, "wall"),
    "city_wall": (5.0, 1.0, "wall"),
    "retaining_wall": (1.5, 0.3, "wall"),
    "fence": (1.5, 0.06, "steel"),
    "hedge": (1.5, 0.8, "leaves"),
    "guard_rail": (0.75, 0.1, "steel"),
    "handrail": (1.0, 0.06, "steel"),
    "jersey_barrier": (0.85, 0.5, "wall"),
    "noise_barrier": (3.5, 0.2, "wall"),
    "wire_fence": (1.2, 0.04, "steel"),
}
"""Assumed height and thickness (metres) of each kind of ``barrier``, and its material."""
POST_KINDS = {
    ("power", "pole"): 9.0,
    ("man_made", "utility_pole"): 8.0,
    ("man_made", "pole"): 6.0,
    ("man_made", "mast"): 10.0,
}
"""Assumed heights (metres) of posts, by key and value."""
POWER_POLES = {"power", "utility_pole"}
"""Keys and values of posts that carry lines and belong to the operator of these."""
SIGNAL_HEIGHT = 6.0  # metres
SHELTER_SIZE, SHELTER_HEIGHT, SHELTER_ROOF = (4.0, 1.5), 2.5, 0.15  # metres: length and depth, height, and roof
FOOTWAYS = "Footways"
WAY_WIDTHS: dict[str, tuple[float, str, str, RuleName | None]] = {
    "footway": (2.0, "pavement", FOOTWAYS, None),
    "path": (1.8, "pavement", FOOTWAYS, None),
    "steps": (2.0, "pavement", FOOTWAYS, None),
    "pedestrian": (4.0, "pavement", FOOTWAYS, None),
    "cycleway": (2.0, "asphalt cycle", "Cycle tracks", "cycle-tracks"),
    "service": (3.5, "asphalt shoulder", "Driveways", "driveways"),
    "track": (3.0, "asphalt shoulder", "Driveways", "driveways"),
}
"""Width (metres), material and name of ways that are not roads, and the rule that excludes new posts from them."""


def surroundings(shapes: PlanShapes, area: BaseGeometry, carriageway: BaseGeometry) -> SiteDescription:
    """Return a description of the surroundings of a place from an extract.

    Parameters
    ----------
    shapes : PlanShapes
        Shapes of the extract in map coordinates.
    area : shapely geometry
        Area of interest, map coordinates; objects that reach into it are included.
    carriageway : shapely geometry
        Carriageway of the map. Signals on it are mounted above its lanes, and have no posts.
    """
    shapely.prepare(area)
    shapely.prepare(carriageway)
    nodes = [
        (node, place)
        for node in shapes.extract.nodes.values()
        if node.tags and area.intersects(shapely.Point(place := shapes.point(node)))
    ]
    walls, ways = tuple(_barriers(shapes, area)), tuple(_side_ways(shapes, area))
    return SiteDescription(
        buildings=tuple(buildings(shapes, area, passages(shapes, carriageway, list(_passages(shapes, area))))),
        trees=(*_single_trees(nodes), *_tree_rows(shapes, area)),
        walls=walls,
        street_lights=tuple(_lamps(nodes)),
        signal_poles=tuple(_signals(nodes, carriageway)),
        posts=tuple(_posts(nodes)),
        keep_off_areas=tuple(keep_off_areas(shapes, area, carriageway, ways, walls)),
        slabs=(*_shelters(shapes, nodes, area, carriageway), *_thick_barriers(shapes, area)),
        ways=ways,
    )


def _height(tags: Tags, usual: float, most: float) -> tuple[float, bool]:
    """Return a height from tags, metres, and whether it is assumed instead."""
    own = metres(tags.get("height", tags.get("est_height")), most)
    return (usual, True) if own is None else (own, False)


def _single_trees(nodes: list[tuple[Node, Float]]) -> Iterator[Trees]:
    for node, place in nodes:
        if node.tags.get("natural") == "tree":
            yield _trees(place[None], node.tags, FROM_EXTRACT)


def _trees(places: Float, tags: Tags, source: str) -> Trees:
    height, assumed = _height(tags, TREE_HEIGHT, MAX_TREE)
    crown = metres(tags.get("diameter_crown"), MAX_CROWN)
    if assumed and crown is not None:
        height = max(height, min(crown / CROWN_SHARE, MAX_TREE))
    return Trees(places, height, CROWN_SHARE * height if crown is None else crown, source, assumed)


def _tree_rows(shapes: PlanShapes, area: BaseGeometry) -> Iterator[Trees]:
    for way, line in shapes.lines(area, "natural", {"tree_row"}):
        places = spaced(line, TREE_SPACING)
        near = places[shapely.intersects_xy(area, places)]
        if len(near):
            yield _trees(near, way.tags, ASSUMED)  # the row is known, its trees are not


def _post(place: Float, tags: Tags, usual: float, arm: float = 0.0) -> Poles:
    height, assumed = _height(tags, usual, MAX_POST)
    return Poles(place[None], height, arm, None, FROM_EXTRACT, assumed)


def _lamps(nodes: list[tuple[Node, Float]]) -> Iterator[Poles]:
    for node, place in nodes:
        if node.tags.get("highway") == "street_lamp" and node.tags.get("support") not in ("wall", "wire", "ceiling"):
            yield _post(place, node.tags, LIGHT_HEIGHT, LIGHT_ARM)


def _signals(nodes: list[tuple[Node, Float]], carriageway: BaseGeometry) -> Iterator[Poles]:
    for node, place in nodes:
        is_signal = node.tags.get("highway") == "traffic_signals" or node.tags.get("traffic_signals") == "signal"
        if is_signal and not carriageway.intersects(shapely.Point(place)):
            yield _post(place, node.tags, SIGNAL_HEIGHT)


def _posts(nodes: list[tuple[Node, Float]]) -> Iterator[Poles]:
    for node, place in nodes:
        for (key, value), usual in POST_KINDS.items():
            if node.tags.get(key) == value and node.tags.get("highway") != "street_lamp":
                post = _post(place, node.tags, usual)
                carries_lines = not POWER_POLES.isdisjoint((key, value))
                yield replace(post, name="Power pole", keep_off="power-poles") if carries_lines else post
                break


def _barriers(shapes: PlanShapes, area: BaseGeometry) -> Iterator[Wall]:
    for way, line in shapes.lines(area, "barrier", set(BARRIERS)):
        if way.tags.get("area") == "yes" and way.is_closed:
            continue
        kind = way.tags["barrier"]
        usual, thick, material = BARRIERS[kind]
        height, assumed = _height(way.tags, usual, MAX_BARRIER)
        thickness = metres(way.tags.get("width"), MAX_BARRIER) or thick
        name = kind.replace("_", " ").capitalize()
        yield Wall(line, height, thickness, 0.0, name, material, FROM_EXTRACT, assumed)


def _thick_barriers(shapes: PlanShapes, area: BaseGeometry) -> Iterator[Slab]:
    for way in shapes.extract.ways.values():
        kind = way.tags.get("barrier", "")
        if kind not in BARRIERS or way.tags.get("area") != "yes" or not way.is_closed:
            continue
        outline = shapes.footprint(way)
        if outline is not None and outline.intersects(area):
            usual, _, material = BARRIERS[kind]
            height, assumed = _height(way.tags, usual, MAX_BARRIER)
            for part in polygons(outline):
                yield Slab(part, 0.0, height, kind.replace("_", " ").capitalize(), material, FROM_EXTRACT, assumed)


def _shelters(
    shapes: PlanShapes, nodes: list[tuple[Node, Float]], area: BaseGeometry, carriageway: BaseGeometry
) -> Iterator[Slab]:
    """Yield roof and back wall of shelters, on their outline if it is mapped, otherwise of a usual size."""
    outlines = [
        (part, way.tags)
        for way in shapes.extract.ways.values()
        if way.tags.get("amenity") == "shelter"
        and "building" not in way.tags
        and (outline := shapes.footprint(way)) is not None
        and outline.intersects(area)
        for part in polygons(outline)
    ]
    for node, place in nodes:
        stop = node.tags.get("highway") == "bus_stop" and node.tags.get("shelter") == "yes"
        if node.tags.get("amenity") == "shelter" or stop:
            # A stop and its shelter are often mapped as two elements: a node near a known outline adds none.
            if any(outline.distance(shapely.Point(place)) < 2 * SHELTER_SIZE[0] for outline, _ in outlines):
                continue
            outlines.append((_shelter_outline(place, carriageway), node.tags))
    for outline, tags in outlines:
        height, assumed = _height(tags, SHELTER_HEIGHT, MAX_BARRIER)
        yield Slab(outline, height - SHELTER_ROOF, height, "Shelter", "roof", FROM_EXTRACT, assumed)
        back = _back_wall(outline, carriageway)
        yield Slab(back, 0.0, height - SHELTER_ROOF, "Shelter wall", "wall", FROM_EXTRACT, assumed)


def _shelter_outline(place: Float, carriageway: BaseGeometry) -> shapely.Polygon:
    """Return the outline of a shelter of usual size, facing the road at least 1 m from the carriageway."""
    nearest = shapely.get_coordinates(shapely.shortest_line(shapely.Point(place), carriageway.boundary))[1]
    away = place - nearest
    distance = float(np.hypot(*away))
    away = away / distance if distance > 0.01 else np.array([1.0, 0.0])
    # Stops are also mapped on the carriageway: the way out then points from the node to the edge.
    if carriageway.intersects(shapely.Point(place)):
        away = -away
    along = np.array([-away[1], away[0]])
    length, depth = SHELTER_SIZE
    front = nearest + max(distance, 1.0) * away
    corners = [front - length / 2 * along, front + length / 2 * along]
    return shapely.Polygon([*corners, corners[1] + depth * away, corners[0] + depth * away])


def _back_wall(outline: shapely.Polygon, carriageway: BaseGeometry) -> shapely.Polygon:
    """Return a thin wall along the long side of an outline that is farthest from the road."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(outline))
    sides = [shapely.LineString(corners[i : i + 2]) for i in range(4)]
    longest = max(side.length for side in sides)
    back = max((side for side in sides if side.length > 0.9 * longest), key=lambda side: side.distance(carriageway))
    return back.buffer(0.1, cap_style="flat")


def _side_ways(shapes: PlanShapes, area: BaseGeometry) -> Iterator[SideWay]:
    for way, line in shapes.lines(area, "highway", set(WAY_WIDTHS)):
        tags = way.tags
        if tags.get("tunnel", "no") not in ("no", "building_passage") or tags.get("indoor", "no") != "no":
            continue
        if layer(tags) != 0 or tags.get("footway") == "crossing":
            continue
        _, material, name, rule = WAY_WIDTHS[tags["highway"]]
        if tags.get("area") == "yes":
            outline = shapes.footprint(way)
            if outline is not None:
                yield SideWay(outline, material, name, rule)
            continue
        width = _way_width(tags)
        along = line if "sidewalk" in (tags.get("footway"), tags.get("path")) else None
        yield SideWay(shapely.LineString(line).buffer(width / 2), material, name, rule, along, width)


def _way_width(tags: Tags) -> float:
    """Return the width of a way that is not a road, metres."""
    return metres(tags.get("width"), MAX_BARRIER) or WAY_WIDTHS[tags["highway"]][0]


def _passages(shapes: PlanShapes, area: BaseGeometry) -> Iterator[BaseGeometry]:
    """Yield the areas of ways that are not roads where they lead through buildings."""
    for way, line in shapes.lines(area, "highway", set(WAY_WIDTHS)):
        if way.tags.get("tunnel") == "building_passage":
            yield shapely.LineString(line).buffer(_way_width(way.tags) / 2, cap_style="square")
