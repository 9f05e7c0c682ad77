"""Transverse Mercator projections: conversion between latitude and longitude and the metres of a map."""

import math
import re
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Float
from ..base.counts import is_number

_SEMI_MAJOR_AXIS, _FLATTENING = 6_378_137.0, 1 / 298.257223563  # of WGS 84; GRS 80 differs by 0.1 mm
_THIRD_FLATTENING = _FLATTENING / (2 - _FLATTENING)
_ECCENTRICITY = math.sqrt(_FLATTENING * (2 - _FLATTENING))
_RADIUS = _SEMI_MAJOR_AXIS / (1 + _THIRD_FLATTENING) * (1 + _THIRD_FLATTENING**2 / 4 + _THIRD_FLATTENING**4 / 64)
_SOUTHERN_NORTHING = 10_000_000.0  # false northing of southern UTM zones, metres
_NEWTON_STEPS = 5  # two reach full precision away from the poles
_UTM = re.compile(r"EPSG:+(258|326|327)(\d\d)\b", re.IGNORECASE)
_WORLD_DATUMS = {"WGS84", "GRS80", "ETRS89"}


@dataclass(frozen=True)
class TransverseMercator:
    """A transverse Mercator projection of WGS 84: angles in radians, lengths in metres."""

    latitude: float
    longitude: float
    scale: float
    false_easting: float
    false_northing: float

    def __call__(self, latitude: float, longitude: float) -> tuple[float, float]:
        """Return easting and northing (metres) of a latitude and longitude (radians).

        Series of Krüger (1912) with four terms, exact to a millimetre within 1,000 km of the central meridian.
        """
        xi, eta = self._on_sphere(latitude, longitude - self.longitude)
        origin, _ = self._on_sphere(self.latitude, 0.0)
        return (
            self.false_easting + self.scale * _RADIUS * eta,
            self.false_northing + self.scale * _RADIUS * (xi - origin),
        )

    def inverse(self, easting: Float, northing: Float) -> tuple[Float, Float]:
        """Return latitudes and longitudes (n,), radians, of eastings and northings (n,), metres.

        Inverse series of Krüger; the latitude follows from the conformal latitude by Newton's method.
        """
        n = _THIRD_FLATTENING
        origin, _ = self._on_sphere(self.latitude, 0.0)
        xi = (northing - self.false_northing) / (self.scale * _RADIUS) + origin
        eta = (easting - self.false_easting) / (self.scale * _RADIUS)
        terms = (
            n / 2 - 2 * n**2 / 3 + 37 * n**3 / 96 - n**4 / 360,
            n**2 / 48 + n**3 / 15 - 437 * n**4 / 1440,
            17 * n**3 / 480 - 37 * n**4 / 840,
            4397 * n**4 / 161280,
        )
        pairs = list(enumerate(terms, start=1))
        xi, eta = (
            xi - sum(b * np.sin(2 * j * xi) * np.cosh(2 * j * eta) for j, b in pairs),
            eta - sum(b * np.cos(2 * j * xi) * np.sinh(2 * j * eta) for j, b in pairs),
        )
        conformal = np.sin(xi) / np.hypot(np.sinh(eta), np.cos(xi))  # tangent of the conformal latitude
        longitude = self.longitude + np.arctan2(np.sinh(eta), np.cos(xi))
        return np.arctan(_tangent_of_latitude(conformal)), (longitude + math.pi) % math.tau - math.pi

    @property
    def zone(self) -> str:
        """The UTM zone with its hemisphere, such as "50S"; "" for other projections."""
        number = round((math.degrees(self.longitude) + 183) / 6)
        zones = (f"{number}{'S' if south else 'N'}" for south in (False, True) if self == _utm(number, south=south))
        return next(zones, "")

    def _on_sphere(self, latitude: float, east: float) -> tuple[float, float]:
        n = _THIRD_FLATTENING
        sine = math.sin(latitude)
        # The ellipsoid is mapped to a sphere (conformal latitude), this by the spherical transverse Mercator
        # projection, and the result corrected by a series in the third flattening.
        conformal = math.sinh(math.atanh(sine) - _ECCENTRICITY * math.atanh(_ECCENTRICITY * sine))
        xi = math.atan2(conformal, math.cos(east))
        eta = math.atanh(math.sin(east) / math.hypot(1.0, conformal))
        terms = (
            n / 2 - 2 * n**2 / 3 + 5 * n**3 / 16 + 41 * n**4 / 180,
            13 * n**2 / 48 - 3 * n**3 / 5 + 557 * n**4 / 1440,
            61 * n**3 / 240 - 103 * n**4 / 140,
            49561 * n**4 / 161280,
        )
        pairs = list(enumerate(terms, start=1))
        return (
            xi + sum(a * math.sin(2 * j * xi) * math.cosh(2 * j * eta) for j, a in pairs),
            eta + sum(a * math.cos(2 * j * xi) * math.sinh(2 * j * eta) for j, a in pairs),
        )


