"""Sites of a network: junctions of an extract, or rows of a table."""

from __future__ import annotations

import csv
import io
import math
import re
import unicodedata
import xml.etree.ElementTree as ET
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Float
from ..base.distinct_names import distinct_names
from ..base.errors import SeipError
from ..base.limits import LATITUDE, LONGITUDE, WEIGHT, Limits
from ..base.progress import Progress
from ..choosing.placement.objective import Objective
from ..geometry.geo_reference import GeoReference
from ..geometry.solids import from_faces
from ..geometry.tangent_plane import plan_metres
from ..site.roles import Role
from ..storage.files import digest, read_small
from ..world.openstreetmap.crossings import SAME_JUNCTION, selected_junctions
from ..world.openstreetmap.extract import Extract, Tags, cropped, read_extract, window
from ..world.openstreetmap.site import STREET_REACH, ExtractPlace
from ..world.streetscape.model import SiteModel
from ..world.streetscape.parts import Part
from .survey_settings import SurveySettings

XML_CONTROL = {number: None for number in range(32) if number not in (9, 10, 13)}
"""Control characters, which XML cannot hold."""
MOST_SITES = 20_000
APPROACHES = 40.0
"""Default length of the approaches in a site of a network, metres: half of that of a single site."""
NEIGHBOUR_REACH = 4.0
"""Sites within this multiple of the approaches are neighbours, between which the road is divided."""
_MOST_BYTES = 1 << 28
_COLUMNS = ("source", "latitude", "longitude")
_NUMBER_COLUMNS: Mapping[str, Limits] = {"latitude": LATITUDE, "longitude": LONGITUDE, "weight": WEIGHT}
_FOREIGN = str.maketrans({"ß": "ss", "ø": "o", "æ": "ae", "œ": "oe", "ł": "l", "đ": "d"})


def extract_xml(extract: Extract) -> bytes:
    """Return an extract as OpenStreetMap XML; the same elements give the same bytes, whatever their order.

    Elements are sorted by id. The credit of the data is kept as the holder of the rights and the date.
    """
    root = ET.Element("osm", {"version": "0.6", **_credit(extract.attribution)})
    for number, node in sorted(extract.nodes.items()):
        place = {"id": str(number), "lat": repr(node.latitude), "lon": repr(node.longitude)}
        ET.SubElement(root, "node", place).extend(_tags(node.tags))
    for number, way in sorted(extract.ways.items()):
        element = ET.SubElement(root, "way", {"id": str(number)})
        element.extend(ET.Element("nd", {"ref": str(node)}) for node in way.nodes)
        element.extend(_tags(way.tags))
    for number, relation in sorted(extract.relations.items()):
        element = ET.SubElement(root, "relation", {"id": str(number)})
        element.extend(
            ET.Element("member", {"type": kind, "ref": str(ref), "role": _text(role)})
            for kind, ref, role in relation.members
        )
        element.extend(_tags(relation.tags))
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True))


def _tags(tags: Tags) -> Iterator[ET.Element]:
    for key, value in sorted(tags.items()):
        yield ET.Element("tag", {"k": _text(key), "v": _text(value)})


def _credit(attribution: str) -> dict[str, str]:
    holder, _, date = attribution.partition(", data of ")
    credit = {"copyright": _text(holder.removeprefix("© ").removesuffix(" (ODbL)").partition(", changes up to ")[0])}
    return {**credit, "timestamp": date} if date else credit


def _text(text: str) -> str:
    return text.translate(XML_CONTROL)


@dataclass(frozen=True)
class NetworkPlace:
    """Place of a network before it is built.

    Parameters
    ----------
    name : str
    folder : str
        Name of its folder, unique in the network.
    latitude, longitude : float, degrees
    weight : float
        Importance relative to the other sites.
    source : Path
        Extract, OpenDRIVE map or .blend.
    neighbours : tuple of (latitude, longitude), degrees
        Sites nearby, to which the road nearer to them belongs.
    """

    name: str
    folder: str
    latitude: float
    longitude: float
    weight: float
    source: Path
    neighbours: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class NetworkRequest:
    """Choices of a network besides its places.

    Parameters
    ----------
    budget : float, dollars
    tolerance : float
        Gap at which the search ends, as a share of the value.
    objective : Objective
        Criterion and largest number of sensors at each site.
    """

    budget: float
    tolerance: float
    approaches: float
    settings: SurveySettings
    objective: Objective


