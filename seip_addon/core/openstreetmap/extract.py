"""An extract of OpenStreetMap as it is read: nodes, ways and relations with their tags."""

import math
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from ..errors import SeipError
from ..progress import Progress
from ..storage.xml_stream import Attributes, quoted, read_tags

MAX_ELEMENTS = 3_000_000  # nodes, ways and relations that are kept at most: about a city
EARTH_RADIUS = 6_350_000.0  # metres: the least there is, so that windows are no smaller than asked for
MAX_LATITUDE = 85.0  # degrees: nearer to a pole no projection of streets holds
_OTHER_FORMATS = {
    b"\x00\x00\x00": "is in the PBF format; convert it (osmium cat place.osm.pbf -o place.osm)",
    b"BZh": "is compressed with bzip2; unpack it (bunzip2)",
    b"PK\x03\x04": "is a zip archive; unpack it",
    b"\xfd7zXZ": "is compressed with xz; unpack it (unxz)",
    b"BLENDER": "is a .blend, no extract; open it in Blender",
    b"{": "is JSON; download the place as OpenStreetMap XML (.osm)",
}
"""How files begin that are given in place of an extract."""
_NO_TAGS: Mapping[str, str] = MappingProxyType({})

Tags = Mapping[str, str]


@dataclass(frozen=True, eq=False, slots=True)
class Node:
    """A place by latitude and longitude, degrees, and its tags."""

    latitude: float
    longitude: float
    tags: Tags


@dataclass(frozen=True, eq=False, slots=True)
class Way:
    """Nodes in a row, by their ids, and its tags."""

    nodes: tuple[int, ...]
    tags: Tags

    @property
    def is_closed(self) -> bool:
        """Whether it ends where it begins."""
        return len(self.nodes) > 3 and self.nodes[0] == self.nodes[-1]


@dataclass(frozen=True, eq=False, slots=True)
class Relation:
    """Members (kind, id, role) and tags."""

    members: tuple[tuple[str, int, str], ...]
    tags: Tags


@dataclass(frozen=True, eq=False)
class Extract:
    """An extract of OpenStreetMap.

    Parameters
    ----------
    name : str
        Of its file.
    nodes, ways, relations : dict
        By their ids, in the order of the file.
    notes : tuple of str
        What of the file was left out, and why.
    """

    name: str
    nodes: dict[int, Node]
    ways: dict[int, Way]
    relations: dict[int, Relation]
    notes: tuple[str, ...] = ()

    def line(self, way: Way) -> list[Node]:
        """Return the nodes of a way that the extract holds: one that was cut off has fewer than the way."""
        return [self.nodes[number] for number in way.nodes if number in self.nodes]


@dataclass
class _Collected:
    """What has been read so far, and the element that is being read."""

    nodes: dict[int, Node] = field(default_factory=dict)
    ways: dict[int, Way] = field(default_factory=dict)
    relations: dict[int, Relation] = field(default_factory=dict)
    repeated: int = 0
    misplaced: int = 0
    root: str = ""


def read_extract(
    path: Path, within: tuple[float, float, float, float] | None = None
) -> Generator[Progress, None, Extract]:
    """Read an extract in OpenStreetMap's XML, plain or packed with gzip.

    Parameters
    ----------
    within : (4,) float, degrees, optional
        South, west, north, east: nodes outside are passed over.

    Yields
    ------
    Progress
        Of the file.

    Raises
    ------
    SeipError
        The file cannot be read, is another format, is no well-formed XML, declares entities, holds ids or coordinates
        that are no numbers, or more than `MAX_ELEMENTS` elements.
    """
    _refuse_other_formats(path)
    collected = _Collected()
    reader = _Reader(path.name, within, collected)
    yield from read_tags(path, reader.start, reader.end, cure="download the extract again")
    if collected.root not in ("osm", "osmChange"):
        raise SeipError(f"{path.name} is no extract of OpenStreetMap: its first element is <{collected.root[:40]}>")
    if not collected.nodes:
        where = " near the place" if within is not None else ""
        raise SeipError(f"{path.name} has no node{where}: take an extract that holds the place")
    notes = []
    if collected.repeated:
        notes.append(f"{path.name} gives {collected.repeated:,} elements twice: the later one counts")
    if collected.misplaced:
        notes.append(
            f"{path.name} gives {collected.misplaced:,} nodes no place on Earth below {MAX_LATITUDE:g} degrees of "
            "latitude: they are left out"
        )
    return Extract(path.name, collected.nodes, collected.ways, collected.relations, tuple(notes))


