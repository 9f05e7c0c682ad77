"""Model of a site from a map, an extract of OpenStreetMap or a site description."""

import tempfile
from collections.abc import Generator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely

from ..base.arrays import Float
from ..base.errors import SeipError
from ..base.progress import Progress
from ..base.settings import setting
from ..geometry.geo_reference import GeoReference
from ..storage.files import whole_file
from ..world.elevation.at_place import MapSurroundings, with_terrain
from ..world.opendrive.junctions import STREETS
from ..world.opendrive.read import read_map
from ..world.opendrive.road_map import RoadMap
from ..world.openstreetmap.network_map import credited
from ..world.openstreetmap.overpass import OverpassServer, download_extract, is_outgrown
from ..world.openstreetmap.site import (
    STANDS_AROUND,
    STREET_REACH,
    ExtractPlace,
    is_extract,
    place_on_map,
    site_of_extract,
    surroundings_of_map,
)
from ..world.streetscape.description import DEFAULT_RADIUS, SiteDescription
from ..world.streetscape.levels import UnclearLevelError
from ..world.streetscape.model import SiteModel, street_model
from ..world.streetscape.place import SCENE_MARGIN, Place
from ..world.streetscape.site_file import describe_place
from ..world.streetscape.street_map import StreetMap, opendrive_streets

DOWNLOAD_MARGIN = 200.0  # metres beyond the streets that are laid out: `site_of_extract` reads no more


@dataclass(frozen=True)
class SiteRequest(ExtractPlace):
    """Options of building a site, in addition to the file that it is built from and to the place in an extract.

    Parameters
    ----------
    near : (x, y) or None
        Centre of the site: map coordinates in metres.
    site : Path or None
        Site description for a map.
    osm : Path or None
        Extract whose buildings, trees and posts are added to an OpenDRIVE map.
    terrain : Path or None
        Elevation model that gives the ground of a flat map its heights.
    anywhere : bool
        Whether to use the centre of a map if no position is given.
    sumo : tuple of Path
        Folders to search for SUMO first, which lays out the streets of an extract.
    overpass : OverpassServer or None
        Server to download an extract around ``near_latlon`` from, where there is none that contains the place.
    """

    near: tuple[float, float] | None = None
    site: Path | None = None
    osm: Path | None = setting(
        None, "OpenStreetMap extract with buildings, trees and posts for a map", metavar="EXTRACT"
    )
    terrain: Path | None = setting(None, "ground for a flat map (GeoTIFF)", metavar="FILE")
    anywhere: bool = False
    sumo: tuple[Path, ...] = ()
    overpass: OverpassServer | None = None


@dataclass(frozen=True, eq=False)
class BuiltSite:
    """Model of a site with the name of its map, and the map itself if made from an extract.

    Parameters
    ----------
    map_name : str
        Name of the map's file, or of the extract's.
    map_text : str or None
        Map of the streets of an extract.
    map_path : path or None
        Map that is not made from an extract.
    """

    map_name: str
    model: SiteModel
    map_text: str | None = None
    map_path: Path | None = None


def build_site(
    source: Path | None, request: SiteRequest, map_path: Path | None = None
) -> Generator[Progress, None, BuiltSite]:
    """Build the model of a site.

    Parameters
    ----------
    source : Path or None
        OpenDRIVE map, extract of OpenStreetMap, or site description that names a map; None to download an extract.
    map_path : Path, optional
        File for the map of an extract's streets, which is written if a user must choose a level on it.

    Raises
    ------
    SeipError
        A file cannot be read or does not contain the position, the level is not clear, or an extract cannot be
        downloaded.
    """
    yield Progress(0, 0, "map")
    source = yield from site_source(request, source)
    if is_extract(source):
        return (yield from _of_extract(source, request, map_path))
    map_path, road_map, description = _of_map(source, request)
    streets = yield from opendrive_streets(road_map)
    notes: tuple[str, ...] = ()
    if request.osm is not None:
        where = _where(streets, description)
        description, notes = yield from surroundings_of_map(request.osm, streets, description, *where)
    description, more = _with_terrain(streets, description, request)
    model = yield from street_model(streets, description)
    return BuiltSite(map_path.name, replace(model, notes=(*notes, *more, *model.notes)), None, map_path)


