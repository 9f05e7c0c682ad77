"""The maps of the shipped scenes fit together and hold what they promise."""

from __future__ import annotations

import subprocess
import tomllib
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely
from defusedxml.ElementTree import parse

from seip_addon.core.sumo_programs import find_sumo
from seip_addon.core.world.opendrive.junctions import junction_area
from seip_addon.core.world.opendrive.lanes import LaneSurface
from seip_addon.core.world.opendrive.objects import PlacedObject, placed_objects
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.opendrive.road_map import RoadMap
from seip_addon.core.world.opendrive.signals import placed_signals
from tests.builders.opendrive_text import map_lanes
from tests.sumo_here import needs_sumo

if TYPE_CHECKING:
    from collections.abc import Iterator
    from xml.etree.ElementTree import Element

    from shapely.geometry.base import BaseGeometry

SCENES = Path(__file__).parents[4] / "scenes"
KERB = 0.12


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


@pytest.fixture(scope="module")
def junction() -> Shipped:
    return load("junction.xodr")


@pytest.fixture(scope="module")
def corridor() -> Shipped:
    return load("corridor.xodr")


@pytest.fixture(scope="module")
def junction_site() -> dict[str, Any]:
    return tomllib.loads((SCENES / "junction.toml").read_text(encoding="utf-8"))


def load(name: str) -> Shipped:
    path = SCENES / name
    road_map = read_map(path)
    return Shipped(path, parse(path).getroot(), road_map, map_lanes(road_map), placed_objects(road_map))


# --- Both maps ---------------------------------------------------------------------------------------------------


def test_map_is_small(shipped: Shipped) -> None:
    assert shipped.path.stat().st_size < 300_000


def test_ids_are_unique(shipped: Shipped) -> None:
    for path in ("road", "junction", "controller", "road/objects/object", "road/signals/signal"):
        ids = [element.get("id") for element in shipped.root.iterfind(path)]
        assert len(ids) == len(set(ids)), path


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


def test_reference_lines_run_on_smoothly(shipped: Shipped) -> None:
    for road in shipped.road_map.roads:
        starts = geometry_starts(shipped.root, road.id)
        before, after = (np.stack(road.reference_line(starts + step)) for step in (-1e-7, 1e-7))
        np.testing.assert_allclose(before, after, atol=1e-6)


def geometry_starts(root: Element, road: str) -> np.ndarray:
    """Return the stations where one geometry of a road hands over to the next, metres."""
    geometries = root.findall(f"road[@id='{road}']/planView/geometry")
    return np.array([float(geometry.attrib["s"]) for geometry in geometries[1:]])


def test_junction_connections_agree_with_the_lanes_links(shipped: Shipped) -> None:
    roads = {road.attrib["id"]: road for road in shipped.root.iter("road")}
    for junction in shipped.root.iter("junction"):
        connecting = [road for road in roads.values() if road.get("junction") == junction.get("id")]
        connections = junction.findall("connection")
        assert {road.attrib["id"] for road in connecting} == {item.attrib["connectingRoad"] for item in connections}
        for connection in connections:
            road = roads[connection.attrib["connectingRoad"]]
            predecessor = road.find("link/predecessor")
            assert predecessor is not None
            assert predecessor.get("elementId") == connection.get("incomingRoad")
            by_lanes = {
                (link.attrib["id"], lane.attrib["id"])
                for lane in road.iter("lane")
                for link in lane.findall("link/predecessor")
            }
            assert by_lanes == {(link.attrib["from"], link.attrib["to"]) for link in connection.iter("laneLink")}


def test_roads_lead_to_the_junction_that_they_come_from(shipped: Shipped) -> None:
    arms = defaultdict(set)
    for road in shipped.root.iter("road"):
        for link, contact in (("predecessor", "start"), ("successor", "end")):
            neighbour = road.find(f"link/{link}")
            if neighbour is not None and neighbour.get("elementType") == "junction":
                arms[neighbour.get("elementId")].add((road.get("id"), contact))
    for junction in shipped.root.iter("junction"):
        roads = [road for road in shipped.root.iter("road") if road.get("junction") == junction.get("id")]
        ends = {(link.get("elementId"), link.get("contactPoint")) for road in roads for link in road.findall("link/*")}
        assert ends == arms[junction.get("id")]


