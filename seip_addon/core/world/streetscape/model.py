"""Model of a site: the parts of a scene from a map and a site description, in local axes."""

from collections import Counter
from collections.abc import Collection, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...arrays import Float
from ...counts import counted
from ...errors import SeipError
from ...geometry.plan import covered_share, outline, signed_area, united, without
from ...geometry.solids import Solid, fence, from_faces
from ...progress import Progress
from ...site.obstruction import NO_OBSTACLES_MESSAGE, can_hide
from ...site.post_rules import RULES, KeepOffArea
from ...site.roles import AREA_OVERLAYS, Role
from ...site.scene_geometry import ASSUMED, DESCRIBED, OTHER_LEVELS, NamedArea
from ...site.sources import SourceCount, count_sources
from ..opendrive.lanes import LaneSurface
from ..opendrive.objects import TUNNEL, PlacedObject, PlacedSignal, extent_in_plan
from . import road_surface, street_furniture
from .clearing import MAX_IN_LANE, clear
from .description import (
    MAX_COVERED,
    PLACED_FIELDS,
    Area,
    Building,
    PlacedSolid,
    Poles,
    SideWay,
    SiteDescription,
    Slab,
    Trees,
    Wall,
)
from .intersections import enclosed, ring_roads
from .levels import MIN_LEVEL_HEIGHT, UNNAMED_ROAD, Levels
from .map_furniture import (
    CROWN_SHARE,
    POLE_HEIGHT,
    POST_RADIUS,
    arm_heading,
    building_parts,
    facade,
    is_trunk,
    landings,
    local_objects,
    object_parts,
    pole_part,
    tree_part,
)
from .named_places import area_in_plan, named_places, street_names
from .object_kinds import Kind, kind_of
from .parts import Part
from .place import SCENE_MARGIN, Place, shifted
from .road_checks import road_warnings
from .road_surface import Roadside, SurfaceLayers, without_crumbs
from .signal_posts import signal_parts, split_posts
from .street_areas import MAX_MAPPED, NOTHING, Sidewalk, StreetAreas, medians, street_areas
from .street_map import JunctionArea, StreetMap
from .terrain import Embankments, FlatLand, Relief, Terrain, cut, embankment_width

STEPS = ("place", "ground", "objects", "carriageway", "pavements", "verge", "checks")
"""Steps of `street_model` in their order."""
MIN_HOLE = 0.01  # square metres: smaller holes of a carriageway are rounding
CANDIDATE_MARGIN = 15.0  # how far outside the region of interest (metres) a new post may stand
VERGE_STRIP = (0.8, 2.3)  # strip for new posts along roads without pavements: metres from the carriageway
VERGE_BELOW = 0.03
GROUND_MARGIN = 5.0  # margin of ground around objects outside the extent (metres)
MAX_GROUND_DISTANCE = 300.0  # largest distance of ground from the extent (metres): a wall may run along the whole map
VERGE_SPACING = 12.0
KERB_STEP, RELIEF_SPACING = 2.5, 6.0  # metres: fine enough for errors of some centimetres on uneven ground
OVERLAY_SPACING = 4.0  # metres, as for junctions: coarser overlays would cut through the coverage on curved roads
MIN_PASSAGE = 2.0  # metres above the ground from which on a building leaves room for ways below
MIN_BRIDGE_HEIGHT = 1.0  # metres above the land from which a road on a bridge is in the air
MIN_RAMP_HEIGHT = 1.0  # metres above the nearest studied road from which a ramp of another level is in the way
MIN_WALL = 0.02  # metres: sum of the heights at both ends above which a gap next to a lower road gets a wall
UNNAMED_STREET = "Unnamed street"
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


_Item = TypeVar("_Item", Area, Building, KeepOffArea, PlacedSolid, Poles, SideWay, Slab, Trees, Wall)


@dataclass(frozen=True, eq=False)
class SiteModel:
    """A site as the parts of a scene.

    Parameters
    ----------
    origin : (3,) float64, metres
        Map coordinates of the local origin, whole metres.
    geo_reference : str or None
        Projection of the map, as the map gives it.
    header_offset : (4,) float64
        Header offset of the map: x, y, z in metres and heading in radians.
    parts : tuple of Part
        Objects of the scene.
    region : shapely geometry
        Region of interest in plan, local axes.
    notes : tuple of str
        Assumptions made where the map lacks data, one sentence each.
    warnings : tuple of str
        Reasons to distrust results of the scene, one sentence each.
    places : tuple of NamedArea
        Streets and crossings of the map in the region, local axes.
    attribution : tuple of str
        Credits required by the sources of the site.
    """

    name: str
    origin: Float
    geo_reference: str | None
    header_offset: Float
    parts: tuple[Part, ...]
    region: BaseGeometry
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    places: tuple[NamedArea, ...] = ()
    attribution: tuple[str, ...] = ()

    def sources(self) -> tuple[SourceCount, ...]:
        """Count the parts by kind and source, except those that are only seen."""
        return count_sources(
            (part.name, part.source, part.height_assumed or part.width_assumed or part.source == ASSUMED)
            for part in self.parts
            if part.source and set(part.roles) != {Role.DRESSING}
        )


