"""Map of the streets in an extract of OpenStreetMap, and a description of the objects next to them."""

import math
from collections.abc import Collection, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...base.counts import counted
from ...base.errors import SeipError
from ...base.progress import Progress
from ...geometry.geo_reference import TransverseMercator, projection
from ...geometry.plan import united
from ...site.scene_geometry import FROM_EXTRACT
from ..opendrive.junctions import STREETS, nearest_junctions, streets_of_junctions
from ..opendrive.lanes import LaneSurface
from ..opendrive.road_map import Junction, RoadMap
from ..streetscape import road_surface
from ..streetscape.description import DEFAULT_RADIUS, SiteDescription
from ..streetscape.intersections import intersection
from ..streetscape.levels import UNNAMED_ROAD
from ..streetscape.named_places import street_names
from ..streetscape.place import SCENE_MARGIN
from ..streetscape.street_map import StreetMap
from ..streetscape.terrain import level_land
from .assumptions import MAX_NAMED, assumed_crossings, assumed_lanes, implausible_lane_notes, lane_notes, lone_signals
from .extract import EARTH_RADIUS, MAX_LATITUDE, Extract, Way, cropped, read_extract, window
from .heights import StreetHeights, street_heights
from .mapped_crossings import guessed_crossings, with_mapped_crossings
from .netconvert import convert
from .network_map import NetworkMap, read_network_map
from .plan_shapes import PlanShapes
from .street_lanes import has_widths
from .street_objects import surroundings
from .street_titles import MAX_JUNCTION_DISTANCE, crossing_pair, headings_at, meeting_place, ranks, spelt
from .streets import StreetFile, write_streets

EXTRACT_SUFFIXES = (".osm", ".osm.gz", ".osm.xml", ".pbf")
OTHER_SUFFIXES = (".json", ".geojson", ".osc", ".osc.gz", ".osm.bz2", ".osm.zip")
"""Suffixes of OpenStreetMap data in formats that `read_extract` refuses with the cure."""
STREET_REACH = 450.0  # metres beyond the region within which streets are laid out: traffic comes from there
MAX_ROUNDABOUT = 200.0  # metres across which a roundabout is one place at most
MIN_RAMP = 0.05  # metres: notes list streets that a bridge or ramp moves by at least this much
STANDS_AROUND = 20.0  # metres beyond the scene within which objects are included


@dataclass(frozen=True)
class ExtractPlace:
    """Place of an extract to study.

    Parameters
    ----------
    near_latlon : (latitude, longitude) or None, degrees
        Position of the place.
    junction : tuple of str
        Names of two or more streets that meet there, instead of the position; in a map, id or name of the junction.
    radius, approaches : float or None, metres
        See `SiteDescription`; without either the region follows the approaches of the junction.
    service : bool
        Whether driveways and aisles are streets.
    left_hand : bool or None
        Whether traffic keeps to the left; None to derive it from the extract.
    level : tuple of str
        Names of streets on the level to study.
    """

    near_latlon: tuple[float, float] | None = None
    junction: tuple[str, ...] = ()
    radius: float | None = None
    approaches: float | None = None
    service: bool = False
    left_hand: bool | None = None
    level: tuple[str, ...] = ()

    @property
    def reach(self) -> float:
        """Largest distance of the region from the place, metres."""
        return self.radius or self.along + MAX_JUNCTION_DISTANCE

    @property
    def along(self) -> float:
        """Length of the approaches of a junction in the region, metres."""
        return self.approaches or DEFAULT_RADIUS


def is_extract(path: Path) -> bool:
    """Return whether a file name is that of an extract, or of OpenStreetMap data in a format that is not supported."""
    return path.name.lower().endswith((*EXTRACT_SUFFIXES, *OTHER_SUFFIXES))


