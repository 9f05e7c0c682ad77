"""Locations of sensors in words: street, side, distances from the kerb and from the nearest crossing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Float
from ..geometry.plan import outline
from .scene_geometry import NamedArea, SceneGeometry

DIRECTIONS = ("east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east")
ON_KERB = 0.05  # metres from the kerb up to which a sensor stands on it
MAX_FROM_STREET = 3.0  # metres from a kerb to a named street beside which it is
MAX_FROM_CORNER = 20.0  # metres from a kerb farther from the nearest street to the second one, at whose corner it is
MAX_FROM_CROSSING = 60.0  # metres up to which a crossing says where a sensor is


def direction(towards: Float | tuple[float, float]) -> str:
    """Return the compass direction of a vector in plan (2,); north is the direction of the map's y axis."""
    return DIRECTIONS[round(math.atan2(towards[1], towards[0]) / (math.pi / 4)) % 8]


def locations(geometry: SceneGeometry, feet: Float) -> list[str]:
    """Describe where each foot of a sensor is, such as "north kerb of Rope Lane, 1.2 m behind the kerb, …".

    Parameters
    ----------
    geometry : SceneGeometry
        Scene with the roads, and with the streets and crossings that its map names.
    feet : (k, 2) float64, metres
        Local coordinates.

    Returns
    -------
    list of str
    """
    roads = shapely.union_all([outline(mesh.triangles) for mesh in geometry.roads])
    if roads.is_empty:
        return [""] * len(feet)
    shapely.prepare(roads)
    streets = [place for place in geometry.places if place.street]
    crossings = [place for place in geometry.places if place.crossing]
    return [", ".join(_parts(foot, roads, streets, crossings)) for foot in feet]


def _parts(foot: Float, roads: BaseGeometry, streets: Sequence[NamedArea], crossings: Sequence[NamedArea]) -> list[str]:
    """Return the parts of a description: side of a street, distance from its kerb, and from a crossing."""
    point = shapely.Point(foot)
    kerb = shapely.get_coordinates(shapely.shortest_line(shapely.boundary(roads), point))[0]
    inside = bool(shapely.contains(roads, point))
    away = float(np.hypot(*(foot - kerb)))
    side = direction(kerb - foot if inside else foot - kerb) if away > ON_KERB else ""
    behind = (
        "on the kerb" if away <= ON_KERB else f"{away:.1f} m {'into the road from' if inside else 'behind'} the kerb"
    )
    return [_side(shapely.Point(kerb), side, streets), behind, *_from_crossing(point, crossings)]


def _side(kerb: shapely.Point, side: str, streets: Sequence[NamedArea]) -> str:
    """Return which kerb of which street a point of a kerb belongs to, or at the corner of which streets it is."""
    near = sorted((float(shapely.distance(street.polygon, kerb)), street.name) for street in streets)
    lead = f"{side} " if side else ""
    if not near:
        return f"{lead}kerb of the road"
    if near[0][0] <= MAX_FROM_STREET or len(near) == 1 or near[1][0] > MAX_FROM_CORNER:
        return f"{lead}kerb of {near[0][1]}"
    return f"{lead}corner of {near[0][1]} and {near[1][1]}"


def _from_crossing(point: shapely.Point, crossings: Sequence[NamedArea]) -> list[str]:
    """Return distance and direction from the nearest crossing, in a list that is empty where none is near."""
    near = min(crossings, key=lambda one: float(shapely.distance(one.polygon, point)), default=None)
    if near is None:
        return []
    away = float(shapely.distance(near.polygon, point))
    if away > MAX_FROM_CROSSING:
        return []
    name = near.name[:1].lower() + near.name[1:] if near.name.startswith("Crossing") else near.name
    if away < 1.0:
        return [f"beside the {name}"]
    nearest = shapely.get_coordinates(shapely.shortest_line(near.polygon, point))
    return [f"{away:.0f} m {direction(nearest[1] - nearest[0])} of the {name}"]
