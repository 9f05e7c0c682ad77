"""Objects and signals of a map in map coordinates; `tests/core/world/opendrive/test_opendrive_objects.py` has some."""

from dataclasses import dataclass, replace

import numpy as np
from shapely import MultiPoint
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float

TUNNEL = "tunnel"
"""Kind of the objects that stand for the tunnels of a map: lines along the road."""


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
    yaw : float, radians
        Rotation about the vertical, counter-clockwise from +x; its outlines also have the file's pitch and roll.
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
    length: float = 0.0
    width: float = 0.0
    height: float = 0.0
    radius: float = 0.0
    outlines: tuple[Outline, ...] = ()

    def moved(self, by: Float) -> "PlacedObject":
        """Return the object moved by a vector (3,), metres."""
        outlines = tuple(replace(outline, base=outline.base + by) for outline in self.outlines)
        return replace(self, position=self.position + by, outlines=outlines)


@dataclass(frozen=True, eq=False)
class PlacedSignal:
    """A traffic light in map coordinates: depending on the map the foot of its post, or the lamp above the carriageway.

    Parameters
    ----------
    road_id : str
        Road that it applies to.
    name : str
        Name as in the file.
    position : (3,) float64, metres
        Position in map coordinates.
    yaw : float, radians
        Direction of the controlled traffic by the standard, counter-clockwise from +x; some exporters give the
        direction that the signal faces.
    """

    road_id: str
    name: str
    position: Float
    yaw: float


def extent_in_plan(placed: PlacedObject) -> BaseGeometry:
    """Return the convex hull in plan of an object's origin and outlines."""
    return MultiPoint(np.vstack([placed.position, *(outline.base for outline in placed.outlines)])[:, :2]).convex_hull
