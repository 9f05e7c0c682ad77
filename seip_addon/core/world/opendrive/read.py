"""Read an OpenDRIVE file into a `RoadMap`.

Written after ASAM OpenDRIVE 1.4 to 1.8; attributes that a file leaves out have the standard's defaults.
"""

import math
import os
from collections import Counter
from pathlib import Path

import numpy as np

from ...base import limits
from ...base.errors import SeipError
from ...storage.xml_stream import short
from .document import Node, read_document
from .profile import ZERO_PROFILE, Profile, lateral_shape, profile
from .read_objects import read_objects, read_signals
from .reference_line import Clothoid, Cubic, Piece, ReferenceLine, param_poly3, poly3
from .road_map import Junction, Lane, LaneSection, Road, RoadLink, RoadMap

_OTHER_FORMATS = {
    "osm": " as extracts of OpenStreetMap do (let its name end in .osm)",
    "net": " as networks of SUMO do (netconvert --opendrive-output makes a map of them)",
    "CityModel": " as CityGML does",
    "OpenSCENARIO": " as OpenSCENARIO does",
    "kml": " as KML does",
}
ATTRIBUTION = "attribution"
"""Code of the header's ``<userData>`` whose value is a credit."""

_MAX_ROAD_LENGTH = limits.ROAD_LENGTH.most
_MAX_TURN = 200.0 * math.pi  # radians within one geometry; a hundred turns
_MAX_STRETCH, _SLACK = 2.0, 10.0
"""Multiple of its length, and metres, from its start beyond which no point of a road lies unless a number is wrong."""


def read_map(path: str | os.PathLike[str]) -> RoadMap:
    """Read an OpenDRIVE file.

    Raises
    ------
    SeipError
        The file does not exist, is not well-formed or not safe XML, is not OpenDRIVE, has no roads, or has an
        implausible number; the message names the road and the element.
    """
    root = read_document(path)
    if root.tag != "OpenDRIVE":
        other = _OTHER_FORMATS.get(root.tag, "")
        raise SeipError(f"{root.place} is not OpenDRIVE: it begins with <{root.tag}>{other}; choose an .xodr file")
    nodes = [node.within(f"road {node.text('id')}") for node in root.children("road")]
    roads = tuple(map(_road, nodes))
    if not roads:
        raise SeipError(f"{root.place} has no roads; choose an OpenDRIVE map with at least one <road>")
    number, count = Counter(road.id for road in roads).most_common(1)[0]
    if count > 1:  # links, lanes and objects name roads by their ids
        raise SeipError(f"{root.place} has {count:,} roads with the id {short(number)}; export the map again")
    header = root.child("header")
    offset, reference = (header and header.child(name) for name in ("offset", "geoReference"))
    return RoadMap(
        name=(header.text("name", "") if header else "") or Path(path).stem,
        header_offset=np.array([offset.number(name, 0.0) for name in ("x", "y", "z", "hdg")])
        if offset
        else np.zeros(4),
        geo_reference=((reference.element.text or "").strip() or None) if reference else None,
        roads=roads,
        junctions=tuple(map(_junction, root.children("junction"))),
        objects=tuple(one for pair in zip(roads, nodes, strict=True) for one in read_objects(*pair)),
        signals=tuple(one for pair in zip(roads, nodes, strict=True) for one in read_signals(*pair)),
        attribution=tuple(
            node.text("value", "")
            for node in (header.children("userData") if header else ())
            if node.text("code", "") == ATTRIBUTION and node.text("value", "")
        ),
    )


def _junction(node: Node) -> Junction:
    kind = node.text("type", "")
    return Junction(node.text("id"), node.text("name", ""), kind if kind in ("direct", "virtual") else "")


def _road(node: Node) -> Road:
    line = _reference_line(node)
    junction = node.text("junction", "-1")
    return Road(
        id=node.text("id"),
        name=node.text("name", ""),
        junction_id=None if junction in ("-1", "") else junction,
        keeps_left=node.text("rule", "RHT").upper() == "LHT",
        reference_line=line,
        elevation=_profile(node, "elevationProfile", "elevation"),
        superelevation=_profile(node, "lateralProfile", "superelevation"),
        left_crossfall=_crossfall(node, "left"),
        right_crossfall=_crossfall(node, "right"),
        shape=lateral_shape(
            [(each.number("s"), each.number("t"), _cubic(each)) for each in node.children("lateralProfile", "shape")]
        ),
        lane_offset=_profile(node, "lanes", "laneOffset"),
        sections=_sections(node, line.end),
        predecessor=_link(node, "predecessor"),
        successor=_link(node, "successor"),
    )


def _link(road: Node, end: str) -> RoadLink | None:
    node = road.child("link", end)
    if node is None:
        return None
    return RoadLink(node.text("elementType", ""), node.text("elementId", ""), node.text("contactPoint", ""))


def _reference_line(road: Node) -> ReferenceLine:
    if road.text("length", ""):
        road.length("length")
    nodes = sorted(road.children("planView", "geometry"), key=lambda node: node.number("s"))
    if not nodes:
        raise SeipError(f"{road.place} has no <geometry> in its <planView>; correct or remove the road")
    line = ReferenceLine(
        s=np.array([node.number("s") for node in nodes]),
        length=np.array([node.length("length") for node in nodes]),
        start=np.array([[node.number(name) for name in ("x", "y", "hdg")] for node in nodes]),
        pieces=tuple(_piece(node) for node in nodes),
    )
    if line.end > _MAX_ROAD_LENGTH:
        raise SeipError(f"{road.place}: its <geometry> reaches {line.end:g} m, longer than any road; correct the map")
    away = np.hypot(*(line.start[:, :2] - line.start[0, :2]).T)
    wrong = np.flatnonzero(away > _MAX_STRETCH * (line.s - line.s[0]) + _SLACK)
    if len(wrong):
        s, metres = line.s[wrong[0]], away[wrong[0]]
        raise SeipError(
            f"{road.place}: its <geometry> at s={s:g} begins {metres:,.0f} m from the start of the road; correct its x "
            "and y in the map"
        )
    return line