def test_every_arm_leads_to_every_other_arm(shipped: Shipped) -> None:
    for junction in shipped.root.iter("junction"):
        ways = set()
        for connection in junction.iter("connection"):
            road = shipped.root.find(f"road[@id='{connection.get('connectingRoad')}']")
            assert road is not None
            ways.add(tuple(link.get("elementId") for link in road.findall("link/*")))
        arms = {arm for way in ways for arm in way}
        assert ways == {(first, last) for first in arms for last in arms if first != last}


def test_carriageway_is_one_piece_without_holes(shipped: Shipped) -> None:
    carriageway = shipped.union("driving", "parking")
    assert carriageway.geom_type == "Polygon"
    assert [shapely.Polygon(hole).area for hole in carriageway.interiors] == []


def test_pavements_do_not_lie_on_the_carriageway(shipped: Shipped) -> None:
    lanes = [surface.polygon for surface in shipped.surfaces if surface.lane_type != "sidewalk"]
    pavements = [surface.polygon for surface in shipped.surfaces if surface.lane_type == "sidewalk"]
    assert shapely.union_all(lanes).intersection(shapely.union_all(pavements)).area < 0.01
    assert sum(pavement.area for pavement in pavements) - shapely.union_all(pavements).area < 0.01


@pytest.mark.parametrize(("name", "pieces"), [("junction.xodr", 4), ("corridor.xodr", 7)])
def test_pavements_close_round_the_corners(name: str, pieces: int) -> None:
    # A street's two pavements run on round the corners: one piece per quarter of a crossing.
    assert len(load(name).union("sidewalk").geoms) == pieces


def test_pavements_are_raised_by_the_kerb(shipped: Shipped) -> None:
    lanes = {(lane.road_id, lane.section, lane.lane_id): lane for lane in shipped.surfaces}
    for (road, section, number), lane in lanes.items():
        if lane.lane_type == "sidewalk":
            beside = lanes[road, section, number - 1 if number > 0 else number + 1]
            pavement, carriageway = (lane.right, beside.left) if number > 0 else (lane.left, beside.right)
            np.testing.assert_allclose(pavement[[0, -1], 2] - carriageway[[0, -1], 2], KERB, atol=1e-9)


def test_junctions_are_level(shipped: Shipped) -> None:
    for junction in shipped.road_map.junctions:
        heights = np.concatenate(
            [lane.left[:, 2] for lane in shipped.surfaces if lane.junction_id == junction.id and lane.lane_id == -1]
        )
        assert np.ptp(heights) < 1e-9


def test_every_approach_has_its_traffic_light_stop_line_and_crosswalk(shipped: Shipped) -> None:
    carriageway, pavement = shipped.union("driving", "parking"), shipped.union("sidewalk")
    signals = placed_signals(shipped.road_map)
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
        assert signal.dynamic
        assert signal.kind == "1000001"
        assert pavement.contains(post)
        assert carriageway.distance(post) == pytest.approx(0.6, abs=0.01)
        assert stop_lines.distance(post) == pytest.approx(0.6, abs=0.02)
        # The stop line lies well before the junction, behind the crosswalk.
        junctions = [junction_area(shipped.surfaces, junction.id) for junction in shipped.road_map.junctions]
        assert min(area.distance(post) for area in junctions) > 5.0


def test_every_traffic_light_belongs_to_one_group_of_its_junction(shipped: Shipped) -> None:
    controlled = [control.get("signalId") for control in shipped.root.iterfind("controller/control")]
    assert sorted(controlled) == sorted(signal.get("id") for signal in shipped.root.iter("signal"))
    groups = [controller.get("id") for controller in shipped.root.iterfind("junction/controller")]
    assert sorted(groups) == sorted(controller.get("id") for controller in shipped.root.iterfind("controller"))


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


