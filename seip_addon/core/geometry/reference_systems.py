"""Conversion between reference systems with EPSG codes and the coordinates of a map.

UTM zones and the map's own system are built in; other systems need pyproj.
"""

import importlib
import re
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from ..base.arrays import Float
from ..base.errors import SeipError
from .geo_reference import GeoReference, TransverseMercator, projection

HORIZONTAL = {7415: 28992, 5554: 25831, 5555: 25832, 5556: 25833}
"""Code of each compound system, and of its horizontal part: heights are used unchanged."""
GEOGRAPHIC = (4326, 4258)  # longitude and latitude in degrees on WGS 84, and on ETRS89
_CODE = re.compile(r"EPSG[\"':,/\s]+(?:[\d.]+[:/])?(\d{4,6})\b", re.IGNORECASE)
_OWN_CODE = re.compile(r"(?:AUTHORITY|ID)\[\"EPSG\",\"?(\d{4,6})", re.IGNORECASE)
_PROJECTED = re.compile(r"PROJ(?:CS|CRS|ECTEDCRS)\[", re.IGNORECASE)
_WELL_KNOWN = re.compile(r"\s*\w+\[")

Transform = Callable[[Float], Float]


@dataclass(frozen=True, eq=False)
class Reprojection:
    """Conversions between a reference system and a map.

    Parameters
    ----------
    to_map, from_map : callable
        Conversion of places (n, 2) between system and map; metres, or degrees of longitude and latitude.
    to_geographic : callable
        Conversion of places (n, 2) in the system to longitude and latitude (n, 2), degrees.
    """

    to_map: Transform
    from_map: Transform
    to_geographic: Transform


def epsg_code(text: str) -> int | None:
    """Return the EPSG code in a text such as ``EPSG:28992`` or a URL; None without one.

    For well-known text this is the code of the whole system; for a compound system, that of its horizontal part.
    """
    start = _PROJECTED.search(text)
    if start is None:
        found = [] if _WELL_KNOWN.match(text) else _CODE.findall(text)
        return int(found[-1]) if found else None
    # The code of the system itself stands at the second level of brackets. Deeper ones belong to its parts, such as
    # datum and units.
    depth, own = 0, ""
    for character in text[start.start() :]:
        depth += (character == "[") - (character == "]")
        own += character if depth < 3 else ""
        if character == "]" and depth == 0:
            break
    found = _OWN_CODE.findall(own)
    return int(found[-1]) if found else None


def reprojection(code: int, reference: GeoReference, name: str) -> Reprojection:
    """Return the conversions between a reference system and a map.

    Parameters
    ----------
    code : int
        EPSG code of the system.
    reference : GeoReference
        Position of the map on the Earth.
    name : str
        Name of the file in that system, for messages.

    Raises
    ------
    SeipError
        The map has no known position, or pyproj is needed and missing, or does not know the system.
    """
    if reference.header_offset[3] or not reference.projection:
        why = "turns its coordinates" if reference.projection else "names no projection"
        raise SeipError(
            f"{name} cannot be placed on the map, whose header {why}: use a map with a <geoReference> and no rotation"
        )
    offset = np.array(reference.header_offset[:2])
    code = HORIZONTAL.get(code, code)
    source, mercator = projection(f"EPSG:{code}"), projection(reference.projection)
    own = epsg_code(reference.projection)
    if mercator is not None and (source is not None or code in GEOGRAPHIC):
        to_degrees = _as_is if source is None else lambda places: _geographic(source, places)
        from_degrees = _as_is if source is None else lambda places: _projected(source, places)
        if source == mercator:
            return Reprojection(lambda xy: xy - offset, lambda xy: xy + offset, to_degrees)
        return Reprojection(
            lambda xy: _projected(mercator, to_degrees(xy)) - offset,
            lambda xy: from_degrees(_geographic(mercator, xy + offset)),
            to_degrees,
        )
    pyproj = _pyproj(code, name)
    try:
        system = pyproj.CRS.from_epsg(code)
    except pyproj.exceptions.CRSError as error:
        raise SeipError(f"{name} is in EPSG:{code}, which pyproj does not know: convert the file to UTM") from error
    try:
        text = reference.projection if mercator is None else mercator.wkt
        target = pyproj.CRS.from_epsg(own) if mercator is None and own else pyproj.CRS.from_user_input(text)
    except pyproj.exceptions.CRSError as error:
        raise SeipError(
            f"the projection of the map, {reference.projection[:100]!r}, is not known to pyproj, so {name} cannot be "
            "placed on it: use a map with a known projection"
        ) from error
    there = pyproj.Transformer.from_crs(system, target, always_xy=True)
    degrees = pyproj.Transformer.from_crs(system, "EPSG:4326", always_xy=True)
    return Reprojection(
        lambda xy: np.column_stack(there.transform(*xy.T.tolist())) - offset,
        lambda xy: np.column_stack(there.transform(*(xy + offset).T.tolist(), direction="INVERSE")),
        lambda xy: np.column_stack(degrees.transform(*xy.T.tolist())),
    )


def _as_is(places: Float) -> Float:
    return places


def _geographic(mercator: TransverseMercator, places: Float) -> Float:
    latitude, longitude = mercator.inverse(*places.T)
    return np.degrees(np.column_stack([longitude, latitude]))


def _projected(mercator: TransverseMercator, places: Float) -> Float:
    radians = np.radians(places)
    projected = [mercator(latitude, longitude) for longitude, latitude in radians.tolist()]
    return np.array(projected, dtype=np.float64).reshape(-1, 2)


def _pyproj(code: int, name: str) -> ModuleType:
    try:
        return importlib.import_module("pyproj")
    except ModuleNotFoundError as error:
        raise SeipError(
            f"{name} is in EPSG:{code}, which needs pyproj: pip install pyproj, or convert the file to a UTM zone"
        ) from error
