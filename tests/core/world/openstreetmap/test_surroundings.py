"""What stands beside the streets of an extract: footprints, heights, trees, posts and walls."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.geo_reference import projection
from seip_addon.core.world.openstreetmap.buildings import USUAL_HEIGHT
from seip_addon.core.world.openstreetmap.extract import read_extract
from seip_addon.core.world.openstreetmap.plan_shapes import DRAWN_TWICE, PIECES, PlanShapes
from seip_addon.core.world.openstreetmap.street_objects import surroundings
from tests.builders.osm_text import Extract

UTM = projection("+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs")
ORIGIN = np.array(UTM(math.radians(52.5), math.radians(13.4)))
EVERYWHERE = shapely.Point(0, 0).buffer(500)
ROAD = shapely.box(-200, -4, 200, 4)


def found(extract, tmp_path, area=EVERYWHERE):
    path = extract.write(tmp_path / "place.osm")
    shapes = PlanShapes(finish(read_extract(path)), UTM, ORIGIN)
    return surroundings(shapes, area, ROAD), shapes


def test_a_footprint_is_that_of_the_extract(tmp_path):
    extract = Extract()
    extract.house(10, 20, 30, 12, height="14")
    (building,), _ = [found(extract, tmp_path)[0].buildings, None]
    true = [
        ORIGIN * 0 + np.array(UTM(*map(math.radians, extract.place(x, y)))) - ORIGIN
        for x, y in ((10, 20), (40, 20), (40, 32), (10, 32))
    ]
    exact = shapely.Polygon(true)
    assert building.outline.symmetric_difference(exact).area < 0.01 * exact.area
    assert building.outline.area == pytest.approx(360, rel=0.01)
    assert (building.height, building.height_assumed, building.source) == (14, False, "extract")


@pytest.mark.parametrize(
    ("tags", "height", "base", "assumed"),
    [
        ({"height": "12 ft"}, 3.6576, 0, False),
        ({"building:levels": "4"}, 12, 0, False),
        ({"building:levels": "4", "roof:shape": "gabled", "roof:levels": "1"}, 15, 0, False),
        ({"building:levels": "3", "roof:shape": "hipped"}, 9 + 2.5, 0, False),
        ({"height": "10", "roof:shape": "gabled", "roof:height": "4"}, 10, 0, False),
        ({"height": "10", "min_height": "4"}, 6, 4, False),
        ({"building:levels": "5", "building:min_level": "1"}, 12, 3, False),
        ({"height": "-5"}, USUAL_HEIGHT, 0, True),
        ({"height": "1e9", "building:levels": "2"}, 6, 0, False),
        ({"height": "3;4"}, 4, 0, False),
        ({"building": "garage"}, 2.8, 0, True),
        ({"building": "roof", "height": "5"}, 0.4, 4.6, False),
        ({"height": "5", "roof:shape": "gabled", "roof:height": "50"}, 5, 0, False),
    ],
)
def test_heights_are_those_of_the_tags(tmp_path, tags, height, base, assumed):
    extract = Extract()
    extract.house(10, 20, 30, 12, **({"height": ""} | tags))
    (building,) = found(extract, tmp_path)[0].buildings
    got = (building.height, building.base, building.height_assumed)
    assert got == (pytest.approx(height), pytest.approx(base), assumed)


def test_the_rest_of_an_outline_stands_where_parts_do_not_fill_it(tmp_path):
    extract = Extract()
    extract.house(0, 20, 30, 10, height="10")
    extract.house(0, 20, 10, 10, building="no", building__part="yes", height="20")
    extract.house(20, 20, 10, 5, building="no", building__part="yes", min_height="10", height="40")  # on the roof
    extract.house(50, 20, 30, 10, height="7")
    extract.house(50, 20, 30, 10, building="no", building__part="yes", height="5", min_height="3")  # on posts
    solids = found(extract, tmp_path)[0].buildings
    assert {one.height: one.outline.area for one in solids} == {
        2: pytest.approx(300, rel=0.01),
        10: pytest.approx(200, rel=0.01),
        20: pytest.approx(100, rel=0.01),
        30: pytest.approx(50, rel=0.01),
    }


def test_buildings_and_parts_above_each_other_on_one_outline(tmp_path):
    extract = Extract()
    extract.house(0, 20, 30, 10, height="18")
    for tags in ({"height": "4"}, {"min_height": "4", "height": "18"}, {"min_height": "4", "height": "18"}):
        extract.house(0, 20, 30, 10, **({"building": "no", "building__part": "yes"} | tags))
    extract.house(50, 20, 30, 10, height="6")
    extract.house(50, 20, 30, 10, building__min_level="2", height="15")
    extract.house(50, 20, 30, 10, height="9")
    site, shapes = found(extract, tmp_path)
    assert sorted((round(one.base), round(one.base + one.height)) for one in site.buildings) == [
        (0, 4),
        (0, 6),
        (4, 18),
        (6, 15),
    ]
    assert shapes.dropped[DRAWN_TWICE] == 2


@pytest.mark.parametrize("tagged", ["relation", "outer way", "both"])
def test_a_relation_has_courtyards_and_its_ways_count_once(tmp_path, tagged):
    extract = Extract()
    tags = {"building": "yes", "height": "9"}
    whole = extract.area([(0, 20), (40, 20), (40, 60), (0, 60)], **(tags if tagged != "relation" else {}))
    inner = extract.area([(10, 30), (30, 30), (30, 50), (10, 50)])
    members = [("way", whole, "outer"), ("way", inner, "inner")]
    extract.relation(members, type="multipolygon", **(tags if tagged != "outer way" else {}))
    (building,) = found(extract, tmp_path)[0].buildings
    assert building.outline.area == pytest.approx(1200, rel=0.01)
    assert len(building.outline.interiors) == 1
    assert building.height == 9


def test_ways_are_joined_to_rings_in_either_direction(tmp_path):
    extract = Extract()
    lines = [[(0, 20), (40, 20), (40, 60)], [(0, 60), (20, 70), (40, 60)], [(0, 60), (0, 20)], [(70, 20), (80, 20)]]
    members = [("way", extract.way(line), "outer") for line in lines]
    extract.relation(members, type="multipolygon", building="yes")
    site, shapes = found(extract, tmp_path)
    assert site.buildings[0].outline.area == pytest.approx(40 * 40 + 40 * 10 / 2, rel=0.01)
    assert shapes.dropped[PIECES] == 1


def test_a_relation_that_the_extract_cuts_off_is_closed_by_a_straight_line(tmp_path):
    extract = Extract()
    ways = [extract.way(line) for line in ([(0, 20), (40, 20), (40, 60)], [(40, 60), (20, 70), 999_999, (0, 20)])]
    extract.relation([("way", way, "outer") for way in ways], type="multipolygon", building="yes")
    assert found(extract, tmp_path)[0].buildings[0].outline.area == pytest.approx(1400, rel=0.1)


@pytest.mark.parametrize(("kind", "width"), [("footway", 2.0), ("service", 3.5), ("cycleway", 2.0)])
def test_a_way_leads_through_a_building(tmp_path, kind, width):
    extract = Extract()
    extract.house(0, 20, 30, 10, height="12")
    extract.way([(15, 20), (15, 30)], highway=kind, tunnel="building_passage", layer="-1")
    site, _ = found(extract, tmp_path)
    assert sorted(round(one.base, 1) for one in site.buildings) == [0, 0, 4.5]
    (above,) = [one.outline for one in site.buildings if one.base]
    assert above.area == pytest.approx(10 * width, rel=0.01)
    assert [way.area.area for way in site.ways] == [pytest.approx(above.area, rel=0.5)]


def test_trees_lamps_posts_and_walls(tmp_path):
    extract = Extract()
    extract.node(10, 10, natural="tree", height="11", diameter_crown="5")
    extract.node(20, 10, natural="tree")
    extract.way([(0, 30), (80, 30)], natural="tree_row")
    extract.node(30, 6, highway="street_lamp")
    extract.node(31, 6, highway="street_lamp", support="wall")
    extract.node(40, 6, highway="traffic_signals")
    extract.node(40, 0, highway="traffic_signals")
    extract.node(50, 6, power="pole", height="9.5")
    extract.way([(0, 50), (30, 50), (30, 60)], barrier="wall", height="1.8")
    extract.way([(0, 70), (30, 70)], barrier="hedge")
    extract.way([(0, 80), (30, 80)], barrier="kerb")
    extract.area([(60, 60), (70, 60), (70, 70), (60, 70)], barrier="hedge", area="yes")
    site, _ = found(extract, tmp_path)
    assert [(tree.height, tree.crown_diameter, tree.height_assumed) for tree in site.trees[:2]] == [
        (11, 5, False),
        (8, 4.8, True),
    ]
    assert len(site.trees[2].positions) == 11
    assert site.trees[2].source == "assumed"
    assert len(site.street_lights) == len(site.signal_poles) == len(site.posts) == 1
    assert (site.posts[0].height, site.posts[0].height_assumed) == (9.5, False)
    assert [(wall.name, wall.height, wall.material) for wall in site.walls] == [
        ("Wall", 1.8, "wall"),
        ("Hedge", 1.5, "leaves"),
    ]
    assert [(slab.name, slab.top) for slab in site.slabs] == [("Hedge", 1.5)]


VALUES = ["yes", "no", "nan", "gabled", "hipped", "part", "roof", "wall", "tree", "3;4", "-5", "1e9", "∞"]
KEYS = [
    "building",
    "building:part",
    "height",
    "min_height",
    "building:levels",
    "roof:shape",
    "roof:height",
    "roof:direction",
    "natural",
    "barrier",
    "area",
    "width",
    "layer",
    "highway",
    "amenity",
    "diameter_crown",
    "building:min_level",
]
tag_sets = st.dictionaries(st.sampled_from(KEYS), st.sampled_from([*VALUES, "12 ft", ""]), max_size=6)
points = st.lists(st.tuples(st.integers(-60, 60), st.integers(-60, 60)), min_size=1, max_size=8)


@settings(max_examples=100)
@given(shapes=st.lists(st.tuples(points, tag_sets, st.booleans()), min_size=1, max_size=6))
def test_no_tags_and_shapes_break_the_reader(tmp_path_factory, shapes):
    extract = Extract()
    extract.node(0, 0)
    for corners, tags, closed in shapes:
        if len(corners) == 1:
            extract.node(*corners[0], **tags)
        elif closed:
            extract.area(corners, **tags)
        else:
            extract.way(corners, **tags)
    site, _ = found(extract, tmp_path_factory.mktemp("osm"))
    for building in site.buildings:
        assert building.outline.is_valid
        assert 0 < building.height < 1000
    for item in (*site.trees, *site.walls, *site.posts, *site.street_lights):
        assert 0 < item.height <= 80


def kept_off(extract, tmp_path, x, y):
    """Return the rules that keep a post off a place in metres."""
    return {
        one.rule
        for one in found(extract, tmp_path)[0].keep_off_areas
        if one.polygon.dwithin(shapely.Point(_plan(extract, x, y)), 0.01)
    }


def _plan(extract, x, y):
    return np.array(UTM(*map(math.radians, extract.place(x, y)))) - ORIGIN


def test_cycle_tracks_and_driveways_count_up_to_the_carriageway(tmp_path):
    extract = Extract()
    extract.way([(-100, 6), (100, 6)], highway="cycleway", width="1.6")
    extract.way([(20, 0), (20, 40)], highway="service", service="driveway")
    assert kept_off(extract, tmp_path, 0, 6.7) == {"cycle-tracks"}
    assert kept_off(extract, tmp_path, 0, 7.3) == set()
    assert kept_off(extract, tmp_path, 21, 8) == {"driveways"}
    assert kept_off(extract, tmp_path, 21, 4.5) == {"driveways"}
    assert kept_off(extract, tmp_path, 23, 8) == set()


def test_a_mapped_crossing_has_landings_wherever_it_ends(tmp_path):
    extract = Extract()
    extract.way([(0, -2), (0, 2)], highway="footway", footway="crossing")
    extract.way([(40, -9), (40, 9)], highway="footway", footway="crossing", width="6")
    for x, y, landing in ((0, 5, True), (1.9, -5.5, True), (2.3, 5, False), (0, 6.5, False), (42.5, 5, True)):
        assert kept_off(extract, tmp_path, x, y) == ({"landings"} if landing else set()), (x, y)


@pytest.mark.parametrize(
    ("tags", "private"),
    [
        ({"leisure": "garden"}, True),
        ({"leisure": "garden", "access": "public"}, False),
        ({"leisure": "garden", "garden__type": "community"}, False),
        ({"landuse": "grass", "access": "private"}, True),
        ({"landuse": "grass"}, False),
        ({"amenity": "parking"}, True),
        ({"amenity": "parking", "access": "yes"}, False),
        ({"leisure": "park"}, False),
        ({"building": "yes", "access": "private"}, False),
        ({"highway": "service", "area": "yes", "access": "private"}, False),
    ],
)
def test_gardens_and_areas_without_access_are_private(tmp_path, tags, private):
    extract = Extract()
    extract.area([(-20, 6), (20, 6), (20, 30), (-20, 30)], **tags)
    assert ("private" in kept_off(extract, tmp_path, 0, 8)) is private


def test_ground_behind_a_fence_is_private_and_a_pavement_behind_a_guard_rail_is_not(tmp_path):
    extract = Extract()
    extract.way([(-50, 6), (0, 6)], barrier="fence")
    extract.way([(10, 4.4), (50, 4.4)], barrier="fence")  # at the kerb
    extract.way([(-50, -6), (50, -6)], barrier="guard_rail")
    assert kept_off(extract, tmp_path, -20, 7) == {"private"}
    assert kept_off(extract, tmp_path, -20, 5.5) == set()
    assert kept_off(extract, tmp_path, 30, 6) == set()
    assert kept_off(extract, tmp_path, 0, -7) == set()