@dataclass(frozen=True, eq=False)
class ExtractSite:
    """Streets of an extract around a place, and the objects there.

    Parameters
    ----------
    network : NetworkMap
        Streets as netconvert lays them out, with the crossings of the extract: flat, unless the extract has heights.
    description : SiteDescription
        Objects next to the streets, and the extent of the region.
    notes : tuple of str
        Messages about assumptions and omissions.
    source : StreetFile
        Streets as written for netconvert.
    shapes : PlanShapes
        Shapes of the extract in map coordinates.
    area : shapely geometry
        Area that notes refer to, about the region of interest; map coordinates.
    """

    network: NetworkMap
    description: SiteDescription
    notes: tuple[str, ...]
    source: StreetFile
    shapes: PlanShapes
    area: BaseGeometry

    def on_ground(self) -> "ExtractSite":
        """Return the same site with its streets raised to the ground, onto bridges and into underpasses."""
        relief, streets = self.description.relief, self.network.streets
        ground = None if relief is None else relief.rise
        heights = street_heights(streets.road_map, self.source, self.shapes, ground)
        raised = replace(self, notes=(*self.notes, *heights.notes, *self._ramp_notes(heights)))
        if any(along_road.any() for _, along_road in heights.profiles.values()):
            network = replace(self.network.raised(heights.profiles), streets=streets.raised(heights.above_ground))
            raised = replace(raised, network=network)
            relief = level_land(0.0) if relief is None and not self.source.elevated else relief
        if relief is None:
            return raised
        relief = replace(relief, bridges=heights.bridges)
        return replace(raised, description=replace(self.description, relief=relief))

    def _ramp_notes(self, heights: StreetHeights) -> Iterator[str]:
        """Yield a note on the assumed heights of bridges, underpasses and their ramps in the area."""
        road_map = self.network.streets.road_map
        names = street_names(road_map)
        moved: dict[str, float] = {}
        for number, (along, above) in heights.above_ground.items():
            if not np.abs(above).max() >= MIN_RAMP:
                continue
            (road,) = (road for road in road_map.roads if road.id == number)
            near = above[shapely.intersects_xy(self.area, road.frame(along).origin[:, :2])]
            if len(near) and np.abs(near).max() >= MIN_RAMP and road.junction_id is None:
                most = float(near[np.argmax(np.abs(near))])
                name = names.get(number, UNNAMED_ROAD)
                moved[name] = max(moved.get(name, 0.0), most, key=abs)
        if moved:
            listed = ", ".join(
                f"{name} by up to {abs(most):.2f} m {'upwards' if most > 0 else 'downwards'}"
                for name, most in sorted(moved.items(), key=lambda one: (-abs(one[1]), one[0]))[:MAX_NAMED]
            )
            yield (
                f"the heights of bridges, underpasses and their ramps are assumed: they move {listed}; junctions on "
                "ramps may have a hump that the place does not have"
            )


def site_of_extract(
    path: Path, place: ExtractPlace, map_path: Path, sumo: Iterable[Path] = ()
) -> Generator[Progress, None, ExtractSite]:
    """Lay out the streets of an extract around a place, and describe the objects there.

    Parameters
    ----------
    path : Path
        Extract.
    place : ExtractPlace
        Place to study.
    map_path : Path
        Network of the streets to write (.net.xml). A temporary file is written next to it.
    sumo : iterable of Path
        Folders to search for SUMO first.

    Raises
    ------
    SeipError
        The extract cannot be read, or lacks the place or a street there, or SUMO is missing.
    """
    _check(path, place)
    extract, near, place_notes = yield from _extract_around(path, place)
    source, network = yield from _network(extract, near, place, map_path, sumo)
    shapes = PlanShapes(extract, _projection(network.streets.road_map), network.streets.road_map.header_offset[:2])
    streets = with_mapped_crossings(network.streets, source, shapes)
    extent = _extent(streets, source, extract, near, place)
    stands_there = surroundings(shapes, extent.surroundings, extent.carriageway)
    near_streets = [way for way in source.ways.values() if extent.seen.intersects(_path(shapes, way))]
    junction = extent.junction
    description = replace(
        stands_there,
        name=_name(extract, streets, source, place, extent),
        near=None if place.radius is None else (float(extent.middle[0]), float(extent.middle[1])),
        junction=junction.id if place.radius is None and junction is not None else None,
        radius=place.radius,
        approaches=place.approaches,
        roundabouts=extent.roundabouts,
        map_source=FROM_EXTRACT,
        widths_assumed=_assumed_widths(near_streets),
        attribution=(extract.attribution,),
    )
    lone = [extract.nodes[number] for number in source.lone_signals]
    notes = (
        *place_notes,
        *extract.notes,
        *source.notes,
        *assumed_lanes(near_streets),
        *lane_notes(near_streets, source.widened),
        *implausible_lane_notes(near_streets),
        *assumed_crossings(guessed_crossings(streets, extent.seen)),
        *(counted(number, *reason) for reason, number in shapes.dropped.items() if number),
        *lone_signals([node for node in lone if extent.seen.intersects(shapely.Point(shapes.point(node)))]),
    )
    sidewalks = shapely.MultiLineString([way.line for way in description.ways if way.line is not None])
    network = replace(network.walking_on(sidewalks), streets=streets)
    return ExtractSite(network, description, notes, source, shapes, extent.seen)


