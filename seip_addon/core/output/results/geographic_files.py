"""``placement.geojson`` (RFC 7946) and ``placement.kml`` (OGC KML 2.2): a placement in longitude and latitude."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Boolean, Float
from ...choosing.placement.deployment import Deployment
from ...geometry.orientation import degrees, tilt_degrees
from ...geometry.plan import closed
from ...site.scene_geometry import NamedArea, SceneGeometry
from ...site.site import Site
from ...site.targets import target_squares
from ...storage.files import whole_file
from ..pictures.palette import SEEN_COLOURS, WEIGHTED

LOCATED_FILES = ("placement.geojson", "placement.kml")
DECIMALS = 8  # of degrees: about a millimetre
GAP = 0.06
"""Cracks in the region up to twice this (metres) are closed."""
METRE_DECIMALS = 6  # to which the corners of squares are rounded, so that neighbours share theirs
NAMESPACE = "http://www.opengis.net/kml/2.2"
KML_STYLES = {
    "unseen": ("", SEEN_COLOURS[0], 0x90),
    "seen": ("", SEEN_COLOURS[1], 0x90),
    "seen-twice": ("", SEEN_COLOURS[2], 0x90),
    "region": ("#202020", "", 0),
    "weighted": (WEIGHTED, "", 0),
}
"""Line and fill of each style, ``#rrggbb`` or empty for none, and how opaque (0 to 255) the fill is."""
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 has no place for."""
Feature = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Located:
    """A placement on WGS 84; outer rings of polygons turn counter-clockwise.

    Parameters
    ----------
    points : (k, 3) float64
        Longitude, latitude (degrees) and height above the map's zero (metres) of each sensor.
    region : tuple of polygons
        Region of interest.
    weighted : tuple of (NamedArea, tuple of polygons)
    """

    site: Site
    deployment: Deployment
    points: Float
    region: tuple[shapely.Polygon, ...]
    weighted: tuple[tuple[NamedArea, tuple[shapely.Polygon, ...]], ...]

    def patches(self) -> Iterator[tuple[list[str], tuple[shapely.Polygon, ...]]]:
        """Yield for each set of sensors, by their labels, the road that these see and no others."""
        squares = np.round(target_squares(self.site.targets)[:, :, :2], METRE_DECIMALS)
        rows: Boolean = self.deployment.rows.reshape(-1, len(squares))
        sets, which = np.unique(rows.T, axis=0, return_inverse=True)
        for number in range(len(sets)):
            own = which.ravel() == number
            area = shapely.coverage_union_all(shapely.polygons(squares[own]))
            seers = [sensor.label for sensor, sees in zip(self.deployment.sensors, sets[number], strict=True) if sees]
            yield seers, _polygons(self.site, area)


def located(geometry: SceneGeometry, site: Site, deployment: Deployment) -> Located | None:
    """Return a placement on WGS 84; None where the projection of the map is not known."""
    points = site.geographic(np.array([sensor.xyz for sensor in deployment.sensors]).reshape(-1, 3))
    if points is None:
        return None
    rounded = np.column_stack([np.round(points[:, :2], DECIMALS), np.round(points[:, 2], 3)])
    weighted = tuple((area, _polygons(site, area.polygon)) for area in geometry.weighted_regions)
    return Located(site, deployment, rounded, _polygons(site, closed(site.region, GAP)), weighted)


def missing_sentence(site: Site, files: Sequence[str]) -> str:
    """Return why files that need longitude and latitude are missing, or ""."""
    obstacle = site.geo_reference.obstacle
    return f"{' and '.join(files)} cannot be written: {obstacle}" if obstacle else ""


def save_geojson(path: str | os.PathLike[str], placed: Located) -> None:
    """Write a feature collection, a line for each feature.

    Positions are longitude and latitude, degrees on WGS 84; those of sensors have the height above the map's zero,
    metres, as their third number.
    """
    save_features(path, placed.site.name, placed.site.attribution, _features(placed))


def save_features(
    path: str | os.PathLike[str], name: str, attribution: Sequence[str], features: Iterable[Feature]
) -> None:
    """Write a feature collection with its name and credits, and its features on a line each."""
    about = {"type": "FeatureCollection", "name": name} | ({"attribution": attribution} if attribution else {})
    lines = (json.dumps(one, ensure_ascii=False, allow_nan=False, separators=(",", ":")) for one in features)
    text = f'{json.dumps(about, ensure_ascii=False)[:-1]}, "features": [\n' + ",\n".join(lines) + "\n]}\n"
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def feature(kind: str, shape: str, coordinates: object, **properties: object) -> Feature:
    """Return a feature with its kind among its properties."""
    geometry = {"type": shape, "coordinates": coordinates}
    return {"type": "Feature", "geometry": geometry, "properties": {"kind": kind, **properties}}


def _features(placed: Located) -> Iterator[Feature]:
    for sensor, point in zip(placed.deployment.sensors, placed.points.tolist(), strict=True):
        about = {
            "id": sensor.label,
            "sensor": sensor.model.key,
            "sensor_name": sensor.model.name,
            "position": sensor.position_name,
            "on_pole": sensor.on_pole,
            "height_m": round(sensor.height, 3),
            "yaw_deg": degrees(sensor.yaw),
            "tilt_deg": tilt_degrees(sensor.tilt),
            "price_usd": round(sensor.price, 2),
            "coverage_alone": round(sensor.alone, 6),
        }
        yield feature("sensor", "Point", point, **about)
    yield feature("region of interest", *_multipolygon(placed.region), name=placed.site.name)
    for area, polygons in placed.weighted:
        yield feature("weighted region", *_multipolygon(polygons), name=area.name, weight=area.weight)
    for seers, polygons in placed.patches():
        yield feature("coverage patch", *_multipolygon(polygons), seen_by=seers, times_seen=len(seers))


def _multipolygon(polygons: Sequence[shapely.Polygon]) -> tuple[str, object]:
    if len(polygons) == 1:
        return "Polygon", _rings(polygons[0])
    return "MultiPolygon", [_rings(polygon) for polygon in polygons]


def _rings(polygon: shapely.Polygon) -> list[list[list[float]]]:
    """Return the corners of a polygon, the outer ring first; the last of each is the first again."""
    return [shapely.get_coordinates(ring).tolist() for ring in (polygon.exterior, *polygon.interiors)]


def _polygons(site: Site, area: BaseGeometry) -> tuple[shapely.Polygon, ...]:
    """Return the polygons of an area in plan as longitude and latitude."""

    def located_at(xy: Float) -> Float:
        places = site.geographic(np.column_stack([xy, np.zeros(len(xy))]))
        if places is None:
            raise ValueError(site.geo_reference.obstacle)
        return np.round(places[:, :2], DECIMALS)

    parts = [part for part in shapely.get_parts(area) if part.geom_type == "Polygon" and not part.is_empty]
    return tuple(shapely.orient_polygons(shapely.transform(part, located_at), exterior_cw=False) for part in parts)


def save_kml(path: str | os.PathLike[str], placed: Located) -> None:
    """Write a document with the sensors at their heights above the ground, and the rest on it."""
    root = ET.Element("kml", {"xmlns": NAMESPACE})
    document = _add(root, "Document")
    _add(document, "name", placed.site.name)
    if placed.site.attribution:
        _add(document, "description", escape("\n".join(placed.site.attribution), quote=False))  # shown as HTML
    for name, (line, fill, opacity) in KML_STYLES.items():
        style = _add(document, "Style", id=name)
        drawn = _add(style, "LineStyle")
        _add(drawn, "color", _kml_colour(line or fill, 0xFF if line else 0))
        _add(drawn, "width", "2")
        filled = _add(style, "PolyStyle")
        _add(filled, "color", _kml_colour(fill or line, opacity))
        _add(filled, "fill", str(int(bool(fill))))
    sensors, areas, coverage = (_add(document, "Folder") for _ in range(3))
    _add(sensors, "name", "Sensors")
    for sensor, (longitude, latitude, _) in zip(placed.deployment.sensors, placed.points.tolist(), strict=True):
        about = {
            "sensor": sensor.model.key,
            "position": sensor.position_name,
            "height_m": f"{sensor.height:.3f}",
            "yaw_deg": f"{degrees(sensor.yaw):.3f}",
            "tilt_deg": f"{tilt_degrees(sensor.tilt):.3f}",
            "price_usd": f"{sensor.price:.2f}",
        }
        words = escape(f"{sensor.model.name}, {sensor.height:.2f} m above the ground{sensor.turned}", quote=False)
        point = _add(_placemark(sensors, sensor.label, "description", words, about), "Point")
        _add(point, "extrude", "1")
        _add(point, "altitudeMode", "relativeToGround")
        _add(point, "coordinates", f"{longitude:.8f},{latitude:.8f},{sensor.height:.3f}")
    _add(areas, "name", "Areas")
    _area(areas, "Region of interest", "region", placed.region, {})
    for area, polygons in placed.weighted:
        _area(areas, area.name, "weighted", polygons, {"weight": f"{area.weight:g}"})
    _add(coverage, "name", "Coverage")
    for seers, polygons in placed.patches():
        title = f"Seen by {', '.join(seers)}" if seers else "Not seen"
        seen = ("unseen", "seen", "seen-twice")[min(len(seers), 2)]
        _area(coverage, title, seen, polygons, {"seen_by": " ".join(seers)})
    ET.indent(root)
    with whole_file(path) as temporary:
        ET.ElementTree(root).write(temporary, encoding="UTF-8", xml_declaration=True)


def _area(
    folder: ET.Element, name: str, style: str, polygons: Sequence[shapely.Polygon], data: Mapping[str, str]
) -> None:
    several = _add(_placemark(folder, name, "styleUrl", f"#{style}", data), "MultiGeometry")
    for polygon in polygons:
        element = _add(several, "Polygon")
        for number, ring in enumerate(_rings(polygon)):
            border = _add(element, "innerBoundaryIs" if number else "outerBoundaryIs")
            corners = " ".join(f"{longitude:.8f},{latitude:.8f}" for longitude, latitude in ring)
            _add(_add(border, "LinearRing"), "coordinates", corners)


def _placemark(folder: ET.Element, name: str, tag: str, text: str, data: Mapping[str, str]) -> ET.Element:
    """Return a new placemark with its name, one more text, and named values."""
    placemark = _add(folder, "Placemark")
    _add(placemark, "name", name)
    _add(placemark, tag, text)
    extended = _add(placemark, "ExtendedData")
    for key, value in data.items():
        _add(_add(extended, "Data", name=key), "value", value)
    return placemark


def _kml_colour(colour: str, opacity: int) -> str:
    """Return ``#rrggbb`` as KML has it: opacity, blue, green, red."""
    red, green, blue = colour[1:3], colour[3:5], colour[5:7]
    return f"{opacity:02x}{blue}{green}{red}".lower()


def _add(parent: ET.Element, tag: str, text: str = "", **attributes: str) -> ET.Element:
    element = ET.SubElement(parent, tag, attributes)
    element.text = _NO_XML.sub("\N{REPLACEMENT CHARACTER}", text)
    return element
