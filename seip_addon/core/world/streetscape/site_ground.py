"""Ground, roadside and region of a site, from which its parts are placed, in local axes."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...geometry.plan import outline, united, without
from ..opendrive.lanes import LaneSurface
from . import road_surface
from .clearing import MAX_IN_LANE
from .description import SiteDescription
from .intersections import enclosed, ring_roads
from .levels import MIN_LEVEL_HEIGHT, Levels
from .place import SCENE_MARGIN, shifted
from .road_surface import Roadside
from .street_areas import NOTHING, StreetAreas, street_areas
from .street_map import StreetMap
from .terrain import Embankments, Relief, Terrain, cut, embankment_width

MIN_PASSAGE = 2.0  # metres above the ground from which on a building leaves room for ways below
MIN_BRIDGE_HEIGHT = 1.0  # metres above the land from which a road on a bridge is in the air
MIN_RAMP_HEIGHT = 1.0  # metres above the nearest studied road from which a ramp of another level is in the way


@dataclass(frozen=True, eq=False)
class OtherLevels:
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


@dataclass(frozen=True, eq=False)
class SiteGround:
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
    crossing: OtherLevels

    @cached_property
    def covered(self) -> BaseGeometry:
        """Area of the lanes in plan."""
        return road_surface.lane_outline(self.lanes) if self.areas is None else self.areas.whole

    @cached_property
    def lane_interiors(self) -> BaseGeometry:
        """Driving lanes without a strip along their edges, where posts count as standing next to the road."""
        driving = road_surface.lane_outline(road_surface.in_groups(self.lanes, ["driving"]))
        return driving.buffer(-MAX_IN_LANE)


def site_ground(
    streets: StreetMap, levels: Levels, origin: Float, region: BaseGeometry, description: SiteDescription
) -> SiteGround:
    """Return the ground, roadside and region of a site, from which its parts are placed.

    Parameters
    ----------
    streets : StreetMap
        Streets of the map.
    levels : Levels
        Their lanes on the level of the place and on others.
    origin : (3,) float64, metres
        Map coordinates of the local origin.
    region : shapely geometry
        Region of interest, local axes.
    description : SiteDescription
        Objects there, local axes, and the ground.
    """
    extent, relief = region.convex_hull.buffer(SCENE_MARGIN, quad_segs=16), description.relief
    lanes = _strips(levels.studied, origin, extent, relief)
    if streets.junctions:
        lanes = road_surface.without_loose_ends(lanes, region, extent)
    others = _strips(levels.others, origin, extent, relief, kerbs=False)
    houses = _built_up(streets, lanes, description) if streets.junctions else NOTHING
    areas = _network_areas(streets, lanes, origin, extent, description, houses) if streets.junctions else None
    roadside = road_surface.roadside(lanes) if areas is None else areas.roadside
    shapely.prepare(roadside.carriageway)
    terrain, ground, crossing = _ground(levels, lanes, others, origin, relief)
    beyond = shapely.box(*extent.buffer(10 * road_surface.MAX_STEP).bounds).difference(extent)
    above, below, on_ground = (cut(part, beyond) for part in (crossing.above, crossing.below, crossing.on_ground))
    crossing = replace(crossing, above=above, below=below, on_ground=on_ground)
    return SiteGround(origin, lanes, areas, houses, region, extent, roadside, terrain, ground, relief, crossing)


def _built_up(streets: StreetMap, lanes: Sequence[LaneSurface], description: SiteDescription) -> BaseGeometry:
    """Return the area of buildings on the ground and of the islands of roundabouts, local axes."""
    outlines = [one.outline for one in description.buildings if one.base < MIN_PASSAGE]
    rings = ring_roads(streets.road_map.roads, description.roundabouts)
    islands = enclosed([lane.polygon for lane in lanes if lane.road_id in rings])
    return united([islands, *outlines])


def _network_areas(
    streets: StreetMap,
    lanes: Sequence[LaneSurface],
    origin: Float,
    extent: BaseGeometry,
    description: SiteDescription,
    built_up: BaseGeometry,
) -> StreetAreas:
    """Return the areas of the streets of a network, local axes."""
    junctions = (
        replace(one, carriageway=shifted(one.carriageway, -origin), walking=shifted(one.walking, -origin))
        for one in streets.junctions
    )
    near = [one for one in junctions if extent.intersects(one.carriageway)]
    return street_areas(lanes, near, streets.road_map.roads, description.ways, built_up)


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
        moved: Float = on_relief(edge + shift, relief) - shift - height
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


def on_relief(points: Float, relief: Relief | None) -> Float:
    """Return points (3,) or (n, 3) of a map, raised by the ground under it."""
    if relief is None:
        return points
    risen = np.atleast_2d(points) + 0.0
    risen[:, 2] += relief.rise(risen[:, :2])
    return risen.reshape(points.shape)


def _ground(
    levels: Levels,
    lanes: tuple[LaneSurface, ...],
    others: tuple[LaneSurface, ...],
    origin: Float,
    land: Relief | None,
) -> tuple[Terrain, Terrain, OtherLevels]:
    """Return the terrain of the studied roads, the ground next to and below them, and the roads of other levels.

    If the height of the land is unknown, the ground has the height of the nearest studied road, and lower roads lie in
    cuttings between walls. Otherwise roads lie on embankments and in cuttings with slopes.
    """
    studied, away = triangles_of(lanes), triangles_of(others)
    if land is None:
        terrain = Terrain(studied)
        above = _rise(away, terrain) > 0.0
        return terrain, terrain, OtherLevels(others, away[above], away[~above], away[~above], shapely.Polygon())

    def height(xy: Float) -> Float:
        local: Float = land.raster.at(xy + origin[:2]) - origin[2]
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
        OtherLevels(others, in_way, others_on_ground[~high], others_on_ground, decks),
    )


def _rise(triangles: Float, terrain: Terrain) -> Float:
    """Return the heights (n,) of the centres of triangles (n, 3, 3) above a terrain, metres."""
    middles: Float = triangles.mean(axis=1)
    rise: Float = middles[:, 2] - terrain.height(middles[:, :2])
    return rise


def triangles_of(lanes: Sequence[LaneSurface]) -> Float:
    """Return the surfaces of lanes as triangles (n, 3, 3)."""
    return np.concatenate([np.empty((0, 3, 3)), *(lane.triangles for lane in lanes)])


def _spans(levels: Levels, lanes: Sequence[LaneSurface], origin: Float) -> Iterator[tuple[BaseGeometry, float]]:
    """Yield the area of each crossing, with room for slopes, and the height above which roads are in the air there."""
    roads = road_surface.by_road(lanes)
    for crossing in levels.crossings:
        above, below = (triangles_of(roads.get(road, [])) for road in (crossing.above, crossing.below))
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
    on_ground = triangles_of([lane for lane in lanes if lane.road_id not in bridges])
    in_air = [triangles_of([lane for lane in lanes if lane.road_id in bridges])]
    for area, low in spans:
        high = on_ground[:, :, 2].min(axis=1) > low
        outside = shapely.box(*area.buffer(SCENE_MARGIN).bounds).difference(area)
        near = high & shapely.intersects(area, shapely.polygons(on_ground[:, :, :2]))
        in_air.append(cut(on_ground[near], outside))
        on_ground = np.concatenate([on_ground[~near], cut(on_ground[near], area)])
    return on_ground, np.concatenate(in_air)
