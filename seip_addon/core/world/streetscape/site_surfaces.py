"""Surfaces of a site as parts: carriageways, pavements, verges, other levels, and areas on them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...geometry.plan import outline, signed_area, united, without
from ...geometry.solids import from_faces
from ...site.roles import AREA_OVERLAYS, Role
from ...site.scene_geometry import OTHER_LEVELS
from . import road_surface
from .description import SiteDescription
from .lane_markings import markings, stop_lines
from .parts import Part
from .road_surface import SNAP_GRID, SurfaceLayers, without_crumbs
from .site_ground import MIN_PASSAGE, SiteGround, triangles_of
from .street_areas import MAX_MAPPED, StreetAreas
from .terrain import Terrain, triangulate

MIN_HOLE = 0.01  # square metres: smaller holes of a carriageway are rounding
CANDIDATE_MARGIN = 15.0  # how far outside the region of interest (metres) a new post may stand
VERGE_STRIP = (0.8, 2.3)  # strip for new posts along roads without pavements: metres from the carriageway
VERGE_BELOW = 0.03
GROUND_MARGIN = 5.0  # margin of ground around objects outside the extent (metres)
MAX_GROUND_DISTANCE = 300.0  # largest distance of ground from the extent (metres): a wall may run along the whole map
VERGE_SPACING = 12.0
KERB_STEP, RELIEF_SPACING = 2.5, 6.0  # metres: fine enough for errors of some centimetres on uneven ground
OVERLAY_SPACING = 4.0  # metres, as for junctions: coarser overlays would cut through the coverage on curved roads
MIN_WALL = 0.02  # metres: sum of the heights at both ends above which a gap next to a lower road gets a wall
OVERLAY_STEP = 0.001  # metres of height between areas of one role that may overlap
SURFACES = {
    "driving": ("Driving lanes", "asphalt", Role.ROADS),
    "shoulder": ("Shoulders", "asphalt shoulder", Role.ROADS),
    "parking": ("Parking lanes", "asphalt parking", Role.ROADS),
    "biking": ("Cycle lanes", "asphalt cycle", Role.ROADS),
    "track": ("Tracks", "asphalt shoulder", Role.ROADS),
    "border": ("Borders", "verge", Role.GROUND),
    "median": ("Medians", "median", Role.GROUND),
}
"""Name, material and role of the surface of each group of lanes, except pavements."""
PART_NAMES = {group: (name,) for group, (name, _, _) in SURFACES.items()} | {
    "sidewalk": ("Pavements", "Pavements beyond", "Kerbs")
}
"""Names of the parts whose widths are those of a group of lanes."""


@dataclass(frozen=True, eq=False)
class StreetSurface:
    """Parts of the carriageway and of the pavements, their area in plan, and notes."""

    parts: tuple[Part, ...]
    area: BaseGeometry
    notes: tuple[str, ...]


def street_surface(street: SiteGround) -> StreetSurface:
    """Return the surfaces of the street: those of its areas in a network, otherwise those of its lanes."""
    if street.areas is not None:
        return _network_surface(street, street.areas)
    layers = SurfaceLayers(street.lanes, street.extent)
    carriageway = _surface_parts(street, layers)
    pavement, notes = _pavement_parts(street, layers)
    return StreetSurface((*carriageway, *pavement), layers.area, notes)


def _network_surface(street: SiteGround, areas: StreetAreas) -> StreetSurface:
    terrain = Terrain(triangles_of(road_surface.in_groups(street.lanes, road_surface.CARRIAGEWAY)))
    laid = {
        group: terrain.drape(without_crumbs(area.intersection(street.extent)), spacing=OVERLAY_SPACING)
        for group, area in areas.groups.items()
    }
    pavement = without_crumbs(areas.pavement.intersection(street.extent))
    triangles = terrain.drape(pavement, spacing=OVERLAY_SPACING, above=road_surface.KERB_HEIGHT)
    parts, notes = _pavements(street, triangles)
    return StreetSurface((*_group_parts(laid), *parts), areas.whole, notes)


def _surface_parts(street: SiteGround, layers: SurfaceLayers) -> list[Part]:
    """Return a part for each group of lanes; small holes of the driving lanes are filled."""
    groups = {road_surface.group(lane) for lane in street.lanes}
    laid = {group: layers.lay_group(group) for group in SURFACES if group in groups}
    if "driving" in laid:
        whole = road_surface.without_gaps(street.roadside, street.lanes).intersection(street.extent)
        gaps = without_crumbs(without(whole, layers.area), least=MIN_HOLE)
        level = Terrain(np.concatenate(list(laid.values())))  # not that of pavements, which are a kerb higher
        filling = layers.lay(level.drape(gaps, spacing=OVERLAY_SPACING), gaps)
        laid["driving"] = np.concatenate([laid["driving"], filling])
    return _group_parts(laid)


def _group_parts(laid: Mapping[str, Float]) -> list[Part]:
    return [
        Part(name, from_faces(laid[group], material), (role,), keep_off="cycle-tracks" if group == "biking" else None)
        for group, (name, material, role) in SURFACES.items()
        if group in laid
    ]


def _pavement_parts(street: SiteGround, layers: SurfaceLayers) -> tuple[list[Part], tuple[str, ...]]:
    """Return pavements of the lanes of a map, see `_pavements`, with corners that the map lacks, and notes."""
    own = layers.lay_group("sidewalk")
    corners = road_surface.corner_pavements(own, street.lanes, street.roadside.carriageway)
    corners = layers.lay(corners, outline(corners, road_surface.SNAP_GRID))
    parts, notes = _pavements(street, np.concatenate([own, corners]))
    if not len(corners):
        return parts, notes
    added, had = (float(np.abs(signed_area(faces)).sum()) for faces in (corners, own))
    note = (
        f"the pavements are closed at the corners of junctions, where the map has gaps: {added:,.0f} m² are "
        f"added to its {had:,.0f} m²"
    )
    return parts, (note, *notes)


def _pavements(street: SiteGround, triangles: Float) -> tuple[list[Part], tuple[str, ...]]:
    """Return pavements (n, 3, 3) near the region (for posts), those beyond it, kerbs and verges, and notes."""
    if len(triangles) == 0:
        verge = _verge_strip(street, street.roadside.sides())
        return [verge], ("the map has no pavements: new posts may stand on a strip of verge",)
    plan = shapely.polygons(triangles[:, :, :2])
    near = shapely.distance(street.region, plan) <= CANDIDATE_MARGIN
    kerbs = road_surface.kerb_faces(triangles, None if street.relief is None else KERB_STEP)
    parts = [
        Part("Pavements", from_faces(triangles[near], "pavement"), (Role.GROUND, Role.CANDIDATE_AREAS)),
        Part("Pavements beyond", from_faces(triangles[~near], "pavement"), (Role.GROUND,)),
        Part("Kerbs", from_faces(kerbs, "kerb"), (Role.GROUND,)),
    ]
    bare = road_surface.bare_sides(
        street.roadside,
        shapely.union_all(plan, grid_size=road_surface.SNAP_GRID),
        road_surface.MAX_PAVEMENT_DISTANCE if street.areas is None else MAX_MAPPED,
    )
    verge = _verge_strip(street, bare)
    if not verge.solid.faces:
        return parts, ()
    length = bare.intersection(street.region.buffer(CANDIDATE_MARGIN)).length
    note = f"{length:,.0f} m of roadside have no pavement: new posts may stand on a strip of verge there"
    return [*parts, verge], (note,) if length >= 1.0 else ()


def _verge_strip(street: SiteGround, sides: BaseGeometry) -> Part:
    """Return a strip of verge along sides of the carriageway, except where the road continues and next to bridges."""
    inner, outer = VERGE_STRIP
    strip = without(sides.buffer(outer, cap_style="flat"), street.roadside.filled.buffer(inner))
    off_posts = street.crossing.area.union(street.crossing.decks)
    strip = without(strip, united([off_posts.buffer(outer), street.built_up]))
    near = strip.intersection(street.region.buffer(CANDIDATE_MARGIN))
    return area_part("Verge strip", near, Role.CANDIDATE_AREAS, street)


def verge_part(street: SiteGround, furniture: Sequence[Part], surfaces: Sequence[Part]) -> Part:
    """Return the ground next to all lanes and under all furniture, slightly below the lanes and under their seams.

    Parameters
    ----------
    street : SiteGround
        Ground and extent of the site.
    furniture : sequence of Part
        Parts that stand on the ground; it reaches around them.
    surfaces : sequence of Part
        Surfaces on the ground, which it does not cover.
    """
    corners = [part.solid.vertices[:, :2] + part.foot[:2] for part in furniture]
    built_up = shapely.convex_hull(shapely.multipoints(np.concatenate([np.empty((0, 2)), *corners])))
    gardens = built_up.buffer(GROUND_MARGIN).intersection(street.extent.buffer(MAX_GROUND_DISTANCE))
    ground = street.extent if built_up.is_empty else street.extent.union(gardens).convex_hull
    covered = street.covered.intersection(street.extent)
    roads = united([covered, street.crossing.area])
    lanes = roads.buffer(-road_surface.MAX_SEAM, join_style="mitre")
    laid = united([_plan(part) for part in surfaces if {Role.ROADS, Role.GROUND} & set(part.roles)])
    others = without(laid, covered).buffer(-road_surface.MAX_SEAM)
    lanes = lanes if others.is_empty else lanes.union(others)
    lanes = without(lanes, street.crossing.decks.buffer(road_surface.MAX_SEAM, join_style="mitre"))
    open_ground = road_surface.without_crumbs(without(ground, lanes))
    spacing = VERGE_SPACING if street.relief is None or street.relief.is_level else RELIEF_SPACING
    triangles = street.ground.drape(open_ground, spacing=spacing, above=-VERGE_BELOW)
    return Part("Verge", from_faces(triangles, "verge"), (Role.GROUND,))


def _plan(part: Part) -> BaseGeometry:
    """Return the area in plan of a part made of triangles, with its foot at the origin."""
    return outline(
        part.solid.vertices[np.array(part.solid.faces, dtype=np.int64).reshape(-1, 3)], road_surface.SNAP_GRID
    )


def marking_part(street: SiteGround, *, has_signals: bool) -> Part:
    """Return the markings of the lanes, with stop lines where there are signals."""
    inside = road_surface.junctions_in_plan(street.lanes) if street.areas is None else street.areas.inside
    quads = markings(street.lanes, street.extent, inside)
    if has_signals:
        lines = stop_lines(street.lanes, inside)
        lines = lines[shapely.contains_xy(street.extent, lines[:, :, :2].mean(axis=1))]
        quads = np.concatenate([quads, lines])
    return Part("Lane markings", from_faces(quads, "marking"), (Role.DRESSING,))


def side_way_parts(description: SiteDescription, street: SiteGround, laid: BaseGeometry) -> list[Part]:
    """Return ways next to the road by kind, without areas of lanes, buildings, other roads and laid surfaces."""
    houses = shapely.union_all([one.outline for one in description.buildings if one.base < MIN_PASSAGE])
    covered = [street.covered, street.roadside.filled, laid, houses, street.crossing.area]
    taken = shapely.union_all(covered).buffer(road_surface.MAX_SEAM)
    parts = []
    for name, material in sorted({(way.name, way.material) for way in description.ways}):
        areas = [way.area for way in description.ways if (way.name, way.material) == (name, material)]
        area = without(shapely.union_all(areas).intersection(street.extent), taken)
        taken = taken.union(area)
        triangles = street.terrain.drape(
            road_surface.without_crumbs(area), spacing=VERGE_SPACING, above=-VERGE_BELOW / 2
        )
        parts.append(Part(name, from_faces(triangles, material), (Role.GROUND,)))
    return parts


def area_part(
    name: str, area: BaseGeometry, role: Role, street: SiteGround, *, weight: float | None = None, step: int = 0
) -> Part:
    """Return an area in plan as an overlay on the ground; ``step`` raises it above other areas of the same role."""
    above, material = AREA_OVERLAYS[role]
    above += step * OVERLAY_STEP
    beyond = np.empty((0, 3, 3))
    if not street.extent.covers(area):  # there is no ground to follow: a grid over kilometres would take minutes
        plan = triangulate(area.difference(street.extent, grid_size=SNAP_GRID))
        beyond = np.dstack([plan, street.terrain.height(plan.reshape(-1, 2)).reshape(-1, 3) + above])
        area = area.intersection(street.extent, grid_size=SNAP_GRID)
    triangles = np.concatenate([street.terrain.drape(area, spacing=OVERLAY_SPACING, above=above), beyond])
    return Part(name, from_faces(triangles, material), (role,), weight=weight)


def other_level_parts(street: SiteGround) -> list[Part]:
    """Return the parts for roads of other levels, above and below."""
    above, below = street.crossing.above, street.crossing.below
    return [
        Part("Roads above", from_faces(above, "asphalt"), (Role.OCCLUDERS,)),
        Part(OTHER_LEVELS, from_faces(below, "asphalt"), (Role.GROUND,)),
        Part("Retaining walls", from_faces(_retaining_walls(street), "wall"), (Role.GROUND,)),
    ]


def _retaining_walls(street: SiteGround) -> Float:
    """Return (n, 3, 3) vertical triangles that close the gap between roads on other levels and higher ground."""
    sides = shapely.boundary(street.crossing.area)
    quads = [np.empty((0, 4, 3))]
    on_ground = street.crossing.on_ground
    roads = Terrain(on_ground) if len(on_ground) else street.ground
    for line in shapely.get_parts(shapely.segmentize(sides, KERB_STEP)):
        plan = shapely.get_coordinates(line)
        low, high = roads.height(plan), street.ground.height(plan)
        corners = np.stack([np.column_stack([plan, low]), np.column_stack([plan, np.maximum(high, low)])], axis=1)
        walled = (high - low)[:-1] + (high - low)[1:] > MIN_WALL
        quads.append(np.stack([corners[:-1, 0], corners[1:, 0], corners[1:, 1], corners[:-1, 1]], axis=1)[walled])
    faces = np.concatenate(quads)
    return np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