@dataclass(frozen=True)
class GeoReference:
    """Position of a map on the Earth.

    Parameters
    ----------
    projection : str
        Projection as written in the map, or "".
    header_offset : (4,) float
        Offset from map coordinates x, y, z (metres) to projected ones, and a heading (radians).

    Examples
    --------
    A point of a map of Munich whose zero is at 691 km east and 5,334 km north in UTM zone 32:

    >>> reference = GeoReference("+proj=utm +zone=32 +datum=WGS84", (691_000.0, 5_334_000.0, 0.0, 0.0))
    >>> reference.geographic(np.array([[1103.0, 605.0, 515.0]])).round(4).tolist()
    [[11.5821, 48.1357, 515.0]]
    >>> GeoReference("EPSG:31468").obstacle
    "the projection of the scene's map, 'EPSG:31468', is not supported"
    """

    projection: str = ""
    header_offset: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    @property
    def mercator(self) -> TransverseMercator | None:
        """The projection; None if it is not known, or the header rotates the map."""
        return None if self.header_offset[3] else projection(self.projection)

    def in_hemisphere(self, point: Float) -> "GeoReference":
        """Return the same reference in the UTM zone of the hemisphere where a point of the map (3,) is.

        Maps south of the equator often use northern zones, with negative northings; southern zones add 10,000 km.

        Examples
        --------
        >>> perth = GeoReference("+proj=utm +zone=50", (395_000.0, -3_539_000.0, 0.0, 0.0))
        >>> perth.in_hemisphere(np.array([843.0, 776.0, 0.0]))
        GeoReference(projection='EPSG:32750', header_offset=(395000.0, 6461000.0, 0.0, 0.0))
        """
        zone = "" if self.mercator is None else self.mercator.zone
        if not zone.endswith("N") or self.projected(point[None])[0, 1] >= 0.0:
            return self
        x, y, z, heading = self.header_offset
        return GeoReference(f"EPSG:{_epsg(f'{zone[:-1]}S')}", (x, y + _SOUTHERN_NORTHING, z, heading))

    def projected(self, points: Float) -> Float:
        """Return easting, northing and height (metres) of points (n, 3) in map coordinates without rotation."""
        moved: Float = points + np.array(self.header_offset[:3])
        return moved

    def geographic(self, points: Float) -> Float | None:
        """Return the geographic coordinates of points of the map on WGS 84.

        Parameters
        ----------
        points : (n, 3) float64, metres
            Map coordinates.

        Returns
        -------
        (n, 3) float64 or None
            Longitude and latitude, degrees, and height above the map's zero, metres; None if the projection is not
            known.
        """
        mercator = self.mercator
        if mercator is None:
            return None
        easting, northing, height = self.projected(points).T
        latitude, longitude = mercator.inverse(easting, northing)
        return np.column_stack([np.degrees(longitude), np.degrees(latitude), height])

    @property
    def obstacle(self) -> str:
        """Reason why there are no geographic coordinates, as part of a sentence, or ""."""
        if self.mercator is not None:
            return ""
        if not self.projection:
            return "the scene's map names no projection"
        if self.header_offset[3] and projection(self.projection) is not None:
            return "the header of the scene's map turns its coordinates"
        return f"the projection of the scene's map, {self.projection!r}, is not supported"


def _tangent_of_latitude(conformal: Float) -> Float:
    """Return the tangent of the latitude (n,) from that of the conformal latitude (Karney 2011, eq. 19-21)."""
    squared = _ECCENTRICITY**2
    tangent = conformal / (1 - squared)
    for _ in range(_NEWTON_STEPS):
        secant = np.hypot(1.0, tangent)
        sigma = np.sinh(_ECCENTRICITY * np.arctanh(_ECCENTRICITY * tangent / secant))
        reached = tangent * np.hypot(1.0, sigma) - sigma * secant
        slope = (1 - squared) * secant / (1 + (1 - squared) * tangent**2)
        tangent = tangent + (conformal - reached) / (np.hypot(1.0, reached) * slope)
    return tangent


def projection(geo_reference: str | None) -> TransverseMercator | None:
    """Return the projection of a map's reference, None if there is none or it is not supported.

    Supported are UTM zones, also by EPSG code, and ``+proj=tmerc`` on WGS 84 or GRS 80 in metres, both without a datum
    shift.
    """
    text = geo_reference or ""
    if code := _UTM.search(text):
        return _utm(int(code[2]), south=code[1] == "327")
    values = _parameters(text)
    kind = values.get("proj", "")
    datum = values.get("datum", values.get("ellps", "WGS84")).upper()
    shifted = any(float(part or 0) for part in values.get("towgs84", "").split(",") if is_number(part))
    if datum not in _WORLD_DATUMS or shifted or values.get("units", "m") != "m":
        return None
    if kind == "utm" and values.get("zone", "").isdigit():
        return _utm(int(values["zone"]), south="south" in values)
    if kind != "tmerc":
        return None
    defaults = {"lat_0": "0", "lon_0": "0", "k": values.get("k_0", "1"), "x_0": "0", "y_0": "0"}
    given = [values.get(name, default) for name, default in defaults.items()]
    if not all(map(is_number, given)):
        return None
    latitude, longitude, scale, easting, northing = map(float, given)
    return TransverseMercator(math.radians(latitude), math.radians(longitude), scale, easting, northing)


def _utm(zone: int, *, south: bool) -> TransverseMercator | None:
    if not 1 <= zone <= 60:
        return None
    northing = _SOUTHERN_NORTHING if south else 0.0
    return TransverseMercator(0.0, math.radians(6 * zone - 183), 0.9996, 500_000.0, northing)


def _epsg(zone: str) -> int:
    """Return the EPSG code of a UTM zone on WGS 84, such as 32750 for 50S."""
    return (32700 if zone.endswith("S") else 32600) + int(zone[:-1])


def _parameters(text: str) -> dict[str, str]:
    pairs = (word[1:].partition("=") for word in text.split() if word.startswith("+"))
    return {name: value for name, _, value in pairs}