def _extract_around(
    path: Path, place: ExtractPlace
) -> Generator[Progress, None, tuple[Extract, tuple[float, float], tuple[str, ...]]]:
    """Return the part of an extract around a place, the latitude and longitude of the place, and notes on it."""
    # Streets are laid out well beyond the region, for traffic; 200 m more hold the junction that was named, whose
    # centre may lie away from the place.
    most = place.reach + STREET_REACH + 200.0
    extract = yield from read_extract(path, None if place.near_latlon is None else window(*place.near_latlon, most))
    near, notes = (place.near_latlon, ()) if place.near_latlon else meeting_place(extract, place.junction)
    return cropped(extract, window(*near, most)), near, notes


def _network(
    extract: Extract, near: tuple[float, float], place: ExtractPlace, map_path: Path, sumo: Iterable[Path]
) -> Generator[Progress, None, tuple[StreetFile, NetworkMap]]:
    """Write the streets around a place, and return them with the network that netconvert makes of them."""
    reach = place.reach + STREET_REACH
    streets_path = map_path.with_name(f"{map_path.name}.streets.osm")
    source = write_streets(
        extract, streets_path, window(*near, reach), service=place.service, left_hand=place.left_hand
    )
    try:
        if not source.ways:
            raise _no_street(extract, near, reach)
        yield from convert(source, streets_path, map_path, sumo)
    finally:
        streets_path.unlink(missing_ok=True)
    return source, read_network_map(map_path)


@dataclass(frozen=True, eq=False)
class _Extent:
    """Extent of a place: its junctions and areas, in map coordinates.

    Parameters
    ----------
    near : (latitude, longitude), degrees
        Position of the place.
    middle : (2,) float64, metres
        The same in map coordinates.
    junction : Junction or None
        Nearest junction.
    away : float, metres
        Its distance.
    together : frozenset of str
        Ids of the junctions that form one intersection with it.
    roundabouts : tuple of frozenset of str
        Junction ids of each roundabout.
    seen : shapely geometry
        Area about the region of interest, which notes refer to.
    surroundings : shapely geometry
        Area of the objects of the scene.
    carriageway : shapely geometry
        Carriageway within it.
    """

    near: tuple[float, float]
    middle: Float
    junction: Junction | None
    away: float
    together: frozenset[str]
    roundabouts: tuple[frozenset[str], ...]
    seen: BaseGeometry
    surroundings: BaseGeometry
    carriageway: BaseGeometry


def _extent(
    streets: StreetMap, source: StreetFile, extract: Extract, near: tuple[float, float], place: ExtractPlace
) -> _Extent:
    """Return what belongs to a place.

    Raises
    ------
    SeipError
        There is no junction near the place, and no radius is given.
    """
    road_map, lanes = streets.road_map, streets.lanes
    middle = np.array(place_on_map(road_map, near))
    found = nearest_junctions(road_map, lanes, float(middle[0]), float(middle[1]), 1)
    junction, away = found[0] if found else (None, math.inf)
    if away > MAX_JUNCTION_DISTANCE and place.radius is None:
        raise SeipError(
            f"no junction within {MAX_JUNCTION_DISTANCE:g} m of {near[0]:.5f}, {near[1]:.5f}: give a radius "
            "for a place between junctions, or count service roads where driveways or aisles are streets too"
        )
    roundabouts = _roundabouts(road_map, source, extract)
    together = frozenset[str]() if junction is None else intersection(lanes, junction.id, roundabouts)
    size = _reach(lanes, together, middle) + place.along
    reach = place.reach if place.radius else max(place.reach, size)
    return _Extent(
        near,
        middle,
        junction,
        away,
        together,
        roundabouts,
        shapely.Point(middle).buffer(place.radius or size),
        shapely.Point(middle).buffer(reach + SCENE_MARGIN + STANDS_AROUND, quad_segs=16),
        _carriageway(streets, middle, reach),
    )


