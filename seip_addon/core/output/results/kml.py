"""``placement.kml``: a placement for viewers that show a globe, as OGC KML 2.2 has it."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from html import escape
from xml.etree import ElementTree as ET

import shapely

from ...choosing.placement.deployment import Sensor
from ...storage.files import whole_file
from ..pictures.palette import SEEN_COLOURS, WEIGHTED
from .headings import degrees, tilt_degrees
from .located import Located, rings

NAMESPACE = "http://www.opengis.net/kml/2.2"
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 has no place for."""

STYLES = {
    "unseen": ("", SEEN_COLOURS[0], 0x90),
    "seen": ("", SEEN_COLOURS[1], 0x90),
    "seen-twice": ("", SEEN_COLOURS[2], 0x90),
    "region": ("#202020", "", 0),
    "weighted": (WEIGHTED, "", 0),
}
"""Line and fill of each style, ``#rrggbb`` or empty for none, and how opaque (0 to 255) the fill is."""


def save_kml(path: str | os.PathLike[str], placed: Located) -> None:
    """Write a document with the sensors at their heights above the ground, and the rest on it."""
    root = ET.Element("kml", {"xmlns": NAMESPACE})
    document = ET.SubElement(root, "Document")
    _text(document, "name", placed.site.name)
    if placed.site.attribution:
        _description(document, "\n".join(placed.site.attribution))
    for name, look in STYLES.items():
        _style(document, name, *look)
    sensors = _folder(document, "Sensors")
    for sensor, (longitude, latitude, _) in zip(placed.sensors, placed.points.tolist(), strict=True):
        _sensor(sensors, sensor, longitude, latitude)
    areas = _folder(document, "Areas")
    _area(areas, "Region of interest", "region", placed.region, {})
    for area, polygons in placed.weighted:
        _area(areas, area.name, "weighted", polygons, {"weight": f"{area.weight:g}"})
    coverage = _folder(document, "Coverage")
    for seers, polygons in placed.patches():
        style = ("unseen", "seen", "seen-twice")[min(len(seers), 2)]
        title = f"Seen by {', '.join(seers)}" if seers else "Not seen"
        _area(coverage, title, style, polygons, {"seen_by": " ".join(seers)})
    ET.indent(root)
    with whole_file(path) as temporary:
        ET.ElementTree(root).write(temporary, encoding="UTF-8", xml_declaration=True)


def _sensor(folder: ET.Element, sensor: Sensor, longitude: float, latitude: float) -> None:
    placemark = ET.SubElement(folder, "Placemark")
    _text(placemark, "name", sensor.label)
    _description(placemark, f"{sensor.model.name}, {sensor.height:.2f} m above the ground{sensor.turned}")
    data = {
        "sensor": sensor.model.key,
        "position": sensor.position_name,
        "height_m": f"{sensor.height:.3f}",
        "yaw_deg": f"{degrees(sensor.yaw):.3f}",
        "tilt_deg": f"{tilt_degrees(sensor.tilt):.3f}",
        "price_usd": f"{sensor.price:.2f}",
    }
    _data(placemark, data)
    point = ET.SubElement(placemark, "Point")
    _text(point, "extrude", "1")
    _text(point, "altitudeMode", "relativeToGround")
    _text(point, "coordinates", f"{longitude:.8f},{latitude:.8f},{sensor.height:.3f}")


def _area(
    folder: ET.Element, name: str, style: str, polygons: Sequence[shapely.Polygon], data: Mapping[str, str]
) -> None:
    placemark = ET.SubElement(folder, "Placemark")
    _text(placemark, "name", name)
    _text(placemark, "styleUrl", f"#{style}")
    _data(placemark, data)
    several = ET.SubElement(placemark, "MultiGeometry")
    for polygon in polygons:
        element = ET.SubElement(several, "Polygon")
        for number, ring in enumerate(rings(polygon)):
            border = ET.SubElement(element, "innerBoundaryIs" if number else "outerBoundaryIs")
            corners = " ".join(f"{longitude:.8f},{latitude:.8f}" for longitude, latitude in ring)
            _text(ET.SubElement(border, "LinearRing"), "coordinates", corners)


def _style(document: ET.Element, name: str, line: str, fill: str, opacity: int) -> None:
    style = ET.SubElement(document, "Style", {"id": name})
    drawn = ET.SubElement(style, "LineStyle")
    _text(drawn, "color", _colour(line or fill, 0xFF if line else 0))
    _text(drawn, "width", "2")
    filled = ET.SubElement(style, "PolyStyle")
    _text(filled, "color", _colour(fill or line, opacity))
    _text(filled, "fill", str(int(bool(fill))))


def _colour(colour: str, opacity: int) -> str:
    """Return ``#rrggbb`` as KML has it: opacity, blue, green, red."""
    red, green, blue = colour[1:3], colour[3:5], colour[5:7]
    return f"{opacity:02x}{blue}{green}{red}".lower()


def _folder(document: ET.Element, name: str) -> ET.Element:
    folder = ET.SubElement(document, "Folder")
    _text(folder, "name", name)
    return folder


def _data(placemark: ET.Element, values: Mapping[str, str]) -> None:
    extended = ET.SubElement(placemark, "ExtendedData")
    for name, value in values.items():
        _text(ET.SubElement(extended, "Data", {"name": name}), "value", value)


def _description(parent: ET.Element, text: str) -> None:
    """Add a text that viewers show as HTML."""
    _text(parent, "description", escape(text, quote=False))


def _text(parent: ET.Element, tag: str, text: str) -> None:
    ET.SubElement(parent, tag).text = _NO_XML.sub("�", text)
