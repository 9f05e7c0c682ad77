"""Extracts of OpenStreetMap: nodes, ways and relations with their tags, read from XML or PBF."""

import itertools
import math
import re
from collections.abc import Generator, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ...base.arrays import Float
from ...base.counts import counted
from ...base.errors import SeipError
from ...base.progress import Progress
from ...geometry.tangent_plane import plan_metres
from ...site.sources import one_line
from ...storage.xml_stream import Attributes, quoted, read_tags
from ..other_formats import GZIP, other_format

MAX_ELEMENTS = 3_000_000  # nodes, ways and relations that are kept at most: about a city
EARTH_RADIUS = 6_350_000.0  # metres: below the smallest real radius, so that windows are no smaller than requested
MAX_LATITUDE = 85.0  # degrees: projections of streets do not hold nearer to a pole
PBF_START = b"\x00\x00\x00"
"""First bytes of the PBF format: the length of its first header, in network order."""
PBF_STEP = 100_000  # elements of a PBF file between two reports of progress
_KINDS = {"n": "node", "w": "way", "r": "relation"}
MAX_TAG = 255  # characters of a tag's value, as in the database of OpenStreetMap
MAX_ID = 2**62
OPENSTREETMAP = "© OpenStreetMap contributors (ODbL)"
_DAY = re.compile(r"\d{4}-\d\d-\d\d(?=T|$)")
_NO_TAGS: Mapping[str, str] = MappingProxyType({})
_OTHER_SIDE = {"forward": "backward", "backward": "forward", "left": "right", "right": "left"}
_SIDED_KEYS = ("sidewalk", "cycleway", "busway")
"""Keys of which a value ``left`` or ``right`` is a side of the way."""

NEXT_NODE = 3_000.0  # metres beyond a window within which the next node of a street that leaves it is looked for

Tags = Mapping[str, str]
Window = tuple[float, float, float, float]
"""South, west, north and east, degrees."""


@dataclass(frozen=True, eq=False, slots=True)
class Node:
    """Latitude and longitude of a node, degrees, and its tags."""

    latitude: float
    longitude: float
    tags: Tags


@dataclass(frozen=True, eq=False, slots=True)
class Way:
    """Ids of the nodes of a way, in order, and its tags."""

    nodes: tuple[int, ...]
    tags: Tags

    @property
    def is_closed(self) -> bool:
        """Whether the way is a ring: its last node is its first."""
        return len(self.nodes) > 3 and self.nodes[0] == self.nodes[-1]


def reversed_tags(tags: Tags) -> dict[str, str]:
    """Return the tags of the same way with its nodes in the opposite order.

    Lists of lanes are in driving direction, so that they stay as they are.
    """
    return {
        ":".join(_OTHER_SIDE.get(part, part) for part in key.split(":")): (
            _OTHER_SIDE.get(value, value) if key in _SIDED_KEYS else value
        )
        for key, value in tags.items()
    }


def _in_driving_direction(way: Way) -> Way:
    """Return a way with its nodes in the order in which traffic passes them, if it is drawn against its traffic."""
    if way.tags.get("oneway") not in ("-1", "reverse"):
        return way
    return Way(way.nodes[::-1], reversed_tags(way.tags) | {"oneway": "yes"})


@dataclass(frozen=True, eq=False, slots=True)
class Relation:
    """Members (kind, id, role) of a relation, and its tags."""

    members: tuple[tuple[str, int, str], ...]
    tags: Tags


@dataclass(frozen=True, eq=False)
class Extract:
    """An extract of OpenStreetMap.

    Parameters
    ----------
    name : str
        Name of its file.
    nodes, ways, relations : dict
        Elements by id, in the order of the file.
    notes : tuple of str
        Messages about elements that were left out, with the reason.
    attribution : str
        Credit required by the data, with their date if the file has one.
    """

    name: str
    nodes: dict[int, Node]
    ways: dict[int, Way]
    relations: dict[int, Relation]
    notes: tuple[str, ...] = ()
    attribution: str = ""

    def line(self, way: Way) -> list[Node]:
        """Return the nodes of a way that the extract contains; a way that is cut off has fewer nodes than ids."""
        return [self.nodes[number] for number in way.nodes if number in self.nodes]

    def in_metres(self, nodes: Iterable[Node]) -> Float:
        """Return the positions of nodes (n, 2), metres east and north of the extract's first node."""
        first = next(iter(self.nodes.values()))
        return plan_metres([(node.latitude, node.longitude) for node in nodes], (first.latitude, first.longitude))