@dataclass(frozen=True, eq=False)
class _OtherLevels:
    """Roads on other levels, and bridges of the studied level, in local axes.

    Parameters
    ----------
    lanes : tuple of LaneSurface
        Lanes of the roads on other levels.
    above, below : (n, 3, 3) float64, metres
        Surfaces of these roads that occlude the studied level, and the remaining ones.
    on_ground : (n, 3, 3) float64, metres
        Surfaces of these roads that lie on the ground.
    decks : shapely geometry
        Area in plan where roads of the studied level are above the ground.
    """

    lanes: tuple[LaneSurface, ...]
    above: Float
    below: Float
    on_ground: Float
    decks: BaseGeometry

    @cached_property
    def area(self) -> BaseGeometry:
        """Area in plan of the roads of other levels on the ground."""
        return outline(self.on_ground, road_surface.SNAP_GRID)

    @cached_property
    def off_posts(self) -> BaseGeometry:
        """Area in plan next to which the verge is not used for posts."""
        return self.area.union(self.decks)


@dataclass(frozen=True, eq=False)
class _Surroundings:
    """Ground, roadside and region of a site, from which its parts are placed, in local axes.

    Parameters
    ----------
    areas : StreetAreas or None
        Areas of the street in a network; in OpenDRIVE the surfaces are those of the lanes.
    built_up : shapely geometry
        Buildings next to a network and islands of its roundabouts, where no pavement is assumed.
    terrain : Terrain
        Heights of the studied roads, and of the ground next to them.
    ground : Terrain
        Heights of the ground, also below bridges.
    """

    origin: Float
    lanes: tuple[LaneSurface, ...]
    areas: StreetAreas | None
    built_up: BaseGeometry
    region: BaseGeometry
    extent: BaseGeometry
    roadside: Roadside
    terrain: Terrain
    ground: Terrain
    relief: Relief | None
    land: Relief | FlatLand | None
    crossing: "_OtherLevels"

    @cached_property
    def covered(self) -> BaseGeometry:
        """Area of the lanes in plan."""
        return road_surface.lane_outline(self.lanes) if self.areas is None else self.areas.whole

    @cached_property
    def lane_interiors(self) -> BaseGeometry:
        """Driving lanes without a strip along their edges, where posts count as standing next to the road."""
        driving = road_surface.lane_outline(road_surface.in_groups(self.lanes, ["driving"]))
        return driving.buffer(-MAX_IN_LANE)


def street_model(streets: StreetMap, description: SiteDescription) -> Generator[Progress, None, SiteModel]:
    """Model a place of a map.

    Parameters
    ----------
    streets : StreetMap
        Streets of the map.
    description : SiteDescription
        Choice of the place, and objects there that the map lacks.

    Yields
    ------
    Progress
        Number of completed steps.

    Raises
    ------
    SeipError
        The junction does not exist, or there is no road at the place or in the region of interest.
    """
    road_map, surfaces = streets.road_map, streets.lanes
    if not surfaces:
        raise SeipError(f"map {road_map.name!r} has no lane with an area: give its lanes widths, or use another map")
    yield _step("place")
    # In map coordinates: the place, its level, and its region.
    place = Place(road_map, surfaces, description, streets.junctions)
    levels = place.levels()
    place = replace(place, surfaces=levels.studied)
    region = place.region()
    origin = _origin(place, description.relief)
    yield _step("ground")
    street = _surroundings(streets, levels, origin, shifted(region, -origin), description)
    yield _step("objects")
    # From here on in local axes: objects of the description and of the map.
    described, clear_notes = _local_description(description, street)
    objects, covered_notes = _without_covered(_map_objects(streets, street), described)
    furniture = _furniture(objects, _map_signals(streets, street, levels), described, street)
    other_levels = _other_level_parts(street)
    yield _step("carriageway")
    surface = _surface(street)
    yield _step("pavements")
    ways = _side_way_parts(described, street, surface.area)
    yield _step("verge")
    laid = [*surface.parts, *ways]
    parts = [
        *laid,
        _verge_part(street, furniture.parts, laid),
        *other_levels,
        _marking_part(street, stop_lines=bool(furniture.signals or described.signal_poles)),
        *furniture.parts,
        *_overlay_parts(place, described, objects, street),
    ]
    yield _step("checks")
    names = street_names(road_map)
    seen = _sight_area(street.region, parts)
    occluders = [part for part in (*furniture.parts, *other_levels) if Role.OCCLUDERS in part.roles]
    bare = () if any(_hides(part, seen) for part in occluders) else (NO_OBSTACLES_MESSAGE,)
    unnamed = UNNAMED_ROAD if description.from_centre_lines else ""
    warnings = road_warnings(road_map, (*street.lanes, *street.crossing.lanes), names, origin, unnamed)
    return SiteModel(
        name=description.name or _map_title(road_map.name, description.junction),
        origin=origin,
        geo_reference=road_map.geo_reference,
        header_offset=road_map.header_offset,
        parts=tuple(_with_source(part, description) for part in parts if part.solid.faces),
        region=street.region,
        notes=(
            *covered_notes,
            *_level_notes(levels),
            *clear_notes,
            *surface.notes,
            *_furniture_notes(objects, furniture.signals),
            *_tunnel_notes(objects, names),
        ),
        warnings=(*bare, *warnings),
        places=named_places(
            street.lanes,
            names,
            objects,
            street.region,
            unnamed=UNNAMED_STREET if description.from_centre_lines else "",
            rings=ring_roads(road_map.roads, description.roundabouts),
        ),
        attribution=tuple(dict.fromkeys((*road_map.attribution, *description.attribution))),
    )


