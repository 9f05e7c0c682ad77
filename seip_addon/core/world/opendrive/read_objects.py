"""Read the objects and signals of a road in map coordinates, with repeated ones expanded."""

import math
from collections.abc import Iterator
from dataclasses import astuple, dataclass, replace

import numpy as np

from ...base import limits
from ...base.arrays import Float
from ...base.errors import SeipError
from ...geometry.orientation import orientation
from .document import Node
from .objects import TUNNEL, Outline, PlacedObject, PlacedSignal
from .road_map import Road, lifted
from .sampling import sample

_MAX_COPIES = 10_000
_STRIP_TOLERANCE = 0.02  # metres
TUNNEL_STEP = 5.0  # metres along a tunnel
_MAX_DISTANCE = limits.SITE_RADIUS.most  # metres that an object reaches, and stands from its road
_MAX_HEIGHT = limits.ABOVE_GROUND.most


@dataclass(frozen=True)
class _Copy:
    """Place on the road and size of an object, or of one of its copies, metres."""

    s: float
    t: float
    up: float
    height: float
    width: float
    length: float
    radius: float


@dataclass(frozen=True)
class _Corner:
    """A corner of an outline: s, t and dz on the road, or u, v and z of the object; None if it has no own height."""

    on_road: bool
    along: float
    aside: float
    up: float
    height: float | None


@dataclass(frozen=True, eq=False)
class _Object:
    """An object of a road as in the file: its element, its place, its rotation (radians), and its outlines."""

    road: Road
    node: Node
    own: _Copy
    heading: float
    pitch: float
    roll: float
    outlines: tuple[tuple[tuple[_Corner, ...], bool], ...]


def read_objects(road: Road, node: Node) -> Iterator[PlacedObject]:
    """Yield the objects of a road, with repeated objects replaced by their copies.

    Parameters
    ----------
    road : Road
        Road that they belong to.
    node : Node
        Its element.

    Raises
    ------
    SeipError
        A number is implausible, or an object is repeated too often.
    """
    for child in node.children("objects", "object"):
        item = _object(road, child.within(f"object {child.text('id', '')}"))
        repeats = list(item.node.children("repeat"))
        if not repeats:
            yield _placed(item, item.own)
        for repeat in repeats:
            yield from _repeated(item, repeat)
    for child in node.children("objects", "tunnel"):
        yield _tunnel(road, child.within(f"tunnel {child.text('id', '')}"))


def read_signals(road: Road, node: Node) -> Iterator[PlacedSignal]:
    """Yield the traffic lights of a road: its signals that change."""
    for child in node.children("signals", "signal"):
        if not child.flag("dynamic"):
            continue
        item = child.within(f"signal {child.text('id', '')}")
        s = np.array([item.number("s")])
        position = _point(road, float(s[0]), item.number("t"), item.number("zOffset", 0.0))
        turned = math.pi if item.text("orientation", "none") == "-" else 0.0
        yaw = float(road.frame(s).heading[0]) + turned + item.number("hOffset", 0.0)
        yield PlacedSignal(road.id, item.text("name", ""), position, yaw)


def _tunnel(road: Road, node: Node) -> PlacedObject:
    """Return a tunnel as a line along the road."""
    start, stop = np.clip(node.number("s") + np.array([0.0, node.number("length")]), 0.0, road.length)
    along = np.linspace(start, stop, 2 + int((stop - start) / TUNNEL_STEP))
    line = Outline(road.place(along, np.zeros(len(along))), np.zeros(len(along)), closed=False)
    names = road.id, node.text("id", ""), node.text("name", ""), TUNNEL
    return PlacedObject(*names, line.base.mean(axis=0), 0.0, length=float(stop - start), outlines=(line,))


def _object(road: Road, node: Node) -> _Object:
    sizes = ("width", "length", "radius")
    own = _Copy(
        node.number("s"),
        node.number("t", most=_MAX_DISTANCE),
        node.number("zOffset", 0.0, most=_MAX_HEIGHT),
        node.number("height", 0.0, most=_MAX_HEIGHT),
        *(node.number(size, 0.0, most=_MAX_DISTANCE) for size in sizes),
    )
    outlines = []
    for outline in (*node.children("outline"), *node.children("outlines", "outline")):
        corners = (Node(element, outline.place) for element in outline.element)
        of_outline = tuple(_corner(one) for one in corners if one.tag in ("cornerRoad", "cornerLocal"))
        outlines += [(of_outline, outline.flag("closed", default=True))] if of_outline else []
    heading, pitch, roll = (node.number(name, 0.0) for name in ("hdg", "pitch", "roll"))
    return _Object(road, node, own, heading, pitch, roll, tuple(outlines))


def _corner(node: Node) -> _Corner:
    on_road = node.tag == "cornerRoad"
    along, aside, up = ("s", "t", "dz") if on_road else ("u", "v", "z")
    return _Corner(
        on_road,
        node.number(along) if on_road else node.number(along, most=_MAX_DISTANCE),
        node.number(aside, most=_MAX_DISTANCE),
        node.number(up, 0.0, most=_MAX_HEIGHT),
        node.number("height", most=_MAX_HEIGHT) if "height" in node.element.attrib else None,
    )


