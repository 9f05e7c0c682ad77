"""Objects of the map in map coordinates, with repeated ones expanded."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from shapely import MultiPoint
from shapely.geometry.base import BaseGeometry

from ...arrays import Float
from ...errors import SeipError
from ...geometry.orientation import orientation
from .road_map import Corner, Repeat, Road, RoadMap, RoadObject
from .sampling import sample

_MAX_COPIES = 10_000
_STRIP_TOLERANCE = 0.02  # metres
_ENDS = (0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Outline:
    """A polygon, or a wall along a line.

    Parameters
    ----------
    base : (k, 3) float64, metres
        Corners at the foot, map coordinates.
    height : (k,) float64, metres
        Height at each corner.
    closed : bool
        Whether the last corner joins the first one.
    """

    base: Float
    height: Float
    closed: bool


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """An object in map coordinates.

    Parameters
    ----------
    road_id, id, name : str
        Ids and name as in the file; copies share them.
    kind : str
        Type in lower case, such as ``building`` or ``tree``.
    position : (3,) float64, metres
        Origin in map coordinates.
    yaw, pitch, roll : float, radians
        Rotations about z, then y, then x; yaw counter-clockwise from +x.
    length, width, height, radius : float, metres
        Size of its box or cylinder, zero if the file does not give it.
    outlines : tuple of Outline
        Shape of the object, if there are any. A continuous strip has one: closed if the strip has a width, otherwise a
        line along which a wall stands.
    """

    road_id: str
    id: str
    name: str
    kind: str
    position: Float
    yaw: float
    pitch: float
    roll: float
    length: float
    width: float
    height: float
    radius: float
    outlines: tuple[Outline, ...]


def placed_objects(road_map: RoadMap) -> tuple[PlacedObject, ...]:
    """Return the objects of a map, with repeated objects replaced by their copies.

    Parameters
    ----------
    road_map : RoadMap
        Map with the objects.

    Raises
    ------
    SeipError
        An object is repeated too often.
    """
    return tuple(placed for road in road_map.roads for obj in road.objects for placed in _placed(road, obj))


def extent_in_plan(placed: PlacedObject) -> BaseGeometry:
    """Return the convex hull in plan of an object's origin and outlines."""
    return MultiPoint(np.vstack([placed.position, *(outline.base for outline in placed.outlines)])[:, :2]).convex_hull


def _placed(road: Road, obj: RoadObject) -> Iterator[PlacedObject]:
    if not obj.repeats:
        yield _place(road, obj, obj)
    for repeat in obj.repeats:
        if repeat.distance == 0.0 and repeat.length > 0.0:
            yield _strip(road, obj, repeat)
        else:
            for along in _steps(road, obj, repeat):
                yield _place(road, obj, _in_row(obj, repeat, float(along)))


def _steps(road: Road, obj: RoadObject, repeat: Repeat) -> Float:
    """Return the positions of the copies in a row, metres from its start."""
    length = min(repeat.length, road.length - repeat.s)
    if repeat.distance == 0.0 or length <= 0.0:
        return np.zeros(1)
    # A row whose length is a multiple of the distance has its last copy in spite of rounding.
    count = math.floor(min(length / repeat.distance + 1e-9, _MAX_COPIES)) + 1
    if count > _MAX_COPIES:
        raise SeipError(f"road {road.id}: object {obj.id} is repeated too often; correct its <repeat> in the map")
    return repeat.distance * np.arange(count)


def _in_row(obj: RoadObject, repeat: Repeat, along: float) -> RoadObject:
    """Return the copy of an object at a distance (metres) along a row."""
    share = along / repeat.length if repeat.length > 0.0 else 0.0

    def between(ends: tuple[float, float]) -> float:
        return ends[0] + share * (ends[1] - ends[0])

    return replace(
        obj,
        s=repeat.s + along,
        t=between(repeat.t),
        z_offset=between(repeat.z_offset),
        height=between(repeat.height),
        width=between(repeat.width),
        length=between(repeat.object_length),
        radius=between(repeat.radius),
    )


def _place(road: Road, original: RoadObject, obj: RoadObject) -> PlacedObject:
    """Return an object in map coordinates; corners on the road move with it from the place of ``original``."""
    position = _point(road, obj.s, obj.t, obj.z_offset)
    yaw = float(road.frame(np.array([obj.s])).heading[0]) + obj.heading
    turn = orientation(yaw, obj.pitch, obj.roll)

    def foot(corner: Corner) -> Float:
        if not corner.on_road:
            return np.asarray(position + turn @ np.array([corner.along, corner.aside, corner.up]))
        s, t = corner.along + obj.s - original.s, corner.aside + obj.t - original.t
        return _point(road, s, t, corner.up + obj.z_offset - original.z_offset)

    def height(corner: Corner) -> float:
        return obj.height if corner.height is None else corner.height

    return PlacedObject(
        road_id=road.id,
        id=obj.id,
        name=obj.name,
        kind=obj.kind,
        position=position,
        yaw=yaw,
        pitch=obj.pitch,
        roll=obj.roll,
        length=obj.length,
        width=obj.width,
        height=obj.height,
        radius=obj.radius,
        outlines=tuple(
            Outline(np.array([*map(foot, outline.corners)]), np.array([*map(height, outline.corners)]), outline.closed)
            for outline in obj.outlines
        ),
    )


def _strip(road: Road, obj: RoadObject, repeat: Repeat) -> PlacedObject:
    """Return a row without gaps as a single object with one outline."""
    end = min(repeat.s + repeat.length, road.length)
    begin = min(repeat.s, end)
    width = np.array(repeat.width) if any(repeat.width) else 2.0 * np.array(repeat.radius)

    def lines(s: Float) -> Float:
        """Return the left and right edge at the foot, and the height of the top above it as a third line."""
        share = (s - repeat.s) / repeat.length
        t, half = np.interp(share, _ENDS, repeat.t), np.interp(share, _ENDS, width) / 2.0
        up = np.interp(share, _ENDS, repeat.z_offset)
        height = np.zeros((len(s), 3))
        height[:, 2] = np.interp(share, _ENDS, repeat.height)
        return np.stack([_lifted(road.place(s, t + half), up), _lifted(road.place(s, t - half), up), height], axis=1)

    starts = np.concatenate([road.reference_line.s, road.elevation.start, road.superelevation.start])
    knots = [begin, *starts[(starts > begin) & (starts < end)].tolist(), end]
    _, points = sample(lines, knots, _STRIP_TOLERANCE, f"road {road.id}, object {obj.id}")
    left, right, height = points[:, 0], points[:, 1], points[:, 2, 2]
    closed = bool(width.any())
    outline = Outline(
        np.concatenate([left, right[::-1]]) if closed else left,
        np.concatenate([height, height[::-1]]) if closed else height,
        closed,
    )
    first = _in_row(obj, repeat, 0.0)
    placed = _place(road, first, replace(first, length=end - begin, outlines=()))
    return replace(placed, outlines=(outline,) if len(points) else ())


def _point(road: Road, s: float, t: float, up: float) -> Float:
    """Return the point (3,) at a height (metres) vertically above a place of the road."""
    return np.asarray(_lifted(road.place(np.array([s]), np.array([t])), np.array([up]))[0])


def _lifted(points: Float, height: Float) -> Float:
    """Return points (k, 3) lifted straight up by (k,) metres."""
    return np.asarray(points + height[:, None] * np.array([0.0, 0.0, 1.0]))