class _Reader:
    """Handlers of a stream of XML that collect elements."""

    def __init__(self, name: str, within: tuple[float, float, float, float] | None, into: _Collected) -> None:
        self._name, self._within, self._into = name, within, into
        self._attributes: Attributes = {}
        self._tags: dict[str, str] = {}
        self._refs: list[int] = []
        self._members: list[tuple[str, int, str]] = []
        self._deleted = False

    def start(self, tag: str, attributes: Attributes) -> None:
        """Take the beginning of an element."""
        if not self._into.root:
            self._into.root = tag
        if tag in ("node", "way", "relation"):
            self._attributes, self._tags, self._refs, self._members = attributes, {}, [], []
            self._deleted = attributes.get("visible") == "false" or attributes.get("action") == "delete"
        elif tag == "tag":
            self._tags[attributes.get("k", "")] = attributes.get("v", "").strip()
        elif tag == "nd":
            self._refs.append(self._id(attributes, "ref"))
        elif tag == "member":
            self._members.append((attributes.get("type", ""), self._id(attributes, "ref"), attributes.get("role", "")))

    def end(self, tag: str) -> None:
        """Take the end of an element."""
        if tag not in ("node", "way", "relation") or self._deleted:
            return
        into, tags = self._into, self._tags or _NO_TAGS
        number = self._id(self._attributes, "id")
        if tag == "node":
            place = self._place()
            if place is None or not self._is_within(*place):
                return
            into.repeated += number in into.nodes
            into.nodes[number] = Node(*place, tags)
        elif tag == "way":
            into.repeated += number in into.ways
            into.ways[number] = Way(tuple(self._refs), tags)
        else:
            into.repeated += number in into.relations
            into.relations[number] = Relation(tuple(self._members), tags)
        if len(into.nodes) + len(into.ways) + len(into.relations) > MAX_ELEMENTS:
            raise SeipError(
                f"{self._name} holds more than {MAX_ELEMENTS:,} elements; cut the place out of it "
                "(osmium extract --bbox west,south,east,north)"
            )

    def _id(self, attributes: Attributes, name: str) -> int:
        text = attributes.get(name, "")
        try:
            return int(text)
        except ValueError:
            raise SeipError(
                f"{self._name}: {name}={quoted(text)} of an element is no whole number; download the extract again"
            ) from None

    def _place(self) -> tuple[float, float] | None:
        """Return latitude and longitude, None where they are no place that streets can be projected from."""
        try:
            latitude, longitude = float(self._attributes["lat"]), float(self._attributes["lon"])
        except (KeyError, ValueError):
            self._into.misplaced += 1
            return None
        if abs(latitude) <= MAX_LATITUDE and abs(longitude) <= 180.0:
            return latitude, longitude
        self._into.misplaced += 1
        return None

    def _is_within(self, latitude: float, longitude: float) -> bool:
        if self._within is None:
            return True
        south, west, north, east = self._within
        return south <= latitude <= north and west <= longitude <= east


def window(latitude: float, longitude: float, reach: float) -> tuple[float, float, float, float]:
    """Return south, west, north and east of a square around a place, degrees; ``reach`` is half its side in metres."""
    north = math.degrees(reach / EARTH_RADIUS)
    east = north / math.cos(math.radians(latitude))
    return latitude - north, longitude - east, latitude + north, longitude + east


def rings(ways: Sequence[Way]) -> tuple[list[list[int]], int]:
    """Join ways end to end to closed rings of node ids.

    Returns
    -------
    rings : list of list of int
        Each without its first node repeated at the end.
    open : int
        Number of ways that are part of no ring.
    """
    waiting = [list(way.nodes) for way in ways if len(way.nodes) > 1]
    found, left = [], 0
    while waiting:
        ring = waiting.pop(0)
        used = 1
        while ring[0] != ring[-1]:
            following = next((i for i, way in enumerate(waiting) if ring[-1] in (way[0], way[-1])), None)
            if following is None:
                break
            way = waiting.pop(following)
            ring += (way if way[0] == ring[-1] else way[::-1])[1:]
            used += 1
        if ring[0] == ring[-1] and len(ring) > 3:
            found.append(ring[:-1])
        else:
            left += used
    return found, left


def named(elements: Mapping[int, Way], keep: Callable[[Tags], bool]) -> Iterator[tuple[int, Way]]:
    """Yield the ways whose tags are to be kept."""
    return ((number, way) for number, way in elements.items() if keep(way.tags))


def _refuse_other_formats(path: Path) -> None:
    try:
        with path.open("rb") as file:
            start = file.read(16)
    except OSError:
        return  # the reader says what is the matter
    for mark, cure in _OTHER_FORMATS.items():
        if start.lstrip(b"\xef\xbb\xbf \t\r\n" if mark == b"{" else b"").startswith(mark):
            raise SeipError(f"{path.name} {cure}")