def _repeated(item: _Object, node: Node) -> Iterator[PlacedObject]:
    """Yield the copies of an object in a row, or a continuous strip if there is no distance between them."""
    own, distance, length = item.own, node.number("distance", 0.0), node.number("length", 0.0)
    if distance < 0.0:
        raise SeipError(f"{node.place}: distance={distance:g} of <repeat> is below zero; correct it in the map")
    start = node.number("s", own.s)
    first, last = [start], [start + length]
    for name, usual in zip(("t", "zOffset", "height", "width", "length", "radius"), astuple(own)[1:], strict=True):
        most = _MAX_HEIGHT if name in ("zOffset", "height") else _MAX_DISTANCE
        first.append(node.number(f"{name}Start", usual, most=most))
        last.append(node.number(f"{name}End", first[-1], most=most))
    ends = np.array([first, last])
    if distance == 0.0 and length > 0.0:
        yield _strip(item, ends)
        return
    within = min(length, item.road.length - start)
    # A row whose length is a multiple of the distance has its last copy in spite of rounding.
    copies = 1 if distance == 0.0 or within <= 0.0 else math.floor(min(within / distance + 1e-9, _MAX_COPIES)) + 1
    if copies > _MAX_COPIES:
        number = item.node.text("id", "")
        raise SeipError(f"road {item.road.id}: object {number} is repeated too often; correct its <repeat> in the map")
    for along in distance * np.arange(copies):
        share = along / length if length > 0.0 else 0.0
        yield _placed(item, _Copy(*(ends[0] + share * (ends[1] - ends[0])).tolist()))


def _placed(item: _Object, copy: _Copy) -> PlacedObject:
    """Return an object, or a copy of it, in map coordinates; corners on the road move along with a copy."""
    road, own, node = item.road, item.own, item.node
    position = _point(road, copy.s, copy.t, copy.up)
    yaw = float(road.frame(np.array([copy.s])).heading[0]) + item.heading
    turn = orientation(yaw, item.pitch, item.roll)

    def foot(corner: _Corner) -> Float:
        if not corner.on_road:
            return np.asarray(position + turn @ np.array([corner.along, corner.aside, corner.up]))
        s, t = corner.along + copy.s - own.s, corner.aside + copy.t - own.t
        return _point(road, s, t, corner.up + copy.up - own.up)

    outlines = (
        Outline(
            np.array([*map(foot, corners)]),
            np.array([copy.height if one.height is None else one.height for one in corners]),
            closed,
        )
        for corners, closed in item.outlines
    )
    return PlacedObject(
        road_id=road.id,
        id=node.text("id", ""),
        name=node.text("name", ""),
        kind=node.text("type", "none").lower(),
        position=position,
        yaw=yaw,
        length=copy.length,
        width=copy.width,
        height=copy.height,
        radius=copy.radius,
        outlines=tuple(outlines),
    )


def _strip(item: _Object, ends: Float) -> PlacedObject:
    """Return a row without gaps as a single object with one outline, from the copies at its ends (2, 7)."""
    road, (start, stop) = item.road, ends[:, 0]
    end = min(stop, road.length)
    begin = min(start, end)
    _, t, up, height, width, _, radius = ends.T
    width = width if width.any() else 2.0 * radius

    def lines(s: Float) -> Float:
        """Return the left and right edge at the foot, and the height of the top above it as a third line."""
        t_here, half, up_here, top = (np.interp(s, ends[:, 0], pair) for pair in (t, width / 2.0, up, height))
        left, right = (lifted(road.place(s, t_here + sign * half), up_here) for sign in (1.0, -1.0))
        return np.stack([left, right, np.column_stack([np.zeros((len(s), 2)), top])], axis=1)

    starts = np.concatenate([road.reference_line.s, road.elevation.start, road.superelevation.start])
    knots = [begin, *starts[(starts > begin) & (starts < end)].tolist(), end]
    _, points = sample(lines, knots, _STRIP_TOLERANCE, f"road {road.id}, object {item.node.text('id', '')}")
    left, right, top = points[:, 0], points[:, 1], points[:, 2, 2]
    closed = bool(width.any())
    outline = Outline(
        np.concatenate([left, right[::-1]]) if closed else left,
        np.concatenate([top, top[::-1]]) if closed else top,
        closed,
    )
    first = replace(_Copy(*ends[0].tolist()), length=end - begin)
    return replace(_placed(replace(item, outlines=()), first), outlines=(outline,) if len(points) else ())


def _point(road: Road, s: float, t: float, up: float) -> Float:
    """Return the point (3,) at a height (metres) vertically above a place of the road."""
    return np.asarray(lifted(road.place(np.array([s]), np.array([t])), np.array([up]))[0])