class _Collector:
    """Elements of a file within a window, with counts for notes and the credit of the data.

    Both formats, XML and PBF, fill one of these.
    """

    def __init__(self, name: str, within: Window | None) -> None:
        self.nodes: dict[int, Node] = {}
        self.ways: dict[int, Way] = {}
        self.relations: dict[int, Relation] = {}
        self.repeated = self.near = self.misplaced = 0
        self.has_nodes = self.has_inline_nodes = False
        """Whether the file has nodes, and ways with the coordinates of their nodes (Overpass's ``out geom``)."""
        self.holder = self.date = self.newest = ""
        self._name, self._within = name, within
        self._middle = None if within is None else (within[1] + within[3]) / 2
        """Longitude around which others are unwrapped, so that places on both sides of the date line are neighbours."""

    @property
    def lacks_nodes(self) -> bool:
        """Whether the file has ways, and none of their nodes."""
        refs = itertools.chain.from_iterable(way.nodes for way in self.ways.values())
        return bool(self.ways) and (self.has_inline_nodes or not self.has_nodes) and self.nodes.keys().isdisjoint(refs)

    @property
    def attribution(self) -> str:
        """Credit of the data: OpenStreetMap's unless the file names a different holder of its rights."""
        own = self.holder and "openstreetmap" not in self.holder.casefold()
        credit = f"© {self.holder}" if own else OPENSTREETMAP
        if self.date:
            return f"{credit}, data of {self.date}"
        return f"{credit}, changes up to {self.newest}" if self.newest else credit

    def add_node(self, number: int, latitude: float, longitude: float, tags: Tags) -> None:
        """Add a node unless it is far from the window; NaN coordinates count as misplaced."""
        self.has_nodes = True
        if not (abs(latitude) <= MAX_LATITUDE and abs(longitude) <= 180.0):
            self.misplaced += 1
            return
        if self._middle is None:
            self._middle = longitude
        longitude = self._middle + math.remainder(longitude - self._middle, 360.0)
        # Ways refer to nodes before it is known which nodes they need, so nodes are kept in a wider band: the next
        # node of a street that leaves the window may lie far beyond its edge. `cropped` removes the rest.
        if self._is_within(latitude, longitude, NEXT_NODE):
            known = self.nodes.get(number)
            self.near += known is None and self._is_within(latitude, longitude)
            moved = known is not None and (known.latitude, known.longitude) != (latitude, longitude)
            self.nodes[number] = Node(latitude, longitude, self._merged(known, tags, moved=moved))
            self._check_size()

    def add_way(self, number: int, nodes: tuple[int, ...], tags: Tags) -> None:
        """Add a way."""
        known = self.ways.get(number)
        nodes = nodes or (known.nodes if known else ())
        moved = known is not None and bool(known.nodes) and known.nodes != nodes
        self.ways[number] = Way(nodes, self._merged(known, tags, moved=moved))
        self._check_size()

    def add_relation(self, number: int, members: tuple[tuple[str, int, str], ...], tags: Tags) -> None:
        """Add a relation."""
        known = self.relations.get(number)
        members = members or (known.members if known else ())
        moved = known is not None and bool(known.members) and known.members != members
        self.relations[number] = Relation(members, self._merged(known, tags, moved=moved))
        self._check_size()

    def _merged(self, known: Node | Way | Relation | None, tags: Tags, *, moved: bool) -> Tags:
        """Return the tags of an element, and count it if its copies contradict each other.

        Overpass writes an element once with tags and once without (``out body; >; out skel``): the tags are kept.
        """
        if known is None:
            return tags
        self.repeated += moved or bool(tags and known.tags and tags != known.tags)
        return tags or known.tags

    def changed(self, time: str) -> None:
        """Note the time stamp (ISO 8601) of an element."""
        self.newest = max(self.newest, _day(time))

    def _check_size(self) -> None:
        if len(self.nodes) + len(self.ways) + len(self.relations) > MAX_ELEMENTS:
            raise SeipError(
                f"{self._name} holds more than {MAX_ELEMENTS:,} elements; cut the place out of it "
                "(osmium extract --bbox west,south,east,north)"
            )

    def _is_within(self, latitude: float, longitude: float, beyond: float = 0.0) -> bool:
        """Return whether a place lies within the window widened by `beyond` metres."""
        if self._within is None:
            return True
        south, west, north, east = self._within
        more = math.degrees(beyond / EARTH_RADIUS)
        east_more = more / math.cos(math.radians(latitude))
        return south - more <= latitude <= north + more and west - east_more <= longitude <= east + east_more


