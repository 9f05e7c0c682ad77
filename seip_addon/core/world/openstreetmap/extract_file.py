"""Writing of extracts of OpenStreetMap as XML."""

from __future__ import annotations

import xml.etree.ElementTree as ET  # writes XML, and reads none
from collections.abc import Iterator

from .extract import Extract, Tags

XML_CONTROL = {number: None for number in range(32) if number not in (9, 10, 13)}
"""Control characters, which XML cannot hold."""


def extract_xml(extract: Extract) -> bytes:
    """Return an extract as OpenStreetMap XML; the same elements give the same bytes, whatever their order.

    Elements are sorted by id. The credit of the data is kept as the holder of the rights and the date.
    """
    root = ET.Element("osm", {"version": "0.6", **_credit(extract.attribution)})
    for number, node in sorted(extract.nodes.items()):
        place = {"id": str(number), "lat": repr(node.latitude), "lon": repr(node.longitude)}
        ET.SubElement(root, "node", place).extend(_tags(node.tags))
    for number, way in sorted(extract.ways.items()):
        element = ET.SubElement(root, "way", {"id": str(number)})
        element.extend(ET.Element("nd", {"ref": str(node)}) for node in way.nodes)
        element.extend(_tags(way.tags))
    for number, relation in sorted(extract.relations.items()):
        element = ET.SubElement(root, "relation", {"id": str(number)})
        element.extend(
            ET.Element("member", {"type": kind, "ref": str(ref), "role": _text(role)})
            for kind, ref, role in relation.members
        )
        element.extend(_tags(relation.tags))
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True))


def _tags(tags: Tags) -> Iterator[ET.Element]:
    for key, value in sorted(tags.items()):
        yield ET.Element("tag", {"k": _text(key), "v": _text(value)})


def _credit(attribution: str) -> dict[str, str]:
    holder, _, date = attribution.partition(", data of ")
    credit = {"copyright": _text(holder.removeprefix("© ").removesuffix(" (ODbL)").partition(", changes up to ")[0])}
    return {**credit, "timestamp": date} if date else credit


def _text(text: str) -> str:
    return text.translate(XML_CONTROL)
