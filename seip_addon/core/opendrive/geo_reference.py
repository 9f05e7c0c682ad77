"""From latitude and longitude to the metres of a map, where its reference is a transverse Mercator projection."""

import math
import re
from dataclasses import dataclass

_SEMI_MAJOR_AXIS, _FLATTENING = 6_378_137.0, 1 / 298.257223563  # of WGS 84; GRS 80 differs by 0.1 mm
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
        """Return easting and northing, metres, of a place in radians.

        After Krüger (1912) with four terms: within 1,000 km of the central meridian exact to a millimetre.
        """
        n = _FLATTENING / (2 - _FLATTENING)
        radius = _SEMI_MAJOR_AXIS / (1 + n) * (1 + n**2 / 4 + n**4 / 64)
        xi, eta = self._on_sphere(latitude, longitude - self.longitude, n)
        origin, _ = self._on_sphere(self.latitude, 0.0, n)
        return (
            self.false_easting + self.scale * radius * eta,
            self.false_northing + self.scale * radius * (xi - origin),
        )

    def _on_sphere(self, latitude: float, east: float, n: float) -> tuple[float, float]:
        root = 2 * math.sqrt(n) / (1 + n)
        sine = math.sin(latitude)
        conformal = math.sinh(math.atanh(sine) - root * math.atanh(root * sine))
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


def projection(geo_reference: str | None) -> TransverseMercator | None:
    """Return the projection that a map's reference names, None where it is another or none.

    UTM zones, by their EPSG codes too, and ``+proj=tmerc`` on WGS 84 or GRS 80
    in metres are known. Where a reference shifts its datum it is another.
    """
    text = geo_reference or ""
    if code := _UTM.search(text):
        return _utm(int(code[2]), south=code[1] == "327")
    values = _parameters(text)
    kind = values.get("proj", "")
    datum = values.get("datum", values.get("ellps", "WGS84")).upper()
    shifted = any(float(part or 0) for part in values.get("towgs84", "").split(",") if _is_number(part))
    if datum not in _WORLD_DATUMS or shifted or values.get("units", "m") != "m":
        return None
    if kind == "utm" and values.get("zone", "").isdigit():
        return _utm(int(values["zone"]), south="south" in values)
    if kind != "tmerc":
        return None
    defaults = {"lat_0": "0", "lon_0": "0", "k": values.get("k_0", "1"), "x_0": "0", "y_0": "0"}
    given = [values.get(name, default) for name, default in defaults.items()]
    if not all(map(_is_number, given)):
        return None
    latitude, longitude, scale, easting, northing = map(float, given)
    return TransverseMercator(math.radians(latitude), math.radians(longitude), scale, easting, northing)


def middle_of_reference(geo_reference: str | None) -> tuple[float, float] | None:
    """Return the latitude and longitude, degrees, that a reference names as its origin."""
    values = _parameters(geo_reference or "")
    pair = [values.get(name, "") for name in ("lat_0", "lon_0")]
    return (float(pair[0]), float(pair[1])) if all(map(_is_number, pair)) else None


def _utm(zone: int, *, south: bool) -> TransverseMercator | None:
    if not 1 <= zone <= 60:
        return None
    return TransverseMercator(0.0, math.radians(6 * zone - 183), 0.9996, 500_000.0, 10_000_000.0 if south else 0.0)


def _parameters(text: str) -> dict[str, str]:
    pairs = (word[1:].partition("=") for word in text.split() if word.startswith("+"))
    return {name: value for name, _, value in pairs}


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
