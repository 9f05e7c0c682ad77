"""What the authored maps need of OpenDRIVE 1.6: the data of a map, and the XML it becomes."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import accumulate
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement, indent, tostring

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scenes.alignment import Geometry

Value = str | float | int


@dataclass(frozen=True)
class Cubic:
    """a + b ds + c ds^2 + d ds^3 from a start in metres on."""

    start: float
    a: float
    b: float = 0.0
    c: float = 0.0
    d: float = 0.0

    def at(self, distance: float) -> float:
        """Return the value at a distance on the scale of ``start``."""
        ds = distance - self.start
        return self.a + ds * (self.b + ds * (self.c + ds * self.d))


def value_at(cubics: Sequence[Cubic], distance: float) -> float:
    """Return the value of the last record that has started."""
    return next(cubic for cubic in reversed(cubics) if cubic.start <= distance).at(distance)


def smooth_step(start: float, length: float, first: float, last: float) -> Cubic:
    """Return the cubic from one value to another, level at both ends."""
    rise = last - first
    return Cubic(start, first, 0.0, 3.0 * rise / length**2, -2.0 * rise / length**3)


@dataclass(frozen=True)
class Lane:
    """A lane: type, width records, height above the road in metres, mark on its outer edge, neighbours' lane ids."""

    kind: str
    widths: tuple[Cubic, ...]
    height: float = 0.0
    mark: str = "none"
    predecessor: int | None = None
    successor: int | None = None


@dataclass(frozen=True)
class Section:
    """A lane section; lanes from the centre outwards. ``centre`` is the mark on the reference line."""

    start: float
    left: tuple[Lane, ...]
    right: tuple[Lane, ...]
    centre: str = "none"


@dataclass(frozen=True)
class Neighbour:
    """What a road or lane leads to: a road and which of its ends, or a junction."""

    kind: str
    name: str
    contact: str | None = None


@dataclass(frozen=True)
class Corner:
    """A corner of an outline in metres: (u, v) in the object's axes or (s, t) of the road, the height, the foot."""

    first: float
    second: float
    height: float
    foot: float = 0.0  # above the object's origin or the road


@dataclass(frozen=True)
class Repeat:
    """Copies of an object along the road: from a station, over a length, so many metres apart, at an offset t."""

    start: float
    length: float
    distance: float
    offset: float


@dataclass(frozen=True)
class RoadObject:
    """An object beside or on the road; metres and radians, in road coordinates (s, t)."""

    kind: str
    name: str
    s: float
    t: float
    height: float
    subtype: str = ""
    z_offset: float = 0.0
    heading: float = 0.0
    size: Mapping[str, float] = field(default_factory=dict)  # length and width, or radius
    repeat: Repeat | None = None
    corners_local: tuple[Corner, ...] = ()
    corners_road: tuple[Corner, ...] = ()


@dataclass(frozen=True)
class TrafficLight:
    """A dynamic signal on a post beside the carriageway, for the traffic that drives with or against s."""

    id: str
    name: str
    s: float
    t: float
    with_s: bool
    lanes: tuple[int, int]


@dataclass(frozen=True)
class Road:
    """A road: its reference line, lanes, elevation and furniture."""

    id: str
    name: str
    geometries: tuple[Geometry, ...]
    sections: tuple[Section, ...]
    elevation: tuple[Cubic, ...]
    junction: str = "-1"
    predecessor: Neighbour | None = None
    successor: Neighbour | None = None
    speed: int = 50
    objects: tuple[RoadObject, ...] = ()
    signals: tuple[TrafficLight, ...] = ()

    @property
    def length(self) -> float:
        """Length in metres."""
        return sum(geometry.length for geometry in self.geometries)


@dataclass(frozen=True)
class Connection:
    """A way through a junction: from an incoming road over a connecting road, with its (from, to) lanes."""

    incoming: str
    connecting: str
    lanes: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class SignalGroup:
    """A controller: the traffic lights that show the same."""

    id: str
    name: str
    signals: tuple[str, ...]


@dataclass(frozen=True)
class Junction:
    """A junction: its connections and the signal groups that control it."""

    id: str
    name: str
    connections: tuple[Connection, ...]
    groups: tuple[SignalGroup, ...]


@dataclass(frozen=True)
class Map:
    """A whole map."""

    name: str
    roads: tuple[Road, ...]
    junctions: tuple[Junction, ...]


def opendrive(road_map: Map) -> bytes:
    """Return the file of a map."""
    root = Element("OpenDRIVE")
    # The date is fixed so that the same sources always give the same file.
    _add(root, "header", revMajor=1, revMinor=6, name=road_map.name, version="1.0", date="2025-01-01T00:00:00")
    for road in road_map.roads:
        _road(root, road)
    for junction in road_map.junctions:
        for group in junction.groups:
            controller = _add(root, "controller", id=group.id, name=group.name)
            for signal in group.signals:
                _add(controller, "control", signalId=signal, type="0")
    for junction in road_map.junctions:
        _junction(root, junction)
    indent(root, " ")
    text: str = tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def _text(value: Value) -> str:
    """Return an attribute's text: ten digits, far below a millimetre and above the noise of mathematics libraries."""
    return f"{round(value, 12) + 0.0:.10g}" if isinstance(value, float) else str(value)


def _add(parent: Element, tag: str, **attributes: Value) -> Element:
    return SubElement(parent, tag, {name: _text(value) for name, value in attributes.items()})