def extract_places(
    path: Path, rules: Sequence[str], within: BaseGeometry | None, approaches: float
) -> Generator[Progress, None, tuple[NetworkPlace, ...]]:
    """Return the junctions of an extract that rules select; all have the weight 1.

    Raises
    ------
    SeipError
        Same as for `read_extract` and `selected_junctions`.
    """
    extract = yield from read_extract(path)
    junctions = selected_junctions(extract, rules, within)
    return _numbered(
        [NetworkPlace(one.name, "", one.latitude, one.longitude, 1.0, path) for one in junctions], approaches
    )


def table_places(path: Path, approaches: float) -> tuple[NetworkPlace, ...]:
    """Return the sites of a table (CSV) with the columns source, latitude, longitude and, if known, name and weight.

    Paths of sources are relative to the table.

    Raises
    ------
    SeipError
        The table cannot be read, lacks a column or a source, or has an invalid number or the same site twice.
    """
    rows = list(_rows(path))
    if not rows:
        raise SeipError(f"{path} has no sites: give each site a row with {', '.join(_COLUMNS)}")
    if len(rows) > MOST_SITES:
        raise SeipError(f"{path} has {len(rows):,} sites; at most {MOST_SITES:,} are possible: divide it")
    places = []
    for line, row in rows:
        numbers = {name: _number(path, line, name, row, limits) for name, limits in _NUMBER_COLUMNS.items()}
        source = path.parent / row.get("source", "")  # a row may end before the column
        try:
            there = source.is_file()
        except OSError:  # a name longer than the system allows
            there = False
        if not there:
            raise SeipError(f"{path} row {line}: there is no file {_brief(str(source))}; correct the source")
        name = row.get("name") or f"Site at {numbers['latitude']:.5f}, {numbers['longitude']:.5f}"
        places.append(NetworkPlace(name, "", numbers["latitude"], numbers["longitude"], numbers["weight"], source))
    if not any(place.weight for place in places):
        raise SeipError(f"{path}: the weight of every site is 0; give some site a positive weight")
    _check_apart(path, [line for line, _ in rows], places)
    return _numbered(places, approaches)


def site_source(place: NetworkPlace, approaches: float, extract: Extract | None) -> bytes:
    """Return the content of the file that a site is built from: its part of an extract, or the whole file.

    Parameters
    ----------
    extract : Extract or None
        Content of the source if that is an extract.
    """
    if extract is not None:
        reach = ExtractPlace(approaches=approaches).reach + STREET_REACH + 200.0  # as `site_of_extract` has it
        return extract_xml(cropped(extract, window(place.latitude, place.longitude, reach)))
    return read_small(place.source, _MOST_BYTES, "divide it")


def site_key(place: NetworkPlace, content: bytes, *settings: str) -> str:
    """Return the key of a site: a digest of everything that its survey depends on."""
    numbers = np.array([(place.latitude, place.longitude), *place.neighbours])
    return digest(place.name, content, numbers, *settings)


def divided(model: SiteModel, place: NetworkPlace) -> SiteModel:
    """Return the model of a site without the road and the positions that are nearer to a neighbouring site.

    The region of interest is cut, and a forbidden area is added where the neighbours' positions are: every target and
    every position belongs to one site, so that none counts twice and none is paid twice.
    """
    cell = _cell(model, place)
    if cell is None or cell.contains(model.region):
        return model
    region = model.region.intersection(cell)
    if region.area <= 0.0:
        raise SeipError(f"the road at {place.name} belongs to neighbouring sites: leave this site out")
    x_low, y_low, x_high, y_high = model.region.buffer(NEIGHBOUR_REACH * APPROACHES).bounds
    beyond = shapely.box(x_low, y_low, x_high, y_high).difference(cell)
    parts = [_cut(part, region) if Role.REGION in part.roles else part for part in model.parts]
    level = float(np.concatenate([part.solid.vertices for part in parts if Role.REGION in part.roles])[:, 2].mean())
    solid = from_faces(_faces(beyond, level), "forbidden veil")
    forbidden = Part("Neighbouring sites", solid, (Role.FORBIDDEN_AREAS,))
    note = "road and positions that are nearer to a neighbouring site of the network belong to that site"
    return replace(model, region=region, parts=(*parts, forbidden), notes=(*model.notes, note))


def _cell(model: SiteModel, place: NetworkPlace) -> BaseGeometry | None:
    """Return the area that is nearer to a site than to its neighbours, local axes; None without neighbours."""
    x, y, z, heading = model.header_offset.tolist()
    mercator = GeoReference(model.geo_reference or "", (x, y, z, heading)).mercator
    if mercator is None or not place.neighbours:
        return None
    own, *others = (
        np.array(mercator(math.radians(latitude), math.radians(longitude))) - (x, y) - model.origin[:2]
        for latitude, longitude in ((place.latitude, place.longitude), *place.neighbours)
    )
    far = 1e5
    cell: BaseGeometry = shapely.box(*(own - far), *(own + far))
    for other in others:
        ahead = (other - own) / np.hypot(*(other - own))
        left = np.array([-ahead[1], ahead[0]])
        middle = (own + other) / 2
        half = [middle + left * far, middle - left * far, middle - (left + ahead) * far, middle + (left - ahead) * far]
        cell = cell.intersection(shapely.Polygon(half))
    return cell