def _step(name: str) -> Progress:
    return Progress(STEPS.index(name), len(STEPS), "streets", counted=False)


def _local_description(description: SiteDescription, street: _Surroundings) -> tuple[SiteDescription, tuple[str, ...]]:
    """Return a description with the carriageway cleared and its objects and areas in local axes, and notes.

    The choice of the place (``near``, ``region``, weighted regions) and the ground remain in map coordinates: `Place`
    and `_Surroundings` have used them before.
    """
    on_map = (shifted(area, street.origin) for area in (street.roadside.carriageway, street.roadside.mouths))
    cleared, notes = clear(description, *on_map)
    local: dict[str, Any] = {
        name: tuple(_local(one, street.origin) for one in getattr(cleared, name)) for name in PLACED_FIELDS
    }
    return replace(cleared, **local), notes


def _local(item: _Item, origin: Float) -> _Item:
    """Return an object or area of a description in local axes: all that is a shape or an array of places in it."""
    moved: dict[str, Any] = {}
    for name, value in vars(item).items():
        if isinstance(value, BaseGeometry):
            moved[name] = shifted(value, -origin)
        elif isinstance(value, np.ndarray):
            moved[name] = value - origin[: value.shape[1]]
        elif isinstance(value, Solid):
            moved[name] = replace(value, vertices=value.vertices - origin)
    return replace(item, **moved)


def _map_objects(streets: StreetMap, street: _Surroundings) -> tuple[PlacedObject, ...]:
    """Return the objects of the map within the extent, on the ground, in local axes."""
    area = shifted(street.extent, street.origin)
    on_map = (_risen(one, street.relief) for one in streets.objects if extent_in_plan(one).intersects(area))
    return local_objects(on_map, street.origin)


def _map_signals(streets: StreetMap, street: _Surroundings, levels: Levels) -> list[PlacedSignal]:
    """Return the signals of the map within the extent and on the studied level, on the ground, in local axes."""
    away, area = levels.other_roads(), shifted(street.extent, street.origin)
    return [
        replace(one, position=_risen_place(one.position, street.relief) - street.origin)
        for one in streets.signals
        if one.road_id not in away and area.intersects(shapely.Point(one.position[:2]))
    ]


@dataclass(frozen=True, eq=False)
class _Furniture:
    """Parts that stand on the ground; those of traffic lights of the map, which are among them, also separately."""

    parts: tuple[Part, ...]
    signals: tuple[Part, ...]


def _furniture(
    objects: Sequence[PlacedObject],
    map_signals: Sequence[PlacedSignal],
    described: SiteDescription,
    street: _Surroundings,
) -> _Furniture:
    """Return the parts of the map's objects and signals, and of the description, all in local axes."""
    others, lights = split_posts(objects, map_signals, street.roadside)
    signals = tuple(_checked_pole(part, street) for part in signal_parts(lights, street.roadside, street.terrain))
    own = (_checked_pole(part, street) for part in object_parts(others, street.roadside.carriageway))
    return _Furniture((*own, *signals, *_described_parts(described, street)), signals)


def _overlay_parts(
    place: Place, described: SiteDescription, objects: Sequence[PlacedObject], street: _Surroundings
) -> list[Part]:
    """Return the overlays on the ground: region of interest, weighted regions, and areas for sensors."""
    weighted = [(name, shifted(area, -street.origin), weight) for name, area, weight in place.weighted_areas()]
    return [
        _area_part("Region of interest", street.region, Role.REGION, street),
        *_weighted_parts(weighted, street, described=bool(described.weighted_regions)),
        *_area_parts(described, street),
        *_keep_off_parts(described, objects, street),
    ]


def _sight_area(region: BaseGeometry, parts: Sequence[Part]) -> BaseGeometry:
    """Return the area in plan that lies between positions of sensors and the region of interest, local axes."""
    posts = [part.foot[:2] for part in parts if Role.POLES in part.roles]
    return shapely.union_all([region.buffer(CANDIDATE_MARGIN), shapely.MultiPoint(posts)]).convex_hull


def _hides(part: Part, area: BaseGeometry) -> bool:
    """Return whether a part reaches into an area and is large enough to hide targets there."""
    plan = shapely.MultiPoint(part.solid.vertices[:, :2] + part.foot[:2]).convex_hull
    return can_hide(part.solid.vertices) and bool(area.intersects(plan))