def read_extract(path: Path, within: Window | None = None) -> Generator[Progress, None, Extract]:
    """Read an extract: OpenStreetMap's XML, plain or packed with gzip, or PBF.

    Parameters
    ----------
    within : (4,) float, degrees, optional
        South, west, north, east. Elements outside are skipped, except the next node of a street that leaves it.

    Yields
    ------
    Progress
        Progress through the file.

    Raises
    ------
    SeipError
        The file cannot be read, has a different format, is damaged, declares entities, has ids that are not whole
        numbers, or has more than `MAX_ELEMENTS` elements.

    Examples
    --------
    >>> from seip_addon.core.base.progress import finish
    >>> nodes = '<node id="1" lat="48.000" lon="11.0"/><node id="2" lat="48.001" lon="11.0"/>'
    >>> street = '<way id="5"><nd ref="1"/><nd ref="2"/><tag k="highway" v="residential"/></way>'
    >>> Path("street.osm").write_text(f"<osm>{nodes}{street}</osm>", encoding="utf-8") > 0
    True
    >>> extract = finish(read_extract(Path("street.osm")))
    >>> [(way.tags["highway"], [node.latitude for node in extract.line(way)]) for way in extract.ways.values()]
    [('residential', [48.0, 48.001])]
    """
    start = _first_bytes(path)
    collected = _Collector(path.name, within)
    if start[:3] == PBF_START:
        yield from _read_pbf(path, collected, everything=within is None)
    else:
        yield from _read_xml(path, collected)
    if collected.lacks_nodes:
        raise SeipError(
            f"{path.name} has ways without nodes: query Overpass with `out body; >; out skel qt;`, not `out geom`, "
            "or export the place from openstreetmap.org"
        )
    if not collected.nodes or collected.near == 0:
        if within is None:
            raise SeipError(f"{path.name} has no node: take an extract that holds the place")
        raise SeipError(
            f"{path.name} has no node near the place: take an extract that holds it, and give latitude before longitude"
        )
    notes = []
    if collected.repeated:
        notes.append(f"{path.name} has two versions of {counted(collected.repeated, 'element')}: the later one is used")
    if collected.misplaced:
        notes.append(
            f"{path.name} has {counted(collected.misplaced, 'node')} without valid coordinates below {MAX_LATITUDE:g} "
            "degrees of latitude, which were skipped"
        )
    ways = {number: _in_driving_direction(way) for number, way in collected.ways.items()}
    extract = Extract(path.name, collected.nodes, ways, collected.relations, tuple(notes), collected.attribution)
    return extract if within is None else cropped(extract, within)


def cropped(extract: Extract, within: Window) -> Extract:
    """Return the part of an extract within a window, with the next node of each street and track that leaves it."""
    south, west, north, east = within
    inside = {
        number
        for number, node in extract.nodes.items()
        if south <= node.latitude <= north and west <= node.longitude <= east
    }
    ways = {number: way for number, way in extract.ways.items() if not inside.isdisjoint(way.nodes)}
    kept = set(inside)
    for way in ways.values():
        # A street that leaves the window would otherwise end at its last node inside, possibly far from the edge. Areas
        # need no such node: their outlines are closed by a straight line (`plan_shapes`).
        if "highway" in way.tags or "railway" in way.tags:
            for one, other in itertools.pairwise(way.nodes):
                if one in inside or other in inside:
                    kept |= {one, other}
    nodes = {number: node for number, node in extract.nodes.items() if number in kept}
    return replace(extract, nodes=nodes, ways=ways)


def _read_xml(path: Path, into: _Collector) -> Generator[Progress, None, None]:
    reader = _XmlReader(path.name, into)
    yield from read_tags(path, reader.start, reader.end, cure="download the extract again")
    if reader.root == "osmChange":
        raise SeipError(
            f"{path.name} is a list of changes, not an extract: download the place as OpenStreetMap XML (.osm)"
        )
    if reader.root != "osm":
        raise SeipError(
            f"{path.name} is not an extract of OpenStreetMap: its first element is <{reader.root[:40]}>; "
            "download the place as OpenStreetMap XML (.osm)"
        )


