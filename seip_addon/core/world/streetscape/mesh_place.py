"""Position of an imported mesh in a modelled site."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ...arrays import Float
from ...errors import SeipError
from ...geometry.geo_reference import GeoReference
from ...geometry.plan import surface_height
from ...site.roles import Role
from .geographic_position import looks_like_degrees
from .model import SiteModel
from .parts import Part

REACH = 2000.0  # metres from the region of a site within which a mesh can be placed


@dataclass(frozen=True)
class MeshPlace:
    """Position of a mesh's origin, local axes in metres, and heading of its x axis, radians counter-clockwise."""

    position: tuple[float, float, float]
    heading: float


def mesh_place(model: SiteModel, given: Sequence[float], name: str) -> MeshPlace:
    """Return the position of a mesh from the given position of its origin.

    Parameters
    ----------
    model : SiteModel
        Site to place the mesh in.
    given : sequence of two or three float
        Latitude and longitude in degrees, or map coordinates in metres, optionally followed by a heading in degrees
        counter-clockwise from east. Numbers that can be both are degrees if that place is at the site.
    name : str
        Name of the mesh file, for messages.

    Raises
    ------
    SeipError
        The numbers are not finite, there are too few or too many, or the place is not at the site.
    """
    if len(given) not in (2, 3) or not all(map(math.isfinite, given)):
        raise SeipError(f"the origin of {name} must be LAT LON [HEADING], or X Y [HEADING] of the map")
    place = _local(model, given[:2])
    if place is None:
        x, y = model.origin[:2]
        raise SeipError(
            f"{given[0]:g}, {given[1]:g} is not within {REACH:,.0f} m of the site, in degrees or in metres of the map; "
            f"the site's centre is at map ({x:.0f}, {y:.0f}): give the position of the origin of {name}"
        )
    heading = math.radians(given[2]) if len(given) == 3 else 0.0
    return MeshPlace((float(place[0]), float(place[1]), ground_height(model.parts, place)), heading)


def ground_height(parts: Sequence[Part], place: Float) -> float:
    """Return the height of roads and ground at a place (2,), or outside them that of the nearest corner, metres."""
    lying = [part.solid for part in parts if {Role.ROADS, Role.GROUND} & set(part.roles)]
    fans = [
        solid.vertices[[(face[0], face[i], face[i + 1]) for face in solid.faces for i in range(1, len(face) - 1)]]
        for solid in lying
    ]
    height = float(surface_height(place[None], np.concatenate(fans))[0])
    if math.isfinite(height):
        return height
    corners = np.concatenate([solid.vertices for solid in lying])
    return float(corners[np.argmin(np.hypot(*(corners[:, :2] - place).T)), 2])


def _local(model: SiteModel, given: Sequence[float]) -> Float | None:
    """Return the place (2,) that two numbers give, local axes; None if it is not at the site."""
    places = []
    x, y, z, heading = model.header_offset.tolist()
    mercator = GeoReference(model.geo_reference or "", (x, y, z, heading)).mercator
    if mercator is not None and looks_like_degrees((given[0], given[1])) and abs(given[0]) < 90.0:
        places.append(np.array(mercator(math.radians(given[0]), math.radians(given[1]))) - [x, y])
    places.append(np.array(given, dtype=np.float64))
    for place in places:
        local = place - model.origin[:2]
        if model.region.distance(shapely.Point(local)) <= REACH:
            return np.asarray(local)
    return None
