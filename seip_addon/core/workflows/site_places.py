"""Places of a file at which a site can be built, for a user to choose from."""

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

from ..base.distinct_names import distinct_names
from ..base.progress import Progress
from ..world.opendrive.junctions import STREETS, streets_of_junctions
from ..world.opendrive.read import read_map
from ..world.openstreetmap.crossings import Crossing, named_crossings
from ..world.openstreetmap.extract import read_extract
from ..world.openstreetmap.site import is_extract
from ..world.street_plan import StreetPlan, plan_of_extract, plan_of_map
from ..world.streetscape.description import DEFAULT_RADIUS
from ..world.streetscape.site_file import describe_place
from ..world.streetscape.street_map import opendrive_streets


@dataclass(frozen=True)
class NamedPlace:
    """A junction.

    Parameters
    ----------
    name : str
        Name to display, which is unique in the file.
    key : str
        Id in a map; in an extract, latitude and longitude in the form that `parsed_position` reads.
    """

    name: str
    key: str


@dataclass(frozen=True)
class SitePlaces:
    """The places of a file.

    Parameters
    ----------
    radius : float, metres
        Default radius of a site.
    places : tuple of NamedPlace
        Junctions of the file.
    plan : StreetPlan
        Streets in plan, with the junctions in the order of ``places``.
    """

    radius: float
    places: tuple[NamedPlace, ...]
    plan: StreetPlan


def site_places(source: Path) -> Generator[Progress, None, SitePlaces]:
    """List the junctions of a map, or of the map that a site description names, or the crossings of an extract.

    Raises
    ------
    SeipError
        The file cannot be read.
    """
    yield Progress(0, 0, "reading the file")
    if is_extract(source):
        extract = yield from read_extract(source)
        crossings = named_crossings(extract)
        named = distinct_names((one.name for one in crossings), "{} ({})")
        places = tuple(NamedPlace(name, _position(one)) for name, one in zip(named, crossings, strict=True))
        return SitePlaces(DEFAULT_RADIUS, places, plan_of_extract(extract, crossings))
    map_path, description = describe_place(source)
    road_map = read_map(map_path)
    lanes = (yield from opendrive_streets(road_map)).lanes
    meeting = streets_of_junctions(road_map, lanes)
    junctions = road_map.junctions_with_roads()
    streets = {one.id: STREETS.join(meeting.get(one.id, ())) for one in junctions}
    own = {one.id: one.name for one in junctions if one.name.casefold() != f"junction{one.id}"}
    named = [" · ".join(filter(None, (one.id, own.get(one.id), streets[one.id]))) for one in junctions]
    places = tuple(
        NamedPlace(name, one.id) for name, one in zip(distinct_names(named, "{} ({})"), junctions, strict=True)
    )
    return SitePlaces(description.radius or DEFAULT_RADIUS, places, plan_of_map(road_map, lanes, junctions))


def _position(crossing: Crossing) -> str:
    return f"{crossing.latitude:.7f}, {crossing.longitude:.7f}"