def site_source(request: SiteRequest, source: Path | None = None) -> Generator[Progress, None, Path]:
    """Return the file to build a site from: the source, or an extract from a server.

    Parameters
    ----------
    source : Path, optional
        File that was chosen. An extract from a server is used if there is none, or if it is an earlier download that
        was deleted or does not contain the whole place.

    Raises
    ------
    SeipError
        There is no source, and the request names no place or no server, or the extract cannot be downloaded.
    """
    near = request.near_latlon
    if near is None or request.overpass is None:
        if source is None:
            raise SeipError("no map is named: give a map or an extract, or --at LAT,LON to download one")
        return source
    reach = max(request.reach, 0.0) + STREET_REACH + DOWNLOAD_MARGIN
    if source is not None and not is_outgrown(source, near, reach):
        return source
    return (yield from download_extract(near, reach, request.overpass))


def save_map(built: BuiltSite, path: Path) -> None:
    """Write the map of a site that was built from an extract, for simulating traffic on it.

    Raises
    ------
    SeipError
        The file cannot be written.
    """
    if built.map_text is not None:
        with whole_file(path) as temporary:
            temporary.write_text(built.map_text, encoding="utf-8")


def _of_extract(source: Path, request: SiteRequest, map_path: Path | None) -> Generator[Progress, None, BuiltSite]:
    if request.near is not None or request.osm is not None:
        raise SeipError(f"{source.name} is an extract of OpenStreetMap: give its position by --near-latlon LAT LON")
    with tempfile.TemporaryDirectory() as folder:
        network = Path(folder) / "streets.net.xml"
        site = yield from site_of_extract(source, request, network, request.sumo)
    found = site.description
    _, described = describe_place(source, site=request.site)
    description = replace(
        found.with_objects_of(described),
        weighted_regions=described.weighted_regions,
        forbidden_areas=described.forbidden_areas,
        mandatory_areas=described.mandatory_areas,
        region=described.region,
        name=described.name or found.name,
        level=request.level,
    )
    description, more = _with_terrain(site.network.streets, description, request)
    yield Progress(0, 0, "heights of streets")
    site = replace(site, description=description).on_ground()
    try:
        model = yield from street_model(site.network.streets, site.description)
    except UnclearLevelError as error:
        if map_path is None:
            raise
        with whole_file(map_path) as temporary:
            temporary.write_text(credited(site.network.text, site.description.attribution), encoding="utf-8")
        raise UnclearLevelError(f"{error}; {map_path} is written: the map of the streets there") from error
    map_text = credited(site.network.text, model.attribution)
    return BuiltSite(source.name, replace(model, notes=(*site.notes, *more, *model.notes)), map_text)


def _with_terrain(
    streets: StreetMap, description: SiteDescription, request: SiteRequest
) -> tuple[SiteDescription, tuple[str, ...]]:
    """Add the ground of an elevation model to a description."""
    if request.terrain is None:
        return description, ()
    middle, reach = _where(streets, description)
    area = shapely.Point(middle).buffer(reach + SCENE_MARGIN + STANDS_AROUND, quad_segs=16)
    x, y, z, heading = streets.road_map.header_offset.tolist()
    reference = GeoReference(streets.road_map.geo_reference or "", (x, y, z, heading))
    points = np.concatenate([np.empty((0, 3)), *(edge for lane in streets.lanes for edge in (lane.left, lane.right))])
    near = points[shapely.intersects_xy(area, points[:, :2])]
    return with_terrain(description, request.terrain, MapSurroundings(reference, area, near if len(near) else points))


def _of_map(source: Path, request: SiteRequest) -> tuple[Path, RoadMap, SiteDescription]:
    junction = STREETS.join(request.junction) or None
    map_path, described = describe_place(source, site=request.site)
    road_map = read_map(map_path)
    near = request.near if request.near_latlon is None else place_on_map(road_map, request.near_latlon)
    placed = described.near is not None or described.junction is not None or described.region is not None
    if request.anywhere and near is None and junction is None and not placed:
        near = road_map.middle()
    map_path, description = describe_place(
        source, site=request.site, near=near, junction=junction, radius=request.radius, approaches=request.approaches
    )
    return map_path, road_map, replace(description, level=request.level) if request.level else description


def _where(streets: StreetMap, description: SiteDescription) -> tuple[Float, float]:
    """Return the centre of a site, (2,) metres, and the largest distance of its region from there."""
    place = Place(streets.road_map, streets.lanes, description, streets.junctions)
    x_low, y_low, x_high, y_high = place.within.bounds
    x, y = place.centre.tolist()
    reach = max(abs(x_low - x), abs(x_high - x), abs(y_low - y), abs(y_high - y))
    return place.centre, max(reach, DEFAULT_RADIUS)