def _road(root: Element, road: Road) -> None:
    element = _add(root, "road", name=road.name, length=road.length, id=road.id, junction=road.junction, rule="RHT")
    link = _add(element, "link")
    for tag, neighbour in (("predecessor", road.predecessor), ("successor", road.successor)):
        if neighbour:
            contact = {"contactPoint": neighbour.contact} if neighbour.contact else {}
            _add(link, tag, elementType=neighbour.kind, elementId=neighbour.name, **contact)
    _add(_add(element, "type", s=0.0, type="town"), "speed", max=road.speed, unit="km/h")
    plan = _add(element, "planView")
    starts = accumulate((geometry.length for geometry in road.geometries), initial=0.0)
    for start, geometry in zip(starts, road.geometries, strict=False):
        pose = geometry.start
        record = _add(plan, "geometry", s=start, x=pose.x, y=pose.y, hdg=pose.heading, length=geometry.length)
        _add(record, geometry.shape, **geometry.attributes)
    profile = _add(element, "elevationProfile")
    for cubic in road.elevation:
        _add(profile, "elevation", s=cubic.start, a=cubic.a, b=cubic.b, c=cubic.c, d=cubic.d)
    lanes = _add(element, "lanes")
    for section in road.sections:
        _section(lanes, section)
    _objects(element, road)
    signals = _add(element, "signals")
    for signal in road.signals:
        _signal(signals, signal)


def _section(lanes: Element, section: Section) -> None:
    element = _add(lanes, "laneSection", s=section.start)
    if section.left:
        left = _add(element, "left")
        for number in range(len(section.left), 0, -1):
            _lane(left, number, section.left[number - 1])
    centre = _add(_add(element, "center"), "lane", id=0, type="none", level="false")
    _mark(centre, section.centre)
    if section.right:
        right = _add(element, "right")
        for number, lane in enumerate(section.right, start=1):
            _lane(right, -number, lane)


def _lane(side: Element, number: int, lane: Lane) -> None:
    element = _add(side, "lane", id=number, type=lane.kind, level="false")
    link = _add(element, "link")
    if lane.predecessor is not None:
        _add(link, "predecessor", id=lane.predecessor)
    if lane.successor is not None:
        _add(link, "successor", id=lane.successor)
    for width in lane.widths:
        _add(element, "width", sOffset=width.start, a=width.a, b=width.b, c=width.c, d=width.d)
    _mark(element, lane.mark)
    if lane.height:
        _add(element, "height", sOffset=0.0, inner=lane.height, outer=lane.height)


def _mark(lane: Element, mark: str) -> None:
    _add(lane, "roadMark", sOffset=0.0, type=mark, weight="standard", color="white", width=0.12)


def _objects(element: Element, road: Road) -> None:
    objects = _add(element, "objects")
    for number, item in enumerate(road.objects, start=100):
        record = _add(
            objects,
            "object",
            id=f"{road.id}{number}",
            type=item.kind,
            **({"subtype": item.subtype} if item.subtype else {}),
            name=item.name,
            s=item.s,
            t=item.t,
            zOffset=item.z_offset,
            orientation="none",
            hdg=item.heading,
            pitch=0.0,
            roll=0.0,
            height=item.height,
            **item.size,
            dynamic="no",
        )
        if item.repeat:
            _repeat(record, item, item.repeat)
        for tag, axes, corners in (
            ("cornerLocal", ("u", "v", "z"), item.corners_local),
            ("cornerRoad", ("s", "t", "dz"), item.corners_road),
        ):
            if corners:
                outline = _add(_add(record, "outlines"), "outline", id=0, outer="true", closed="true")
                for index, corner in enumerate(corners):
                    place = dict(zip(axes, (corner.first, corner.second, corner.foot), strict=True))
                    _add(outline, tag, id=index, **place, height=corner.height)


def _repeat(record: Element, item: RoadObject, repeat: Repeat) -> None:
    _add(
        record,
        "repeat",
        s=repeat.start,
        length=repeat.length,
        distance=repeat.distance,
        tStart=repeat.offset,
        tEnd=repeat.offset,
        heightStart=item.height,
        heightEnd=item.height,
        zOffsetStart=item.z_offset,
        zOffsetEnd=item.z_offset,
    )


def _signal(signals: Element, signal: TrafficLight) -> None:
    element = _add(
        signals,
        "signal",
        id=signal.id,
        name=signal.name,
        s=signal.s,
        t=signal.t,
        zOffset=2.6,
        orientation="+" if signal.with_s else "-",
        dynamic="yes",
        country="OpenDRIVE",
        type="1000001",
        subtype="-1",
        value=-1,
        hOffset=0.0,
        pitch=0.0,
        roll=0.0,
        height=0.9,
        width=0.3,
    )
    _add(element, "validity", fromLane=min(signal.lanes), toLane=max(signal.lanes))


def _junction(root: Element, junction: Junction) -> None:
    element = _add(root, "junction", id=junction.id, name=junction.name, type="default")
    for number, connection in enumerate(junction.connections):
        record = _add(
            element,
            "connection",
            id=number,
            incomingRoad=connection.incoming,
            connectingRoad=connection.connecting,
            contactPoint="start",
        )
        for first, last in connection.lanes:
            _add(record, "laneLink", **{"from": first, "to": last})
    for sequence, group in enumerate(junction.groups):
        _add(element, "controller", id=group.id, type="0", sequence=sequence)