# --- The four-arm junction ---------------------------------------------------------------------------------------


def test_junction_has_four_arms_of_two_and_two_lanes(junction: Shipped) -> None:
    arms = [road for road in junction.road_map.roads if road.junction_id is None]
    assert len(arms) == 4
    for arm in arms:
        assert arm.length >= 80.0
        for side in (arm.sections[0].left, arm.sections[0].right):
            assert [lane.type for lane in side] == ["driving", "driving", "sidewalk"]
            widths = [float(lane.width(np.array([40.0]))[0]) for lane in side]
            assert widths[:2] == [3.5, 3.5]
            assert 2.0 <= widths[2] <= 4.0


def test_junction_lanes_turn_from_where_they_should(junction: Shipped) -> None:
    driving = Counter(
        len(road.findall("lanes/laneSection/right/lane[@type='driving']"))
        for road in junction.root.iterfind("road[@junction='100']")
    )
    assert driving == {2: 4, 1: 8}  # straight on over two lanes; right and left turns over one


def test_junction_is_no_toy(junction: Shipped) -> None:
    shapes = {element.tag for element in junction.root.iterfind("road/planView/geometry/*")}
    assert shapes == {"line", "spiral", "arc", "paramPoly3"}
    headings = {road.name: road.reference_line(np.array([0.0]))[2][0] for road in junction.road_map.roads[:4]}
    assert np.degrees(headings["North Street"] - headings["East Street"]) == pytest.approx(83.0)
    west = next(road for road in junction.road_map.roads if road.name == "West Street")
    assert west.elevation.slope(np.array([100.0]))[0] == pytest.approx(0.015)


def test_region_of_interest_takes_in_80_m_of_every_arm(junction: Shipped, junction_site: dict[str, Any]) -> None:
    region = shapely.Point(junction_site["near"]).buffer(junction_site["radius"], quad_segs=64)
    for road in junction.road_map.roads[:4]:
        assert region.contains(shapely.Point(road.place(np.array([79.9]), np.array([0.0]))[0, :2]))


def test_what_the_site_description_places_is_off_the_carriageway(
    junction: Shipped, junction_site: dict[str, Any]
) -> None:
    assert junction_site["map"] == "junction.xodr"
    carriageway, pavement = junction.union("driving"), junction.union("sidewalk")
    buildings = [shapely.Polygon(building["outline"]) for building in junction_site["building"]]
    walls = [shapely.LineString(wall["line"]).buffer(wall["thickness"] / 2.0) for wall in junction_site["wall"]]
    for number, solid in enumerate([*buildings, *walls]):
        assert not solid.intersects(carriageway)
        assert not solid.intersects(pavement)
        assert not any(solid.intersects(other) for other in buildings[:number] if other is not solid)
    houses = shapely.union_all(buildings)
    for kind, clearance in (("tree", 0.8), ("street_light", 0.3)):
        for point in positions(junction_site[kind]):
            assert carriageway.distance(point) > clearance
            assert houses.distance(point) > clearance


def test_all_four_corners_are_built_up_with_gaps(junction_site: dict[str, Any]) -> None:
    corners = Counter()
    for building in junction_site["building"]:
        x, y = shapely.Polygon(building["outline"]).centroid.coords[0]
        corners[x > 0, y > 0] += 1
    assert len(corners) == 4
    assert min(corners.values()) >= 5
    # Along each street there are gaps to look through.
    buildings = shapely.union_all([shapely.Polygon(building["outline"]) for building in junction_site["building"]])
    assert len(buildings.geoms) == sum(corners.values())


def positions(rows: list[dict[str, Any]]) -> Iterator[shapely.Point]:
    for row in rows:
        if "position" in row:
            yield shapely.Point(row["position"])
        else:
            line = shapely.LineString([row["from"], row["to"]])
            for distance in np.arange(0.0, line.length + 1e-9, row["spacing"]):
                yield line.interpolate(distance)


