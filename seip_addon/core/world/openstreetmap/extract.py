"""An extract of OpenStreetMap as it is read: nodes, ways and relations with their tags."""

import itertools
import math
import re
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

from ...counts import counted
from ...errors import SeipError
from ...progress import Progress
from ...site.sources import one_line
from ...storage.xml_stream import Attributes, quoted, read_tags

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
MAX_TAG = 255  # characters of a tag's value, as in the database of OpenStreetMap
MAX_ID = 2**62
OPENSTREETMAP = "© OpenStreetMap contributors (ODbL)"
_DAY = re.compile(r"\d{4}-\d\d-\d\d(?=T|$)")
_NO_TAGS: Mapping[str, str] = MappingProxyType({})

NEXT_NODE = 3_000.0  # metres beyond a window within which the next node of a street that leaves it is looked for

Tags = Mapping[str, str]
Window = tuple[float, float, float, float]
"""South, west, north and east, degrees."""


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
    attribution : str
        Credit that the data demand, with their date where the file states one.
    """

    name: str
    nodes: dict[int, Node]
    ways: dict[int, Way]
    relations: dict[int, Relation]
    notes: tuple[str, ...] = ()
    attribution: str = ""

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
    near: int = 0
    misplaced: int = 0
    root: str = ""
    holder: str = ""
    date: str = ""
    newest: str = ""

    @property
    def attribution(self) -> str:
        """The credit of the data: OpenStreetMap's, except where the file names another holder of its rights."""
        own = self.holder and "openstreetmap" not in self.holder.casefold()
        credit = f"© {self.holder}" if own else OPENSTREETMAP
        if self.date:
            return f"{credit}, data of {self.date}"
        return f"{credit}, changes up to {self.newest}" if self.newest else credit