def _cut(part: Part, area: BaseGeometry) -> Part:
    """Return an overlay cut to an area in plan; its height is the mean of what it was."""
    level = float(part.solid.vertices[:, 2].mean())
    return replace(part, solid=from_faces(_faces(area, level), part.solid.materials[0]))


def _faces(area: BaseGeometry, level: float) -> Float:
    """Return the triangles (n, 3, 3) of an area in plan at a level."""
    polygons = [one for one in shapely.get_parts(area) if one.geom_type == "Polygon" and one.area > 0.0]
    triangles = [
        shapely.get_coordinates(shapely.orient_polygons(face))[:3]
        for polygon in polygons
        for face in shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
    ]
    plan = np.array(triangles).reshape(-1, 3, 2)
    return np.dstack([plan, np.full(plan.shape[:2], level)])


def _numbered(places: Sequence[NetworkPlace], approaches: float) -> tuple[NetworkPlace, ...]:
    """Return places with unique folders, and their neighbours."""
    plane = _plane(places)
    tree = shapely.STRtree(shapely.points(plane))
    folders = distinct_names(_folder_name(place.name) for place in places)
    found = []
    for number, (place, folder) in enumerate(zip(places, folders, strict=True)):
        near = tree.query(shapely.Point(plane[number]), "dwithin", distance=NEIGHBOUR_REACH * approaches)
        others = (places[other] for other in sorted(near.tolist()) if other != number)
        found.append(replace(place, folder=folder, neighbours=tuple((one.latitude, one.longitude) for one in others)))
    return tuple(found)


def _plane(places: Sequence[NetworkPlace]) -> Float:
    """Return metres east and north of the first place, (n, 2)."""
    degrees = [(place.latitude, place.longitude) for place in places]
    return plan_metres(degrees, degrees[0])


def _folder_name(name: str) -> str:
    """Return a name in small letters, digits and hyphens; names with letters of other scripts become a digest."""
    parts = unicodedata.normalize("NFKD", name.casefold().translate(_FOREIGN))
    foreign = any(letter.isalpha() and not letter.isascii() for letter in parts)
    stem = re.sub(r"[^a-z0-9]+", "-", parts.encode("ascii", "ignore").decode()).strip("-")[:60]
    return f"site-{digest(name)[:8]}" if foreign or not stem else stem


def _rows(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield number and columns of each row of a table."""
    content = read_small(path, _MOST_BYTES, "give a table of sites")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SeipError(f"{path} is not in UTF-8: save it as CSV in UTF-8") from error
    delimiter = max(",;\t", key=text.partition("\n")[0].count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter)
    try:
        head = [name.strip().casefold() for name in next(reader, [])]
        missing = [name for name in _COLUMNS if name not in head]
        if missing:
            raise SeipError(
                f"{path} has no column {missing[0]!r}: its first row must name source, latitude and longitude, and may "
                "name name and weight"
            )
        for row in reader:
            if any(cell.strip() for cell in row):
                yield reader.line_num, dict(zip(head, (cell.strip() for cell in row), strict=False))
    except csv.Error as error:
        raise SeipError(f"{path} is not a valid CSV: {error}; save it again") from error


def _brief(text: str) -> str:
    return text if len(text) <= 200 else f"{text[:100]}…{text[-100:]}"


def _number(path: Path, line: int, name: str, row: Mapping[str, str], limits: Limits) -> float:
    text = row.get(name, "")
    if name == "weight" and not text:
        return 1.0
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not limits.allow(value):
        raise SeipError(f"{path} row {line}: the {name} must be {limits}, not {text[:40]!r}; correct it")
    return value


def _check_apart(path: Path, lines: Sequence[int], places: Sequence[NetworkPlace]) -> None:
    """Raise SeipError if two rows are the same site."""
    plane = _plane(places)
    points = shapely.points(plane)
    one, other = shapely.STRtree(points).query(points, "dwithin", distance=SAME_JUNCTION)
    same = next(((a, b) for a, b in zip(one.tolist(), other.tolist(), strict=True) if a < b), None)
    if same is not None:
        apart = float(np.hypot(*(plane[same[0]] - plane[same[1]])))
        raise SeipError(
            f"{path} rows {lines[same[0]]} and {lines[same[1]]} are {apart:.0f} m apart, which is one site: "
            "keep one of them"
        )
