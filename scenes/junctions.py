"""Junctions: the connecting roads between the roads that meet, and the pavements that close round the corners."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import TYPE_CHECKING, Literal

from scenes.alignment import Pose, join, turn_between
from scenes.opendrive_writer import (
    Connection,
    Corner,
    Cubic,
    Junction,
    Lane,
    Neighbour,
    Road,
    RoadObject,
    Section,
    SignalGroup,
    TrafficLight,
    smooth_step,
    value_at,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

STRAIGHT_ON = math.radians(45.0)
CROSSWALK = (1.0, 5.0)  # metres from the end of the road: where pedestrians cross
STOP_LINE = 6.5  # metres from the end of the road
POST_SETBACK = 0.6  # metres from kerb to the axis of the traffic light's post
POST_HEIGHT, POST_RADIUS = 6.0, 0.11  # metres

End = Literal["start", "end"]


@dataclass(frozen=True)
class EdgeLane:
    """A lane where its road meets a junction; ``edge`` is how far right of the reference line its left edge lies.

    Left and right are those of the traffic in the lane.
    """

    id: int
    kind: str
    width: float
    height: float
    edge: float


@dataclass(frozen=True)
class Arm:
    """A road's end at a junction."""

    road: Road
    contact: End

    @property
    def inward(self) -> Pose:
        """Pose on the reference line, heading into the junction."""
        geometries = self.road.geometries
        return geometries[0].start.turned(math.pi) if self.contact == "start" else geometries[-1].end

    @property
    def elevation(self) -> float:
        """Elevation of the reference line at the junction, metres."""
        return value_at(self.road.elevation, self._station)

    @property
    def incoming(self) -> tuple[EdgeLane, ...]:
        """Lanes that lead into the junction, from the centre outwards."""
        return self._lanes(1 if self.contact == "start" else -1)

    @property
    def outgoing(self) -> tuple[EdgeLane, ...]:
        """Lanes that lead out of the junction, from the centre outwards."""
        return self._lanes(-1 if self.contact == "start" else 1)

    @property
    def _station(self) -> float:
        return 0.0 if self.contact == "start" else self.road.length

    def _lanes(self, sign: int) -> tuple[EdgeLane, ...]:
        section = self.road.sections[0 if self.contact == "start" else -1]
        lanes = section.left if sign > 0 else section.right
        widths = [value_at(lane.widths, self._station - section.start) for lane in lanes]
        edges = accumulate(widths, initial=0.0)
        return tuple(
            EdgeLane(sign * number, lane.kind, width, lane.height, edge)
            for number, (lane, width, edge) in enumerate(zip(lanes, widths, edges, strict=False), start=1)
        )


def equip(road: Road, contact: End) -> Road:
    """Return the road with crosswalk, stop line and traffic light on its post at one of its ends."""
    arm = Arm(road, contact)
    into, out = driving(arm.incoming), driving(arm.outgoing)
    kerb, far_kerb = into[-1].edge + into[-1].width, out[-1].edge + out[-1].width
    side = 1.0 if contact == "start" else -1.0  # of the incoming lanes, on the t axis

    def station(distance: float) -> float:
        return distance if contact == "start" else road.length - distance

    crosswalk = _painted(
        "crosswalk",
        f"{road.name} crosswalk at {contact}",
        (station(sum(CROSSWALK) / 2.0), side * (kerb - far_kerb) / 2.0),
        (CROSSWALK[1] - CROSSWALK[0], kerb + far_kerb),
    )
    stop_line = _painted(
        "roadMark", f"{road.name} stop line at {contact}", (station(STOP_LINE), side * kerb / 2.0), (0.4, kerb)
    )
    light = TrafficLight(
        f"{road.id}{8 if contact == 'start' else 9}",
        f"{road.name} traffic light at {contact}",
        station(STOP_LINE),
        side * (kerb + POST_SETBACK),
        with_s=contact == "end",
        lanes=(into[0].id, into[-1].id),
    )
    post = RoadObject(
        "pole",
        f"{road.name} traffic light post at {contact}",
        light.s,
        light.t,
        POST_HEIGHT,
        z_offset=arm.incoming[-1].height,
        size={"radius": POST_RADIUS},
    )
    return replace(road, objects=(*road.objects, crosswalk, stop_line, post), signals=(*road.signals, light))