def _without_covered(
    objects: tuple[PlacedObject, ...], described: SiteDescription
) -> tuple[tuple[PlacedObject, ...], tuple[str, ...]]:
    """Return the objects of a map without buildings that a survey contains, and a note on these."""
    modelled = [one.outline for one in described.solids if one.is_building]
    if not modelled:
        return objects, ()
    tree = shapely.STRtree(modelled)
    kept = tuple(one for one in objects if kind_of(one) is not Kind.BUILDING or not _is_covered(one, tree))
    count = len(objects) - len(kept)
    note = f"{counted(count, 'building')} of the map replaced by those of the survey"
    return kept, (note,) if count else ()


def _is_covered(placed: PlacedObject, modelled: shapely.STRtree) -> bool:
    return covered_share(area_in_plan(placed), modelled) > MAX_COVERED


def _map_title(name: str, junction: str | None) -> str:
    """Return the title of a site without a description: the map, and the junction that was asked for."""
    return ", ".join(filter(None, (name, junction and f"junction {junction}")))


def _with_source(part: Part, description: SiteDescription) -> Part:
    """Return a part with the source of the map if it has none; overlays that only mark areas need none."""
    if part.source or AREA_OVERLAYS.keys() >= set(part.roles):
        return part
    assumed = any(part.name in PART_NAMES.get(group, ()) for group in description.widths_assumed)
    return replace(part, source=description.map_source, width_assumed=assumed)


def _furniture_notes(placed: Sequence[PlacedObject], signals: Sequence[Part]) -> Iterator[str]:
    """Yield notes on assumed posts of traffic lights and assumed crowns of trees."""
    assumed = sum(part.source == ASSUMED for part in signals)
    if assumed:
        posts = counted(assumed, "post of traffic lights is", "posts of traffic lights are")
        yield f"{posts} assumed, because the map has none there: they carry sensors only with assumed poles allowed"
    trunks = sum(map(is_trunk, placed))
    if trunks:
        trees = counted(trunks, "tree")
        yield f"the map gives {trees} the width of a trunk: the crowns are taken as {CROWN_SHARE:g} times the height"


def _tunnel_notes(placed: Sequence[PlacedObject], names: Mapping[str, str]) -> Iterator[str]:
    for one in placed:
        if one.kind == TUNNEL:
            street = names.get(one.road_id) or f"road {one.road_id}"
            yield f"tunnel {one.name or one.id} of {street} is built as an open road, without its walls and its roof"


def _level_notes(levels: Levels) -> Iterator[str]:
    roads = levels.other_roads()
    noted = set()  # each carriageway of a street crosses the other street, which is one crossing for the user
    for crossing in levels.crossings:
        streets = (crossing.called(crossing.above), crossing.called(crossing.below), crossing.above in roads)
        if streets not in noted:
            noted.add(streets)
            away = "upper" if crossing.above in roads else "lower"
            yield f"{crossing}: the {away} one is on another level; it is modelled but not studied"


def _other_level_parts(street: _Surroundings) -> list[Part]:
    """Return the parts for roads of other levels, above and below."""
    above, below = street.crossing.above, street.crossing.below
    return [
        Part("Roads above", _solid(above, "asphalt"), (Role.OCCLUDERS,)),
        Part(OTHER_LEVELS, _solid(below, "asphalt"), (Role.GROUND,)),
        Part("Retaining walls", _solid(_retaining_walls(street), "wall"), (Role.GROUND,)),
    ]


def _retaining_walls(street: _Surroundings) -> Float:
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


def _checked_pole(part: Part, street: _Surroundings) -> Part:
    """Return a part of the map, as an occluder only if it is a pole on a different level or in a lane."""
    if Role.POLES not in part.roles:
        return part
    x, y, z = part.foot
    away = abs(z - float(street.terrain.height(np.array([[x, y]]))[0])) > MIN_LEVEL_HEIGHT
    in_lane = shapely.intersects_xy(street.lane_interiors, x, y)
    return replace(part, roles=(Role.OCCLUDERS,), source="") if away or in_lane else part


def _origin(place: Place, relief: Relief | None) -> Float:
    """Return the local origin (3,), whole metres: the centre, at the height of the nearest point of a road."""
    points = np.concatenate([np.concatenate([lane.left, lane.right]) for lane in place.surfaces])
    nearest = points[np.argmin(np.hypot(*(points[:, :2] - place.centre).T))]
    return np.round([*place.centre, _risen_place(nearest, relief)[2]])


def _risen_place(points: Float, relief: Relief | None) -> Float:
    """Return points (3,) or (n, 3) of a map, raised by the ground under it."""
    if relief is None:
        return points
    risen = np.atleast_2d(points) + 0.0
    risen[:, 2] += relief.rise(risen[:, :2])
    return risen.reshape(points.shape)


def _risen(placed: PlacedObject, relief: Relief | None) -> PlacedObject:
    """Return an object of a map, raised as a whole by the ground under its position."""
    if relief is None:
        return placed
    position = _risen_place(placed.position, relief)
    rise = position - placed.position
    outlines = tuple(replace(one, base=one.base + rise) for one in placed.outlines)
    return replace(placed, position=position, outlines=outlines)