def _piece(geometry: Node) -> Piece:
    length = geometry.length("length")
    for node in (Node(element, geometry.place) for element in geometry.element):
        match node.tag:
            case "line":
                return Clothoid(0.0, 0.0)
            case "arc":
                curvature = node.number("curvature")
                return _clothoid(node, curvature, curvature, length)
            case "spiral":
                return _clothoid(node, node.number("curvStart"), node.number("curvEnd"), length)
            case "poly3":
                coefficients = node.number("a"), node.number("b"), node.number("c"), node.number("d")
                return _within_reach(poly3(coefficients, length), node, length)
            case "paramPoly3":
                return _param_poly3(node, length)
    raise SeipError(
        f"{geometry.place}: a <geometry> at s={geometry.number('s'):g} holds no line, arc, spiral, poly3 or "
        "paramPoly3; correct the map"
    )


def _clothoid(node: Node, first: float, last: float, length: float) -> Clothoid:
    curve = Clothoid(first, (last - first) / length)
    if curve.turn(length) > _MAX_TURN:
        raise SeipError(
            f"{node.place}: a <{node.tag}> of {length:g} m turns more than a hundred times; correct its curvature"
        )
    return curve


def _param_poly3(node: Node, length: float) -> Piece:
    u, v = ((node.number(f"a{x}"), node.number(f"b{x}"), node.number(f"c{x}"), node.number(f"d{x}")) for x in "UV")
    # Without a pRange the standard takes p from 0 to 1.
    curve = param_poly3(u, v, length if node.text("pRange", "normalized") == "arcLength" else 1.0, length)
    if not (math.isfinite(curve.stretch) and curve.stretch > 0.0):
        raise SeipError(f"{node.place}: a <paramPoly3> has no extent; correct its coefficients")
    return _within_reach(curve, node, length)


def _within_reach(curve: Cubic, node: Node, length: float) -> Cubic:
    """Return a curve whose points lie within its length of its start.

    Raises
    ------
    SeipError
        They do not: a coefficient is wrong.
    """
    x, y, _ = curve(np.linspace(0.0, length, 65))
    away = float(np.hypot(x, y).max())
    if not away <= _MAX_STRETCH * length + _SLACK:
        raise SeipError(
            f"{node.place}: a <{node.tag}> of {length:g} m reaches {away:,.0f} m from its start; correct its "
            "coefficients"
        )
    return curve


def _profile(road: Node, *path: str) -> Profile:
    return profile([(node.number("s"), _cubic(node)) for node in road.children(*path)])


def _crossfall(road: Node, side: str) -> Profile:
    nodes = road.children("lateralProfile", "crossfall")
    return profile([(node.number("s"), _cubic(node)) for node in nodes if node.text("side", "both") in (side, "both")])


def _cubic(node: Node) -> tuple[float, float, float, float]:
    return node.number("a", 0.0), node.number("b", 0.0), node.number("c", 0.0), node.number("d", 0.0)


def _sections(road: Node, end: float) -> tuple[LaneSection, ...]:
    """Return the lane sections; a side missing from a one-sided section continues from the section before."""
    nodes = sorted(road.children("lanes", "laneSection"), key=lambda node: node.number("s"))
    starts = [max(node.number("s"), 0.0) for node in nodes]
    sections = []
    left: tuple[Lane, ...] = ()
    right: tuple[Lane, ...] = ()
    for node, start, stop in zip(nodes, starts, [*starts, end][1:], strict=True):
        one_sided = node.flag("singleSide")
        left = _side(node, "left", start) or (left if one_sided else ())
        right = _side(node, "right", start) or (right if one_sided else ())
        if start < min(stop, end):
            sections.append(LaneSection(start, min(stop, end), left, right))
    return tuple(sections)


def _side(section: Node, side: str, start: float) -> tuple[Lane, ...]:
    """Return the lanes of one side, from the centre outwards."""
    lanes = (_lane(node, start) for node in section.children(side, "lane"))
    return tuple(sorted(lanes, key=lambda lane: abs(lane.id)))


def _lane(node: Node, start: float) -> Lane:
    number = node.whole_number("id")
    node = node.within(f"lane {number}")
    return Lane(
        id=number,
        type=node.text("type", "none"),
        level=node.flag("level"),
        width=_lane_profile(node, "width", start),
        border=_lane_profile(node, "border", start),
        inner_height=_height(node, "inner", start),
        outer_height=_height(node, "outer", start),
    )


def _lane_profile(lane: Node, name: str, start: float) -> Profile:
    return profile([(start + node.number("sOffset", 0.0), _cubic(node)) for node in lane.children(name)])


def _height(lane: Node, edge: str, start: float) -> Profile:
    """Return the height of an edge, linear from each record to the next."""
    nodes = sorted(lane.children("height"), key=lambda node: node.number("sOffset", 0.0))
    if not nodes:
        return ZERO_PROFILE
    s = [start + node.number("sOffset", 0.0) for node in nodes]
    heights = [node.number(edge, 0.0) for node in nodes]
    rises = [
        (following - height) / (stop - begin) if stop > begin else 0.0
        for height, following, begin, stop in zip(heights, heights[1:], s, s[1:], strict=False)
    ]
    return profile([(at, (height, rise, 0.0, 0.0)) for at, height, rise in zip(s, heights, [*rises, 0.0], strict=True)])