def read_extract(path: Path, within: Window | None = None) -> Generator[Progress, None, Extract]:
    """Read an extract in OpenStreetMap's XML, plain or packed with gzip.

    Parameters
    ----------
    within : (4,) float, degrees, optional
        South, west, north, east: what lies outside is passed over, but for the next node of a street that leaves it.

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
        raise SeipError(
            f"{path.name} is no extract of OpenStreetMap: its first element is <{collected.root[:40]}>; "
            "download the place as OpenStreetMap XML (.osm)"
        )
    if not collected.nodes or collected.near == 0:
        if within is None:
            raise SeipError(f"{path.name} has no node: take an extract that holds the place")
        raise SeipError(
            f"{path.name} has no node near the place: take an extract that holds it, and give latitude before longitude"
        )
    notes = []
    if collected.repeated:
        notes.append(f"{path.name} gives {counted(collected.repeated, 'element')} twice: the later one counts")
    if collected.misplaced:
        notes.append(
            f"{path.name} gives {counted(collected.misplaced, 'node')} no place on Earth below {MAX_LATITUDE:g} "
            "degrees of latitude and is read without"
        )
    extract = Extract(
        path.name, collected.nodes, collected.ways, collected.relations, tuple(notes), collected.attribution
    )
    return extract if within is None else cropped(extract, within)


def cropped(extract: Extract, within: Window) -> Extract:
    """Return what of an extract lies within a window, and the next node of each street and track that leaves it."""
    south, west, north, east = within
    inside = {
        number
        for number, node in extract.nodes.items()
        if south <= node.latitude <= north and west <= node.longitude <= east
    }
    ways = {number: way for number, way in extract.ways.items() if not inside.isdisjoint(way.nodes)}
    kept = set(inside)
    for way in ways.values():
        if "highway" in way.tags or "railway" in way.tags:
            for one, other in itertools.pairwise(way.nodes):
                if one in inside or other in inside:
                    kept |= {one, other}
    nodes = {number: node for number, node in extract.nodes.items() if number in kept}
    return replace(extract, nodes=nodes, ways=ways)


class _Reader:
    """Handlers of a stream of XML that collect elements."""

    def __init__(self, name: str, within: Window | None, into: _Collected) -> None:
        self._name, self._within, self._into = name, within, into
        self._attributes: Attributes = {}
        self._tags: dict[str, str] = {}
        self._refs: list[int] = []
        self._members: list[tuple[str, int, str]] = []
        self._deleted = False
        self._middle = None if within is None else (within[1] + within[3]) / 2
        """Longitude that others are counted from, so that places on both sides of the date line are neighbours."""

    def start(self, tag: str, attributes: Attributes) -> None:
        """Take the beginning of an element."""
        if not self._into.root:
            self._into.root = tag
            self._into.holder = one_line(attributes.get("copyright", "")[:MAX_TAG])
            self._into.date = _day(attributes.get("timestamp", ""))
        elif tag == "meta":
            self._into.date = _day(attributes.get("osm_base", "")) or self._into.date
        if tag in ("node", "way", "relation"):
            self._attributes, self._tags, self._refs, self._members = attributes, {}, [], []
            if "timestamp" in attributes:
                self._into.newest = max(self._into.newest, _day(attributes["timestamp"]))
            self._deleted = attributes.get("visible") == "false" or attributes.get("action") == "delete"
        elif tag == "tag":
            self._tags[attributes.get("k", "")] = one_line(attributes.get("v", "")[:MAX_TAG])
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
            if place is None or not self._is_within(*place, NEXT_NODE):
                return
            into.repeated += number in into.nodes
            into.near += self._is_within(*place)
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
            number = int(text)
        except ValueError:
            number = MAX_ID
        if abs(number) < MAX_ID:
            return number
        raise SeipError(
            f"{self._name}: {name}={quoted(text)} of an element is no whole number below 2^62; "
            "download the extract again"
        )

    def _place(self) -> tuple[float, float] | None:
        """Return latitude and longitude, None where they are no place that streets can be projected from."""
        try:
            latitude, longitude = float(self._attributes["lat"]), float(self._attributes["lon"])
        except (KeyError, ValueError):
            self._into.misplaced += 1
            return None
        if abs(latitude) <= MAX_LATITUDE and abs(longitude) <= 180.0:
            if self._middle is None:
                self._middle = longitude
            return latitude, self._middle + math.remainder(longitude - self._middle, 360.0)
        self._into.misplaced += 1
        return None

    def _is_within(self, latitude: float, longitude: float, beyond: float = 0.0) -> bool:
        """Return whether a place lies within the window, or so many metres beyond it."""
        if self._within is None:
            return True
        south, west, north, east = self._within
        more = math.degrees(beyond / EARTH_RADIUS)
        east_more = more / math.cos(math.radians(latitude))
        return south - more <= latitude <= north + more and west - east_more <= longitude <= east + east_more


def _day(time: str) -> str:
    """Return the day of a time stamp (ISO 8601), "" for anything else."""
    day = _DAY.match(time)
    return day[0] if day else ""


def window(latitude: float, longitude: float, reach: float) -> Window:
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
    lines = [way.nodes for way in ways if len(way.nodes) > 1]
    at: dict[int, list[int]] = {}  # the ways that end at a node
    for index, line in enumerate(lines):
        for end in {line[0], line[-1]}:
            at.setdefault(end, []).append(index)
    used = [False] * len(lines)
    found, left = [], 0
    for first, line in enumerate(lines):
        if used[first]:
            continue
        ring, joined = list(line), 1
        used[first] = True
        while ring[0] != ring[-1]:
            ends = at[ring[-1]]
            while ends and used[ends[0]]:
                ends.pop(0)
            if not ends:
                break
            following = lines[ends[0]]
            used[ends[0]] = True
            ring += (following if following[0] == ring[-1] else following[::-1])[1:]
            joined += 1
        if ring[0] == ring[-1] and len(ring) > 3:
            found.append(ring[:-1])
        else:
            left += joined
    return found, left


def _refuse_other_formats(path: Path) -> None:
    try:
        with path.open("rb") as file:
            start = file.read(16)
    except OSError:
        return  # the reader says what is the matter
    for mark, cure in _OTHER_FORMATS.items():
        if start.lstrip(b"\xef\xbb\xbf \t\r\n" if mark == b"{" else b"").startswith(mark):
            raise SeipError(f"{path.name} {cure}")
