"""Conversion of a place given as latitude and longitude on a map in metres."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Float
from ...errors import SeipError
from ...geometry.geo_reference import middle_of_reference, projection
from ..opendrive.lanes import LaneSurface
from ..opendrive.road_map import RoadMap
from .description import SiteDescription

MAX_ROAD_DISTANCE = 1000.0  # metres beyond the roads of a map within which a place may lie
ALTERNATIVE_DISTANCE = 10.0
"""Metres: a pair of numbers is taken as metres if it is the same place in degrees and in metres up to this distance."""
MAX_ORIGIN_OFFSET = 0.05  # degrees from the origin of a map's reference within which its roads lie


def in_metres(
    description: SiteDescription, road_map: RoadMap, surfaces: Sequence[LaneSurface]
) -> tuple[SiteDescription, tuple[str, ...]]:
    """Return a description with its centre in metres, and a note if that was given in degrees.

    A pair of numbers is taken as latitude and longitude if the map's projection converts it to a place on the map.

    Raises
    ------
    SeipError
        The numbers appear to be latitude and longitude, and the map has no projection to convert them.
    """
    if description.near is None or not looks_like_degrees(description.near):
        return description, ()
    place = _converted(description.near, road_map, surfaces)
    if place is None:
        _refuse_near_origin(description.near, road_map)
        return description, ()
    first, second = description.near
    x, y = place
    note = (
        f"{first:g}, {second:g} are taken as latitude and longitude: the middle of the place is map ({x:.1f}, {y:.1f})"
    )
    return replace(description, near=(x, y)), (note,)


def looks_like_degrees(near: tuple[float, float]) -> bool:
    """Return whether two numbers can be latitude and longitude, in either order."""
    low, high = sorted(map(abs, near))
    return low <= 90.0 and high <= 180.0


def _converted(
    near: tuple[float, float], road_map: RoadMap, surfaces: Sequence[LaneSurface]
) -> tuple[float, float] | None:
    """Return the place in metres for a latitude and longitude in either order; None if it is not on the map."""
    to_metres = projection(road_map.geo_reference)
    if to_metres is None or road_map.header_offset[3]:
        return None
    points = np.concatenate([np.concatenate([lane.left, lane.right])[:, :2] for lane in surfaces])
    low, high = points.min(axis=0) - MAX_ROAD_DISTANCE, points.max(axis=0) + MAX_ROAD_DISTANCE
    for latitude, longitude in (near, near[::-1]):
        if abs(latitude) < 90.0:
            projected = np.array(to_metres(math.radians(latitude), math.radians(longitude)))
            # Map coordinates are projected ones less the header's offset; maps that do not subtract it are accepted
            # too.
            for place in (projected - road_map.header_offset[:2], projected):
                if _is_within(place, low, high) and np.hypot(*(place - near)) > ALTERNATIVE_DISTANCE:
                    return float(place[0]), float(place[1])
    return None


def _is_within(place: Float, low: Float, high: Float) -> bool:
    return bool((place >= low).all() and (place <= high).all())


def _refuse_near_origin(near: tuple[float, float], road_map: RoadMap) -> None:
    origin = middle_of_reference(road_map.geo_reference)
    whole = all(float(value).is_integer() for value in near)
    if origin is None or whole or projection(road_map.geo_reference) is not None:
        return
    if any(math.dist(pair, origin) < MAX_ORIGIN_OFFSET for pair in (near, near[::-1])):
        raise SeipError(
            f"{near[0]:g}, {near[1]:g} look like latitude and longitude, but map {road_map.name!r} is in metres "
            "and names no projection to convert them: give map coordinates, or a junction"
        )