def _painted(kind: str, name: str, place: tuple[float, float], size: tuple[float, float]) -> RoadObject:
    """Return a rectangle of paint on the carriageway: its middle (s, t), length and width."""
    (s, t), (length, width) = place, size
    u, v = length / 2.0, width / 2.0
    corners = tuple(Corner(a, b, 0.0) for a, b in ((-u, -v), (u, -v), (u, v), (-u, v)))
    return RoadObject(kind, name, s, t, 0.0, size={"length": length, "width": width}, corners_local=corners)


def driving(lanes: Sequence[EdgeLane]) -> tuple[EdgeLane, ...]:
    """Return the driving lanes."""
    return tuple(lane for lane in lanes if lane.kind == "driving")


def connect(
    identity: str, name: str, arms: Sequence[Arm], phases: Sequence[Sequence[int]]
) -> tuple[tuple[Road, ...], Junction]:
    """Return the connecting roads and the junction of arms.

    Parameters
    ----------
    identity, name : str
        Of the junction; the connecting roads are numbered after it.
    arms : sequence of Arm
        Counter-clockwise.
    phases : sequence of sequences of int
        Which arms (by index) have green together.
    """
    roads, connections = [], []
    for number, (first, last) in enumerate(_movements(arms), start=1):
        # Traffic that turns to the arm next to its right runs along the corner, and carries the pavement round it.
        along_corner = arms.index(last) == (arms.index(first) + 1) % len(arms)
        road = _connecting_road(f"{identity}{number:02d}", identity, first, last, along_corner=along_corner)
        lanes = tuple((lane.predecessor, -n) for n, lane in enumerate(road.sections[0].right, start=1))
        roads.append(road)
        connections.append(
            Connection(first.road.id, road.id, tuple((start, end) for start, end in lanes if start is not None))
        )
    groups = tuple(
        SignalGroup(
            f"{identity}{90 + number}",
            f"{name} phase {number}",
            tuple(_light(arms[index]).id for index in phase),
        )
        for number, phase in enumerate(phases, start=1)
    )
    return tuple(roads), Junction(identity, name, tuple(connections), groups)


def _light(arm: Arm) -> TrafficLight:
    return next(light for light in arm.road.signals if light.with_s == (arm.contact == "end"))


def _movements(arms: Sequence[Arm]) -> Iterator[tuple[Arm, Arm]]:
    """Yield every pair of an arm to come from and another to leave by, right turns first."""
    for index, first in enumerate(arms):
        for step in range(1, len(arms)):
            yield first, arms[(index + step) % len(arms)]


def _connecting_road(identity: str, junction: str, first: Arm, last: Arm, *, along_corner: bool) -> Road:
    pairs = _lane_pairs(first, last)
    if along_corner:
        pairs = (*pairs, (first.incoming[-1], last.outgoing[-1]))  # the pavements are the outermost lanes
    start = first.inward.moved(left=-pairs[0][0].edge)
    end = last.inward.turned(math.pi).moved(left=-pairs[0][1].edge)
    geometries = join(start, end)
    length = sum(geometry.length for geometry in geometries)
    lanes = tuple(
        Lane(
            into.kind,
            (smooth_step(0.0, length, into.width, out.width),),
            into.height,
            predecessor=into.id,
            successor=out.id,
        )
        for into, out in pairs
    )
    return Road(
        identity,
        f"{first.road.name} to {last.road.name}",
        geometries,
        (Section(0.0, (), lanes),),
        (Cubic(0.0, first.elevation),),
        junction=junction,
        predecessor=Neighbour("road", first.road.id, first.contact),
        successor=Neighbour("road", last.road.id, last.contact),
    )


def _lane_pairs(first: Arm, last: Arm) -> tuple[tuple[EdgeLane, EdgeLane], ...]:
    """Return which driving lane leads to which: all when straight on, else the lanes next to the turn."""
    into, out = driving(first.incoming), driving(last.outgoing)
    turn = turn_between(first.inward, last.inward.turned(math.pi))
    if abs(turn) < STRAIGHT_ON:
        return tuple(zip(into, out, strict=True))
    return ((into[0], out[0]),) if turn > 0.0 else ((into[-1], out[-1]),)