def _name(extract: Extract, streets: StreetMap, source: StreetFile, place: ExtractPlace, extent: _Extent) -> str:
    """Return the title of a place: the streets that were asked for, or those that meet there."""
    names = [spelt(extract, name) for name in place.junction] or _title(streets, source, place, extent)
    if names:
        return STREETS.join(names)
    latitude, longitude = extent.near
    kind = "Junction" if extent.away <= (place.radius or math.inf) else "Street"
    return f"{kind} at {latitude:.5f}, {longitude:.5f}"


def _path(shapes: PlanShapes, way: Way) -> BaseGeometry:
    """Return the line of a way, map coordinates; empty if the extract has fewer than two of its nodes."""
    line = shapes.line(way)
    return shapely.LineString(line if len(line) > 1 else None)


def _assumed_widths(ways: Iterable[Way]) -> frozenset[str]:
    """Return the groups of lanes whose widths are assumed for some streets; those of pavements always are."""
    known = all(has_widths(way.tags) for way in ways if "highway" in way.tags)
    return frozenset({"sidewalk", "biking"}) if known else frozenset({"sidewalk", "biking", "driving"})


def _check(path: Path, place: ExtractPlace) -> None:
    """Raise an error if a place is not given, or not validly."""
    for name, length in (("radius", place.radius), ("approaches", place.approaches)):
        if length is not None and not 0.0 < length < math.inf:
            raise SeipError(f"--{name} {length:g} is not a valid length: give metres above zero")
    names = {name.strip().casefold() for name in place.junction} - {""}
    if place.near_latlon is not None:
        latitude, longitude = place.near_latlon
        if not (abs(latitude) <= MAX_LATITUDE and abs(longitude) <= 180.0):
            raise SeipError(
                f"--near-latlon {latitude:g} {longitude:g} is not a valid place: give degrees, the latitude first, up "
                f"to {MAX_LATITUDE:g}, then the longitude, up to 180"
            )
    elif not names:
        raise SeipError(f'{path.name} needs a place: --near-latlon LAT LON, or --junction "One Street" "Other Street"')
    if place.junction and len(names) < max(len(place.junction), 2):
        raise SeipError('--junction takes the names of two different streets: --junction "One Street" "Other Street"')


def surroundings_of_map(
    path: Path, streets: StreetMap, description: SiteDescription, middle: Float, reach: float
) -> Generator[Progress, None, tuple[SiteDescription, tuple[str, ...]]]:
    """Add the surroundings of a place on a map, read from an extract, to a description.

    Parameters
    ----------
    path : Path
        Extract.
    streets : StreetMap
        Map that the place is on.
    description : SiteDescription
        Description to add to.
    middle : (2,) float64, metres
        Centre of the place, map coordinates.
    reach : float, metres
        Largest distance of the region from it.

    Raises
    ------
    SeipError
        The extract cannot be read or has no objects at the place, or the map has no known projection.
    """
    extract = yield from read_extract(path)
    shapes = PlanShapes(extract, _projection(streets.road_map), streets.road_map.header_offset[:2])
    area = shapely.Point(middle).buffer(reach + SCENE_MARGIN + STANDS_AROUND, quad_segs=16)
    found = surroundings(shapes, area, _carriageway(streets, middle, reach))
    if not found.has_objects:
        raise SeipError(f"{path.name} has no objects at the place: use an extract of the area of the map")
    dropped = [counted(number, *reason) for reason, number in shapes.dropped.items() if number]
    found = replace(found, attribution=(extract.attribution,))
    return description.with_objects_of(found), (*extract.notes, *dropped)