# --- The corridor ------------------------------------------------------------------------------------------------


def test_corridor_has_three_signalised_junctions_one_of_them_a_t(corridor: Shipped) -> None:
    arms = Counter()
    for item in corridor.root.iter("junction"):
        assert item.find("controller") is not None
        arms[len({connection.get("incomingRoad") for connection in item.iter("connection")})] += 1
    assert arms == {4: 2, 3: 1}


def test_corridor_is_an_arterial_of_600_to_700_m(corridor: Shipped) -> None:
    arterial = [surface.polygon for surface in corridor.surfaces if surface.road_id in {"1", "2", "3", "4"}]
    west, _, east, _ = shapely.union_all(arterial).bounds
    assert 600.0 < east - west < 700.0


def test_corridor_has_parking_lanes(corridor: Shipped) -> None:
    parking = [surface for surface in corridor.surfaces if surface.lane_type == "parking"]
    assert {surface.road_id for surface in parking} == {"2", "3"}
    assert {surface.lane_id > 0 for surface in parking} == {True, False}
    for surface in parking:
        width = np.linalg.norm(surface.left - surface.right, axis=1)
        assert width.max() == pytest.approx(2.2, abs=1e-6)
        assert width[[0, -1]] == pytest.approx(0.0, abs=1e-6)  # the kerb closes at both ends


def test_corridor_is_furnished_by_the_objects_of_the_map(corridor: Shipped) -> None:
    counts = Counter(placed.kind for placed in corridor.objects)
    assert counts["building"] >= 50
    assert counts["tree"] >= 60
    assert counts["streetlamp"] >= 40
    assert counts["obstacle"] == 2
    assert counts["barrier"] == 3
    assert {element.tag for element in corridor.root.iterfind(".//outline/*")} == {"cornerLocal", "cornerRoad"}


def test_what_the_corridor_places_is_off_the_carriageway(corridor: Shipped) -> None:
    carriageway, pavement = corridor.union("driving", "parking"), corridor.union("sidewalk")
    buildings = corridor.outlines("building")
    for number, building in enumerate(buildings):
        assert building.is_valid
        assert not building.intersects(carriageway)
        assert not building.intersects(pavement)
        assert not any(building.intersects(other) for other in buildings[:number])
    for placed in corridor.objects:
        if placed.kind in {"tree", "streetlamp", "obstacle"}:
            point = shapely.Point(placed.position[:2])
            assert pavement.contains(point), placed.name
            assert carriageway.distance(point) > 0.5, placed.name


def test_buildings_are_level(corridor: Shipped) -> None:
    outlines = [outline for placed in corridor.objects if placed.kind == "building" for outline in placed.outlines]
    assert len(outlines) >= 50
    for outline in outlines:
        assert np.ptp(outline.base[:, 2]) < 1e-6
        assert np.ptp(outline.height) == 0.0


def test_corridor_site_names_junctions_and_a_region_around_them(corridor: Shipped) -> None:
    site = tomllib.loads((SCENES / "corridor.toml").read_text(encoding="utf-8"))
    assert site["map"] == "corridor.xodr"
    region = shapely.Polygon(site["region"])
    assert region.is_valid
    names = [item["junction"] for item in site["weighted_region"]]
    assert names == [item.id for item in corridor.road_map.junctions]
    for name in names:
        assert region.contains(junction_area(corridor.surfaces, name))


def test_every_traffic_light_has_its_post(shipped: Shipped) -> None:
    posts = np.array([placed.position[:2] for placed in shipped.objects if placed.kind == "pole"])
    lights = np.array([signal.position[:2] for signal in placed_signals(shipped.road_map) if signal.dynamic])
    assert len(posts) == len(lights)
    for light in lights:
        assert np.hypot(*(posts - light).T).min() < 1e-6
