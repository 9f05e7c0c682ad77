"""The maps of the shipped scenes fit together and hold what they promise."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely
from defusedxml.ElementTree import parse

from seip_addon.core.base.progress import finish
from seip_addon.core.programs.sumo_programs import find_sumo
from seip_addon.core.workflows.site_places import site_places
from seip_addon.core.world.opendrive.junctions import junction_area
from seip_addon.core.world.opendrive.lanes import LaneSurface, lane_surfaces
from seip_addon.core.world.opendrive.objects import PlacedObject
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.opendrive.road_map import RoadMap
from tests.builders.opendrive_text import map_lanes
from tests.sumo_here import needs_sumo

if TYPE_CHECKING:
    from collections.abc import Iterator
    from xml.etree.ElementTree import Element

    from shapely.geometry.base import BaseGeometry

SCENES = Path(__file__).resolve().parents[4] / "scenes"


@dataclass(frozen=True, eq=False)
class Shipped:
    """A shipped map, as XML and as the reader sees it."""

    path: Path
    root: Element
    road_map: RoadMap
    surfaces: tuple[LaneSurface, ...]
    objects: tuple[PlacedObject, ...]

    def union(self, *kinds: str) -> BaseGeometry:
        # Lanes of different roads meet to within rounding: hairline cracks are closed.
        lanes = [surface.polygon.buffer(1e-4) for surface in self.surfaces if surface.lane_type in kinds]
        return shapely.union_all(lanes)

    def outlines(self, kind: str) -> list[BaseGeometry]:
        return [
            shapely.Polygon(outline.base[:, :2])
            for placed in self.objects
            if placed.kind == kind
            for outline in placed.outlines
        ]


@pytest.fixture(scope="module", params=["corridor.xodr", "junction.xodr"])
def shipped(request: pytest.FixtureRequest) -> Shipped:
    return load(request.param)


def load(name: str) -> Shipped:
    path = SCENES / name
    road_map = read_map(path)
    return Shipped(path, parse(path).getroot(), road_map, map_lanes(road_map), road_map.objects)


def test_linked_lanes_meet_within_a_centimetre(shipped: Shipped) -> None:
    ends = lane_ends(shipped.surfaces)
    joints = list(lane_joints(shipped.root))
    assert len(joints) >= 40
    for first, second in joints:
        apart = np.abs(ends[first] - ends[second])
        swapped = np.abs(ends[first] - ends[second][::-1])
        # Edges go by the reference line, so roads that meet head to head swap left and right.
        assert min(apart.max(), swapped.max()) < 0.01, (first, second)


def lane_ends(surfaces: tuple[LaneSurface, ...]) -> dict[tuple[str, int, int, str], np.ndarray]:
    """Return the (2, 3) corners at both ends of every lane by road, section, lane and end."""
    ends = {}
    for surface in surfaces:
        for end, index in (("start", 0), ("end", -1)):
            key = (surface.road_id, surface.section, surface.lane_id, end)
            ends[key] = np.stack([surface.left[index], surface.right[index]])
    return ends


def lane_joints(root: Element) -> Iterator[tuple[tuple[str, int, int, str], tuple[str, int, int, str]]]:
    """Yield what the links of the file say belongs together."""
    last_section = {road.attrib["id"]: len(road.findall("lanes/laneSection")) - 1 for road in root.iter("road")}
    for road in root.iter("road"):
        name = road.attrib["id"]
        for number, section in enumerate(road.findall("lanes/laneSection")):
            for lane in section.iter("lane"):
                for link in lane.findall("link/*"):
                    end, step = ("start", -1) if link.tag == "predecessor" else ("end", 1)
                    own, other = (name, number, int(lane.attrib["id"]), end), int(link.attrib["id"])
                    if 0 <= number + step <= last_section[name]:
                        yield own, (name, number + step, other, "end" if end == "start" else "start")
                        continue
                    neighbour = road.find(f"link/{link.tag}")
                    assert neighbour is not None
                    assert neighbour.get("elementType") == "road"
                    contact = neighbour.attrib["contactPoint"]
                    section_there = 0 if contact == "start" else last_section[neighbour.attrib["elementId"]]
                    yield own, (neighbour.attrib["elementId"], section_there, other, contact)


def test_carriageway_is_one_piece_without_holes(shipped: Shipped) -> None:
    carriageway = shipped.union("driving", "parking")
    assert carriageway.geom_type == "Polygon"
    assert [shapely.Polygon(hole).area for hole in carriageway.interiors] == []


def test_every_approach_has_its_traffic_light_stop_line_and_crosswalk(shipped: Shipped) -> None:
    carriageway, pavement = shipped.union("driving", "parking"), shipped.union("sidewalk")
    signals = shipped.road_map.signals
    approaches = sum(neighbour.get("elementType") == "junction" for neighbour in shipped.root.iterfind("road/link/*"))
    for kind in ("roadmark", "crosswalk"):
        painted = shipped.outlines(kind)
        assert len(painted) == approaches
        for outline in painted:
            assert outline.difference(carriageway).area < 0.02
    assert len(signals) == approaches
    stop_lines = shapely.union_all(shipped.outlines("roadmark"))
    for signal in signals:
        post = shapely.Point(signal.position[:2])
        assert pavement.contains(post)
        assert carriageway.distance(post) == pytest.approx(0.6, abs=0.01)
        assert stop_lines.distance(post) == pytest.approx(0.6, abs=0.02)
        # The stop line lies well before the junction, behind the crosswalk.
        junctions = [junction_area(shipped.surfaces, junction.id) for junction in shipped.road_map.junctions]
        assert min(area.distance(post) for area in junctions) > 5.0


@needs_sumo
def test_sumo_imports_the_map(shipped: Shipped, tmp_path: Path) -> None:
    net = tmp_path / "map.net.xml"
    command = [
        str(find_sumo().netconvert),
        "--opendrive-files",
        str(shipped.path),
        "-o",
        str(net),
        "--offset.disable-normalization",
    ]
    subprocess.run(command, check=True, capture_output=True, timeout=60)  # noqa: S603  # the command is our own
    root = parse(net).getroot()
    assert {logic.get("id") for logic in root.iter("tlLogic")} == {item.id for item in shipped.road_map.junctions}
    signalled = sum(connection.get("tl") is not None for connection in root.iter("connection"))
    driving = sum(
        lane.get("type") == "driving"
        for road in shipped.root.iterfind("road")
        if road.get("junction") != "-1"
        for lane in road.iter("lane")
    )
    assert signalled == driving


def test_every_traffic_light_has_its_post(shipped: Shipped) -> None:
    posts = np.array([placed.position[:2] for placed in shipped.objects if placed.kind == "pole"])
    lights = np.array([signal.position[:2] for signal in shipped.road_map.signals])
    assert len(posts) == len(lights)
    for light in lights:
        assert np.hypot(*(posts - light).T).min() < 1e-6


@pytest.mark.parametrize("name", ["junction", "corridor"])
def test_dots_lie_on_the_junctions_and_lines_on_the_carriageway(name):
    places = finish(site_places(SCENES / f"{name}.xodr"))
    road_map = read_map(SCENES / f"{name}.xodr")
    lanes = [lane for road in road_map.roads for lane in lane_surfaces(road)]
    areas = [junction_area(lanes, place.key) for place in places.places]
    shift = road_map.roads[0].frame(np.zeros(1)).origin[0, :2] - places.plan.streets[0].line[0]
    for area, (x, y) in zip(areas, places.plan.junctions + shift, strict=True):
        assert area.contains(shapely.Point(x, y))
    road = shapely.union_all([lane.polygon for lane in lanes]).buffer(1.0)
    assert len(places.plan.streets) == len(road_map.roads)
    assert all(road.covers(shapely.LineString(street.line + shift)) for street in places.plan.streets)
    assert set(places.plan.names.names) == {road.name for road in road_map.roads if road.name and not road.junction_id}
    assert not any(f"junction{place.key}" in place.name.casefold() for place in places.places)