def _strips(
    surfaces: Sequence[LaneSurface], origin: Float, area: BaseGeometry, relief: Relief | None, *, kerbs: bool = True
) -> tuple[LaneSurface, ...]:
    """Return the lanes near an area in local axes, raised by the ground under the map."""
    if relief is None:
        return road_surface.local_strips(surfaces, origin, area, kerbs=kerbs)
    surfaces = [_bridged(lane, relief) if lane.road_id in relief.bridges else lane for lane in surfaces]
    # Lanes follow the ground only at their rows of points, so they get more rows first, still at the heights of the
    # map. The height of the origin is subtracted last, because it refers to the raised map.
    lanes = road_surface.local_strips(surfaces, origin * [1, 1, 0], area, kerbs=kerbs)
    shift, height = origin * [1, 1, 0], origin * [0, 0, 1]

    def risen(edge: Float) -> Float:
        moved: Float = _risen_place(edge + shift, relief) - shift - height
        return moved

    def lowered(edge: Float) -> Float:
        moved: Float = edge - height
        return moved

    raised = ((lane, lowered if lane.road_id in relief.bridges else risen) for lane in lanes)
    return tuple(replace(lane, left=move(lane.left), right=move(lane.right)) for lane, move in raised)


def _bridged(lane: LaneSurface, relief: Relief) -> LaneSurface:
    """Return a lane of a bridge (map coordinates), raised by the ground at its ends and linearly in between."""

    def risen(edge: Float) -> Float:
        ends = relief.rise(edge[[0, -1], :2])
        along = np.interp(lane.s, lane.s[[0, -1]], ends)
        moved: Float = edge + along[:, None] * [0, 0, 1]
        return moved

    return replace(lane, left=risen(lane.left), right=risen(lane.right))


def _surroundings(
    streets: StreetMap, levels: Levels, origin: Float, region: BaseGeometry, description: SiteDescription
) -> _Surroundings:
    extent, relief = region.convex_hull.buffer(SCENE_MARGIN, quad_segs=16), description.relief
    lanes = _strips(levels.studied, origin, extent, relief)
    if description.from_centre_lines:
        lanes = road_surface.without_loose_ends(lanes, region, extent)
    others = _strips(levels.others, origin, extent, relief, kerbs=False)
    areas, houses = None, NOTHING
    if streets.junctions:
        outlines = [one.outline for one in description.buildings if one.base < MIN_PASSAGE]
        outlines += [one.outline for one in description.solids]
        rings = ring_roads(streets.road_map.roads, description.roundabouts)
        islands = enclosed([lane.polygon for lane in lanes if lane.road_id in rings])
        houses = united([islands, *(shifted(one, -origin) for one in outlines)])
        sidewalks = [Sidewalk(one.line - origin[:2], one.width) for one in description.ways if one.line is not None]
        junctions = (_local_junction(one, origin) for one in streets.junctions)
        near = [one for one in junctions if extent.intersects(one.carriageway)]
        areas = street_areas(lanes, near, {road.id: road for road in streets.road_map.roads}, sidewalks, houses)
    roadside = road_surface.roadside(lanes) if areas is None else areas.roadside
    shapely.prepare(roadside.carriageway)
    land = description.relief or description.flat_land
    terrain, ground, crossing = _ground(levels, lanes, others, origin, land)
    beyond = shapely.box(*extent.buffer(10 * road_surface.MAX_STEP).bounds).difference(extent)
    above, below, on_ground = (cut(part, beyond) for part in (crossing.above, crossing.below, crossing.on_ground))
    crossing = replace(crossing, above=above, below=below, on_ground=on_ground)
    return _Surroundings(
        origin, lanes, areas, houses, region, extent, roadside, terrain, ground, relief, land, crossing
    )


def _local_junction(junction: JunctionArea, origin: Float) -> JunctionArea:
    carriageway, walking = (shifted(area, -origin) for area in (junction.carriageway, junction.walking))
    return replace(junction, carriageway=carriageway, walking=walking)


def _ground(
    levels: Levels,
    lanes: tuple[LaneSurface, ...],
    others: tuple[LaneSurface, ...],
    origin: Float,
    land: Relief | FlatLand | None,
) -> tuple[Terrain, Terrain, _OtherLevels]:
    """Return the terrain of the studied roads, the ground next to and below them, and the roads of other levels.

    If the height of the land is unknown, the ground has the height of the nearest studied road, and lower roads lie in
    cuttings between walls. Otherwise roads lie on embankments and in cuttings with slopes.
    """
    studied, away = _triangles(lanes), _triangles(others)
    if land is None:
        terrain = Terrain(studied)
        above = _rise(away, terrain) > 0.0
        return terrain, terrain, _OtherLevels(others, away[above], away[~above], away[~above], shapely.Polygon())

    def height(xy: Float) -> Float:
        local: Float = land.at(xy + origin[:2]) - origin[2]
        return local

    # A bridge over level land has its ends on the ground; only roads that rise above it somewhere are in the air.
    bridges = frozenset(
        lane.road_id
        for lane in (*lanes, *others)
        if lane.road_id in land.bridges and (lane.left[:, 2] - height(lane.left[:, :2])).max() > MIN_BRIDGE_HEIGHT
    )
    spans = tuple(_spans(levels, (*lanes, *others), origin))
    on_ground, in_air = _lifted(lanes, bridges, spans)
    others_on_ground, others_in_air = _lifted(others, bridges, spans)
    embankments = Embankments(np.concatenate([on_ground, others_on_ground]), height)
    ground = Terrain(np.concatenate([on_ground, others_on_ground]), embankments.height, embankments.steep)
    # The ground continues below decks. Ramps of other levels that are higher than the studied road occlude it, and the
    # lower ones are ground.
    decks = without(outline(in_air, road_surface.SNAP_GRID), outline(on_ground, road_surface.SNAP_GRID))
    high = _rise(others_on_ground, Terrain(studied)) > MIN_RAMP_HEIGHT
    in_way = np.concatenate([others_in_air, others_on_ground[high]])
    return (
        Terrain(studied, embankments.height, embankments.steep),
        ground,
        _OtherLevels(others, in_way, others_on_ground[~high], others_on_ground, decks),
    )