class _XmlReader:
    """Handlers for a stream of XML tags that collect elements."""

    def __init__(self, name: str, into: _Collector) -> None:
        self.root = ""
        self._name, self._into = name, into
        self._attributes: Attributes = {}
        self._tags: dict[str, str] = {}
        self._refs: list[int] = []
        self._members: list[tuple[str, int, str]] = []
        self._deleted = False

    def start(self, tag: str, attributes: Attributes) -> None:
        """Process the start tag of an element."""
        if not self.root:
            self.root = tag
            self._into.holder = one_line(attributes.get("copyright", "")[:MAX_TAG])
            self._into.date = _day(attributes.get("timestamp", ""))
        elif tag == "meta":
            self._into.date = _day(attributes.get("osm_base", "")) or self._into.date
        if tag in ("node", "way", "relation"):
            self._attributes, self._tags, self._refs, self._members = attributes, {}, [], []
            self._into.changed(attributes.get("timestamp", ""))
            self._deleted = attributes.get("visible") == "false" or attributes.get("action") == "delete"
        elif tag == "tag":
            self._tags[attributes.get("k", "")] = one_line(attributes.get("v", "")[:MAX_TAG])
        elif tag == "nd":
            self._refs.append(self._id(attributes, "ref"))
            self._into.has_inline_nodes |= "lat" in attributes
        elif tag == "member":
            self._members.append((attributes.get("type", ""), self._id(attributes, "ref"), attributes.get("role", "")))

    def end(self, tag: str) -> None:
        """Process the end tag of an element."""
        if tag not in ("node", "way", "relation") or self._deleted:
            return
        number, tags = self._id(self._attributes, "id"), self._tags or _NO_TAGS
        if tag == "node":
            self._into.add_node(number, self._degrees("lat"), self._degrees("lon"), tags)
        elif tag == "way":
            self._into.add_way(number, tuple(self._refs), tags)
        else:
            self._into.add_relation(number, tuple(self._members), tags)

    def _id(self, attributes: Attributes, name: str) -> int:
        text = attributes.get(name, "")
        try:
            number = int(text)
        except ValueError:
            number = MAX_ID
        if abs(number) < MAX_ID:
            return number
        raise SeipError(
            f"{self._name}: {name}={quoted(text)} of an element is not a whole number below 2^62; "
            "download the extract again"
        )

    def _degrees(self, name: str) -> float:
        """Return a coordinate of the element, NaN if it is missing or invalid."""
        try:
            return float(self._attributes[name])
        except (KeyError, ValueError):
            return math.nan


def _read_pbf(path: Path, into: _Collector, *, everything: bool) -> Generator[Progress, None, None]:
    """Read the PBF format with pyosmium; without ``everything`` only ways and relations with a node near the window."""
    import osmium  # noqa: PLC0415  # its library takes a moment to load, and most extracts are XML

    try:
        elements = osmium.FileProcessor(osmium.io.File(str(path), "pbf"))
        into.date = _day(elements.header.get("osmosis_replication_timestamp"))
        element: Any  # without a type that nodes, ways and relations share
        for number, element in enumerate(elements):
            if number % PBF_STEP == 0:
                yield Progress(0, 0, f"reading {path.name}", counted=False)
            if element.visible:
                _add_pbf_element(element, into, everything=everything)
    except (RuntimeError, ValueError, OverflowError) as error:
        raise SeipError(f"{path.name} is damaged ({one_line(str(error))[:80]}); download the extract again") from error


def _add_pbf_element(element: Any, into: _Collector, *, everything: bool) -> None:  # noqa: ANN401 -- as above
    if element.timestamp.year > 1970:  # 1970 stands for no time stamp
        into.changed(element.timestamp.isoformat())
    tags = {tag.k: one_line(tag.v[:MAX_TAG]) for tag in element.tags} or _NO_TAGS
    if element.is_node():
        if into.ways:  # ways are dropped by the nodes before them
            raise ValueError("nodes after ways: sort it with osmium sort")
        place = element.location
        valid = place.valid()
        into.add_node(element.id, place.lat if valid else math.nan, place.lon if valid else math.nan, tags)
    elif element.is_way():
        nodes = tuple(node.ref for node in element.nodes)
        if everything or not into.nodes.keys().isdisjoint(nodes):
            into.add_way(element.id, nodes, tags)
    elif element.is_relation():
        members = tuple((_KINDS[member.type], member.ref, member.role) for member in element.members)
        if everything or any(kind == "way" and number in into.ways for kind, number, _ in members):
            into.add_relation(element.id, members, tags)


def _day(time: str) -> str:
    """Return the day of a time stamp (ISO 8601), "" for anything else."""
    day = _DAY.match(time)
    return day[0] if day else ""


def window(latitude: float, longitude: float, reach: float) -> Window:
    """Return south, west, north and east of a square around a place, degrees; ``reach`` is half its side in metres."""
    north = math.degrees(reach / EARTH_RADIUS)
    east = north / math.cos(math.radians(latitude))
    return latitude - north, longitude - east, latitude + north, longitude + east


def _first_bytes(path: Path) -> bytes:
    """Return the first bytes of a file, after a check that they are not those of another format."""
    try:
        with path.open("rb") as file:
            start = file.read(1000)
    except OSError:
        return b""  # the reader names the fault
    other = other_format(start, "an extract: choose OpenStreetMap XML (.osm), from Overpass with [out:xml]")
    if other and not start.startswith(GZIP):
        raise SeipError(f"{path.name} {other}")
    return start