def place_on_map(road_map: RoadMap, near: tuple[float, float]) -> tuple[float, float]:
    """Return the map coordinates x and y (metres) of a latitude and longitude (degrees).

    Raises
    ------
    SeipError
        The map has no known projection.
    """
    east, north = _projection(road_map)(math.radians(near[0]), math.radians(near[1]))
    return east - float(road_map.header_offset[0]), north - float(road_map.header_offset[1])


def _projection(road_map: RoadMap) -> TransverseMercator:
    to_map = projection(road_map.geo_reference)
    if to_map is None or road_map.header_offset[3]:
        raise SeipError(
            f"map {road_map.name!r} has no projection for latitudes and longitudes: "
            "its <geoReference> must be a UTM zone or a transverse Mercator projection"
        )
    return to_map


def _carriageway(streets: StreetMap, middle: Float, reach: float) -> BaseGeometry:
    near = shapely.Point(middle).buffer(reach + SCENE_MARGIN + STANDS_AROUND)
    driving = [lane for lane in road_surface.in_groups(streets.lanes, ["driving"]) if road_surface.is_near(lane, near)]
    junctions = [one.carriageway for one in streets.junctions if one.carriageway.intersects(near)]
    return road_surface.without_crumbs(united([road_surface.lane_outline(driving), *junctions]))


def _roundabouts(road_map: RoadMap, streets: StreetFile, extract: Extract) -> tuple[frozenset[str], ...]:
    """Return the junction ids of each roundabout up to `MAX_ROUNDABOUT` across; larger ones are left out."""
    # netconvert names junctions by their node. A ring road around a whole quarter is tagged as a roundabout too; its
    # junctions are separate places.
    by_node = {junction.name: junction.id for junction in road_map.junctions}
    found = []
    for nodes in streets.roundabouts:
        latitudes = [extract.nodes[number].latitude for number in nodes]
        if max(latitudes) - min(latitudes) < math.degrees(MAX_ROUNDABOUT / EARTH_RADIUS):
            found.append(frozenset(by_node[str(number)] for number in nodes if str(number) in by_node))
    return tuple(found)


def _reach(lanes: Sequence[LaneSurface], junctions: Collection[str], middle: Float) -> float:
    """Return the largest distance from a place to the lanes within junctions, metres."""
    corners = [lane.left[:, :2] - middle for lane in lanes if lane.junction_id in junctions]
    return float(np.hypot(*np.concatenate([np.zeros((1, 2)), *corners]).T).max())


def _title(streets: StreetMap, source: StreetFile, place: ExtractPlace, extent: _Extent) -> list[str]:
    """Return the names of up to two streets for the title of a place.

    These are the streets of the nearest junction, if it lies within the radius; otherwise those of the level, or the
    nearest street.
    """
    road_map, lanes = streets.road_map, streets.lanes
    radius = math.inf if place.radius is None else place.radius
    on_level = {name.strip().casefold() for name in place.level}
    level = list(dict.fromkeys(r.name for r in road_map.roads if on_level & {r.name.casefold(), r.id} and r.name))
    junction = extent.junction
    if junction is not None and extent.away <= radius:
        meeting = streets_of_junctions(road_map, lanes)
        numbers = sorted(extent.together, key=lambda number: (number != junction.id, number))
        names = dict.fromkeys(name for number in numbers for name in meeting.get(number, ()))
        if place.radius is None or not level or set(level) & set(names):
            ranked = sorted(names, key=ranks(source.ways.values()).__getitem__)
            return crossing_pair(ranked, headings_at(road_map, lanes, extent.together))
    if level:
        return level[:2]
    called = road_map.names
    driving = [lane for lane in road_surface.in_groups(lanes, ["driving"]) if called[lane.road_id]]
    here = shapely.Point(extent.middle)
    nearest = min(driving, key=lambda lane: float(lane.polygon.distance(here)), default=None)
    return (
        [] if nearest is None or nearest.polygon.distance(here) > (place.radius or 0.0) else [called[nearest.road_id]]
    )


def _no_street(extract: Extract, near: tuple[float, float], reach: float) -> SeipError:
    return SeipError(
        f"{extract.name} has no street within {reach:,.0f} m of {near[0]:.5f}, {near[1]:.5f}: give a place on one of "
        "its streets, latitude before longitude, or count service roads where driveways or aisles are streets too"
    )