def _rise(triangles: Float, terrain: Terrain) -> Float:
    """Return the heights (n,) of the centres of triangles (n, 3, 3) above a terrain, metres."""
    middles: Float = triangles.mean(axis=1)
    rise: Float = middles[:, 2] - terrain.height(middles[:, :2])
    return rise


def _triangles(lanes: Sequence[LaneSurface]) -> Float:
    return np.concatenate([np.empty((0, 3, 3)), *(lane.triangles for lane in lanes)])


def _spans(levels: Levels, lanes: Sequence[LaneSurface], origin: Float) -> Iterator[tuple[BaseGeometry, float]]:
    """Yield the area of each crossing, with room for slopes, and the height above which roads are in the air there."""
    roads = road_surface.by_road(lanes)
    for crossing in levels.crossings:
        above, below = (_triangles(roads.get(road, [])) for road in (crossing.above, crossing.below))
        place = shapely.Point(np.array(crossing.place) - origin[:2])
        common = outline(above, road_surface.SNAP_GRID).intersection(outline(below, road_surface.SNAP_GRID))
        # Beyond the scene neither road has a surface, and nothing of the crossing is left.
        parts = [part for part in shapely.get_parts(common) if part.area > 0.0]
        part = min(parts, key=place.distance, default=None)
        if part is not None:
            low = float(Terrain(below).height(shapely.get_coordinates(part)).max())
            yield part.buffer(float(embankment_width(np.array(crossing.height)))), low + MIN_LEVEL_HEIGHT


def _lifted(
    lanes: Sequence[LaneSurface], bridges: Collection[str], spans: Iterable[tuple[BaseGeometry, float]]
) -> tuple[Float, Float]:
    """Return the surfaces of lanes (n, 3, 3) on the ground, and those in the air on bridges."""
    on_ground = _triangles([lane for lane in lanes if lane.road_id not in bridges])
    in_air = [_triangles([lane for lane in lanes if lane.road_id in bridges])]
    for area, low in spans:
        high = on_ground[:, :, 2].min(axis=1) > low
        outside = shapely.box(*area.buffer(SCENE_MARGIN).bounds).difference(area)
        near = high & shapely.intersects(area, shapely.polygons(on_ground[:, :, :2]))
        in_air.append(cut(on_ground[near], outside))
        on_ground = np.concatenate([on_ground[~near], cut(on_ground[near], area)])
    return on_ground, np.concatenate(in_air)


@dataclass(frozen=True, eq=False)
class _Surface:
    """Parts of the carriageway and of the pavements, their area in plan, and notes."""

    parts: tuple[Part, ...]
    area: BaseGeometry
    notes: tuple[str, ...]


def _surface(street: _Surroundings) -> _Surface:
    """Return the surfaces of the street: those of its areas in a network, otherwise those of its lanes."""
    if street.areas is not None:
        return _network_surface(street, street.areas)
    layers = SurfaceLayers(street.lanes, street.extent)
    carriageway = _surface_parts(street, layers)
    pavement, notes = _pavement_parts(street, layers)
    return _Surface((*carriageway, *pavement), layers.area, notes)


def _network_surface(street: _Surroundings, areas: StreetAreas) -> _Surface:
    groups = dict(areas.groups)
    terrain = Terrain(_triangles(road_surface.in_groups(street.lanes, road_surface.CARRIAGEWAY)))
    laid = {
        group: terrain.drape(without_crumbs(area.intersection(street.extent)), spacing=OVERLAY_SPACING)
        for group, area in groups.items()
    }
    pavement = without_crumbs(areas.pavement.intersection(street.extent))
    triangles = terrain.drape(pavement, spacing=OVERLAY_SPACING, above=road_surface.KERB_HEIGHT)
    parts, notes = _pavements(street, triangles)
    return _Surface((*_group_parts(laid), *parts), areas.whole, notes)


def _surface_parts(street: _Surroundings, layers: SurfaceLayers) -> list[Part]:
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
        Part(name, _solid(laid[group], material), (role,), keep_off="cycle-tracks" if group == "biking" else None)
        for group, (name, material, role) in SURFACES.items()
        if group in laid
    ]


def _pavement_parts(street: _Surroundings, layers: SurfaceLayers) -> tuple[list[Part], tuple[str, ...]]:
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


