"""Street plans written as an OpenStreetMap extract and an elevation model, the inputs of the site builder."""

import math
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from PIL import Image, TiffImagePlugin

from seip_addon.core.base.arrays import Float
from seip_addon.core.storage.files import whole_file

from .street_plan import TURN_LANE_LENGTH, Arm, StreetPlan, Tags

LATITUDE, LONGITUDE = 54.2, 3.0
"""Middle of every plan, degrees: in the North Sea, without real streets, and on the central meridian of UTM zone 31."""
TERRAIN_REACH, TERRAIN_STEP = 420.0, 2.0  # metres from the middle, and between samples
EARTH_RADIUS = 6_371_000.0  # metres
_SCALE, _TIE_POINT, _KEYS = 33550, 33922, 34735  # GeoTIFF's tags
_WGS84 = 4326
_STRAIGHT_ENTRY = 15.0  # metres that a street runs straight into a roundabout


def write_extract(path: Path, plan: StreetPlan) -> None:
    """Write the plan as an extract."""
    text = _Extract()
    _add_streets(text, plan)
    for thing in plan.things:
        if len(thing.corners) == 1:
            text.node(thing.corners[0], thing.tags)
        else:
            nodes = [text.node(corner) for corner in thing.corners]
            text.way([*nodes, nodes[0]] if thing.closed else nodes, thing.tags)
    with whole_file(path) as temporary:
        temporary.write_text(text.as_xml(), encoding="utf-8")


def write_terrain(path: Path, plan: StreetPlan) -> None:
    """Write the ground of the plan as GeoTIFF in WGS 84."""
    offsets = np.arange(-TERRAIN_REACH, TERRAIN_REACH + TERRAIN_STEP / 2, TERRAIN_STEP)
    x, y = np.meshgrid(offsets, offsets[::-1])
    heights = plan.height(np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)
    east, north = _degrees(np.array([TERRAIN_STEP, TERRAIN_STEP]))
    west, top = _degrees(np.array([-TERRAIN_REACH, TERRAIN_REACH]))
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags.tagtype[_SCALE] = tags.tagtype[_TIE_POINT] = 12  # double
    tags.tagtype[_KEYS] = 3  # short
    tags[_SCALE] = (east, north, 0.0)
    tags[_TIE_POINT] = (0.0, 0.0, 0.0, LONGITUDE + west, LATITUDE + top, 0.0)
    tags[_KEYS] = (1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 2, 2048, 0, 1, _WGS84)  # geographic, pixels are points
    with whole_file(path) as temporary:
        Image.fromarray(heights.astype(np.float32)).save(temporary, format="TIFF", tiffinfo=tags)


def _degrees(place: Float) -> tuple[float, float]:
    """Convert metres east and north of the middle to degrees of longitude and latitude."""
    degree = math.radians(1.0) * EARTH_RADIUS
    return float(place[0]) / (degree * math.cos(math.radians(LATITUDE))), float(place[1]) / degree


class _Extract:
    """Nodes and ways of an extract that is being written."""

    def __init__(self) -> None:
        self._nodes: list[str] = []
        self._ways: list[str] = []

    def node(self, place: Float, tags: Tags | None = None) -> int:
        number = len(self._nodes) + 1
        east, north = _degrees(place)
        body = "".join(_tag_lines(tags or {}))
        latitude, longitude = LATITUDE + north, LONGITUDE + east
        self._nodes.append(f'<node id="{number}" lat="{latitude:.8f}" lon="{longitude:.8f}">{body}</node>')
        return number

    def way(self, nodes: list[int], tags: Tags) -> None:
        body = "".join([*(f'<nd ref="{node}"/>' for node in nodes), *_tag_lines(tags)])
        self._ways.append(f'<way id="{len(self._ways) + 1}">{body}</way>')

    def as_xml(self) -> str:
        head = [
            '<?xml version="1.0" encoding="UTF-8"?>',
            '<osm version="0.6" generator="SEIP training sites" copyright="SEIP for Blender">',
        ]
        return "\n".join([*head, *self._nodes, *self._ways, "</osm>", ""])


def _tag_lines(tags: Tags) -> list[str]:
    return [f"<tag k={quoteattr(key)} v={quoteattr(value)}/>" for key, value in tags.items()]


def _add_streets(text: _Extract, plan: StreetPlan) -> None:
    if plan.roundabout is None:
        middle = text.node(np.zeros(2), {"highway": "traffic_signals"} if plan.signals else {})
        begins = {id(arm): middle for arm in plan.arms}
    else:
        begins = _add_roundabout(text, plan, plan.roundabout)
    for arm in plan.arms:
        first = 1.0 if plan.roundabout is None else plan.roundabout + _STRAIGHT_ENTRY
        along = np.hypot(*arm.line.T)
        nodes = [begins[id(arm)], *(text.node(place) for place in arm.line[along > first])]
        along = np.concatenate([[0.0], along[along > first]])
        near = int(np.searchsorted(along, TURN_LANE_LENGTH)) if arm.turn_lane else 0
        if near:
            text.way(nodes[: near + 1], _street_tags(arm, turning=True, left_hand=plan.left_hand))
        text.way(nodes[near:], _street_tags(arm, turning=False, left_hand=plan.left_hand))


def _add_roundabout(text: _Extract, plan: StreetPlan, radius: float) -> dict[int, int]:
    """Add the ring of a roundabout; return the first node of each arm."""
    arms = {arm.angle % math.tau: arm for arm in plan.arms}
    ends = sorted(arms)
    places = [
        (begin + share * ((end - begin) % math.tau), arms[begin] if share == 0.0 else None)
        for begin, end in zip(ends, [*ends[1:], ends[0]], strict=True)
        for share in (0.0, 0.25, 0.5, 0.75)
    ]
    nodes = [text.node(radius * np.array([math.cos(angle), math.sin(angle)])) for angle, _ in places]
    circle = [*nodes, nodes[0]]
    tags = {"highway": "secondary", "junction": "roundabout", "lanes": "1", "width": "5.5", "oneway": "yes"}
    text.way(circle[::-1] if plan.left_hand else circle, tags)
    return {id(arm): node for node, (_, arm) in zip(nodes, places, strict=True) if arm is not None}


def _street_tags(arm: Arm, *, turning: bool, left_hand: bool) -> dict[str, str]:
    inwards = arm.lanes_in + turning
    outwards = [f"{arm.lane_width}"] * arm.lanes_out  # from left to right
    if arm.kerb_lane:
        outwards.insert(0 if left_hand else len(outwards), f"{arm.kerb_lane}")
    tags = {
        "highway": arm.kind,
        "name": arm.name,
        "lanes": str(inwards + len(outwards)),
        "lanes:forward": str(len(outwards)),
        "lanes:backward": str(inwards),
        "width:lanes:forward": "|".join(outwards),
        "width:lanes:backward": "|".join([f"{arm.lane_width}"] * inwards),
        "sidewalk": "both",
        "maxspeed": "50",
    }
    if turning:
        other = ["through;right"] * (inwards - 1) if not left_hand else ["through;left"] * (inwards - 1)
        tags["turn:lanes:backward"] = "|".join([*other, "right"] if left_hand else ["left", *other])
    if arm.cycle_lanes:
        tags["cycleway:both"] = "lane"
    return tags