def _pavements(street: _Surroundings, triangles: Float) -> tuple[list[Part], tuple[str, ...]]:
    """Return pavements (n, 3, 3) near the region (for posts), those beyond it, kerbs and verges, and notes."""
    if len(triangles) == 0:
        verge = _verge_strip(street, street.roadside.sides())
        return [verge], ("the map has no pavements: new posts may stand on a strip of verge",)
    plan = shapely.polygons(triangles[:, :, :2])
    near = shapely.distance(street.region, plan) <= CANDIDATE_MARGIN
    kerbs = road_surface.kerb_faces(triangles, None if street.land is None else KERB_STEP)
    parts = [
        Part("Pavements", _solid(triangles[near], "pavement"), (Role.GROUND, Role.CANDIDATE_AREAS)),
        Part("Pavements beyond", _solid(triangles[~near], "pavement"), (Role.GROUND,)),
        Part("Kerbs", _solid(kerbs, "kerb"), (Role.GROUND,)),
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


def _verge_strip(street: _Surroundings, sides: BaseGeometry) -> Part:
    """Return a strip of verge along sides of the carriageway, except where the road continues and next to bridges."""
    inner, outer = VERGE_STRIP
    strip = without(sides.buffer(outer, cap_style="flat"), street.roadside.filled.buffer(inner))
    strip = without(strip, united([street.crossing.off_posts.buffer(outer), street.built_up]))
    near = strip.intersection(street.region.buffer(CANDIDATE_MARGIN))
    return _area_part("Verge strip", near, Role.CANDIDATE_AREAS, street)


def _verge_part(street: _Surroundings, furniture: Sequence[Part], surfaces: Sequence[Part]) -> Part:
    """Return the ground next to all lanes and under all furniture, slightly below the lanes and under their seams.

    Parameters
    ----------
    street : _Surroundings
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
    spacing = VERGE_SPACING if street.relief is None else RELIEF_SPACING
    triangles = street.ground.drape(open_ground, spacing=spacing, above=-VERGE_BELOW)
    return Part("Verge", _solid(triangles, "verge"), (Role.GROUND,))


def _plan(part: Part) -> BaseGeometry:
    """Return the area in plan of a part made of triangles, with its foot at the origin."""
    return outline(
        part.solid.vertices[np.array(part.solid.faces, dtype=np.int64).reshape(-1, 3)], road_surface.SNAP_GRID
    )


def _marking_part(street: _Surroundings, *, stop_lines: bool) -> Part:
    inside = road_surface.junctions_in_plan(street.lanes) if street.areas is None else street.areas.inside
    quads = road_surface.markings(street.lanes, street.extent, inside)
    if stop_lines:
        lines = road_surface.stop_lines(street.lanes, inside)
        lines = lines[shapely.contains_xy(street.extent, lines[:, :, :2].mean(axis=1))]
        quads = np.concatenate([quads, lines])
    return Part("Lane markings", _solid(quads, "marking"), (Role.DRESSING,))


def _weighted_parts(
    areas: Sequence[tuple[str, BaseGeometry, float]], street: _Surroundings, *, described: bool
) -> Iterator[Part]:
    for name, area, weight in areas:
        if area.intersects(street.region):
            yield _area_part(name, area, Role.WEIGHTED_REGIONS, street, weight=weight)
        elif described:
            raise SeipError(
                f"the weighted region {name!r} lies outside the region of interest; move it or widen the region"
            )


def _area_parts(description: SiteDescription, street: _Surroundings) -> list[Part]:
    kinds = ((description.forbidden_areas, Role.FORBIDDEN_AREAS), (description.mandatory_areas, Role.MANDATORY_AREAS))
    return [_area_part(area.name, area.polygon, role, street) for areas, role in kinds for area in areas]


def _keep_off_parts(
    description: SiteDescription, placed: Sequence[PlacedObject], street: _Surroundings
) -> Iterator[Part]:
    """Yield the areas from which rules exclude new posts, cut to the surroundings of the region.

    Landings at the crossings of the map are added unless it was made from centre lines: netconvert guesses crossings.
    """
    areas = [(one.rule, one.polygon) for one in description.keep_off_areas]
    if street.areas is not None:
        areas.append(("islands", medians(street.roadside)))
    if not description.from_centre_lines:
        areas += [("landings", landing) for landing in landings(placed)]
    near = without(street.region.buffer(CANDIDATE_MARGIN), street.roadside.carriageway)
    for number, (rule, about) in enumerate(RULES.items()):
        area = without_crumbs(united(area for name, area in areas if name == rule).intersection(near))
        part = _area_part(f"No new posts: {about.title.lower()}", area, Role.FORBIDDEN_AREAS, street, step=number)
        yield replace(part, keep_off=rule)


def _described_parts(description: SiteDescription, street: _Surroundings) -> list[Part]:
    """Return the parts of a description in local axes, standing on the ground."""
    parts: list[Part] = []
    for number, building in enumerate(description.buildings, start=1):
        parts += _building_parts(building, number, street)
    names = Counter[str]()
    parts += _solid_parts(description)
    for wall in description.walls:
        names[wall.name] += 1
        foot = _on_ground(wall.line, street) + np.array([0.0, 0.0, wall.base])
        panels = fence(foot, np.full(len(foot), wall.height), wall.thickness, side=wall.material)
        parts.append(_with_item_source(Part(f"{wall.name} {names[wall.name]}", panels, (Role.OCCLUDERS,)), wall))
    for slab in description.slabs:
        names[slab.name] += 1
        ground = float(street.terrain.height(shapely.get_coordinates(slab.outline)).min())
        plate = street_furniture.house(slab.outline, ground + slab.base, ground + slab.top, side=slab.material)
        parts.append(_with_item_source(Part(f"{slab.name} {names[slab.name]}", plate, (Role.OCCLUDERS,)), slab))
    trees = [(foot, row) for row in description.trees for foot in _on_ground(row.positions, street)]
    parts += [
        _with_item_source(tree_part(f"Tree {number}", foot, row.height, row.crown_diameter, number), row)
        for number, (foot, row) in enumerate(trees, start=1)
    ]
    parts += _pole_parts(description, street)
    return parts


def _building_parts(building: Building, number: int, street: _Surroundings) -> list[Part]:
    plan = shapely.get_coordinates(building.outline.exterior)[:-1]
    ground = float(street.terrain.height(plan).min()) + building.base
    base = np.column_stack([plan, np.full(len(plan), ground)])
    shape = None
    if building.outline.interiors:
        shape = street_furniture.house(building.outline, ground, ground + building.height, side=facade(number))
    made = building_parts(f"Building {number}", base, np.full(len(plan), building.height), number, shape)
    return [_with_item_source(part, building) for part in made]


def _solid_parts(description: SiteDescription) -> Iterator[Part]:
    """Yield the solids of separate files, numbered by name."""
    numbers = Counter[str]()
    for one in description.solids:
        numbers[one.name] += 1
        yield Part(f"{one.name} {numbers[one.name]}", one.solid, (Role.OCCLUDERS,), source=one.source)


def _with_item_source(part: Part, item: Building | Wall | Slab | Trees | Poles) -> Part:
    """Return a part with the source of its item; posts also with their rule, and without sensors if they carry none."""
    sourced = replace(part, source=item.source, height_assumed=item.height_assumed)
    if isinstance(item, Poles):
        return replace(sourced, keep_off=item.keep_off, roles=sourced.roles if item.carries else (Role.OCCLUDERS,))
    return sourced


def _side_way_parts(description: SiteDescription, street: _Surroundings, laid: BaseGeometry) -> list[Part]:
    """Return ways next to the road by kind, without areas of lanes, buildings, other roads and laid surfaces."""
    on_ground = [one for one in description.buildings if one.base < MIN_PASSAGE]
    standing: list[Building | PlacedSolid] = [*on_ground, *description.solids]
    houses = shapely.union_all([one.outline for one in standing])
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
        parts.append(Part(name, _solid(triangles, material), (Role.GROUND,)))
    return parts


def _pole_parts(description: SiteDescription, street: _Surroundings) -> Iterator[Part]:
    for number, (foot, heading, row) in enumerate(_pole_places(description.street_lights, street), start=1):
        shape = street_furniture.street_light(row.height, row.arm)
        yield _with_item_source(pole_part(f"Street light {number}", shape, foot, heading, row.source), row)
    keeps_left = any(lane.keeps_left for lane in street.lanes)
    for number, (foot, heading, row) in enumerate(_pole_places(description.signal_poles, street), start=1):
        shape = street_furniture.signal_pole(row.height, row.arm, faces_left=not keeps_left)
        whose = "the site file" if row.source == DESCRIBED else f"the {row.source}"
        yield _with_item_source(pole_part(f"Signal pole {number} of {whose}", shape, foot, heading, row.source), row)
    for number, (foot, heading, row) in enumerate(_pole_places(description.posts, street), start=1):
        shape = street_furniture.post(row.height, POST_RADIUS)
        pole = _with_item_source(pole_part(f"{row.name} {number}", shape, foot, heading, row.source), row)
        yield pole if row.height >= POLE_HEIGHT else replace(pole, roles=(Role.OCCLUDERS,))


def _pole_places(rows: Sequence[Poles], street: _Surroundings) -> Iterator[tuple[Float, float, Poles]]:
    """Yield foot, heading of the arm and row of each post."""
    for row in rows:
        for foot in _on_ground(row.positions, street):
            yield foot, arm_heading(foot[:2], street.roadside.carriageway) if row.heading is None else row.heading, row


def _on_ground(plan: Float, street: _Surroundings) -> Float:
    return np.column_stack([plan, street.terrain.height(plan)])


def _area_part(
    name: str, area: BaseGeometry, role: Role, street: _Surroundings, *, weight: float | None = None, step: int = 0
) -> Part:
    """Return an area in plan as an overlay on the ground; ``step`` raises it above other areas of the same role."""
    above, material = AREA_OVERLAYS[role]
    triangles = street.terrain.drape(area, spacing=OVERLAY_SPACING, above=above + step * OVERLAY_STEP)
    return Part(name, _solid(triangles, material), (role,), weight=weight)


def _solid(faces: Float, material: str) -> Solid:
    return from_faces(faces, material)
