"""Which ways are streets, and what netconvert is told of them."""

import itertools

import pytest
from defusedxml.ElementTree import fromstring

from seip_addon.core.base.progress import finish
from seip_addon.core.world.openstreetmap.extract import read_extract, window
from seip_addon.core.world.openstreetmap.handedness import drives_on_the_left
from seip_addon.core.world.openstreetmap.streets import is_street, is_track, write_streets
from tests.builders.osm_text import Extract, dual_carriageway, roundabout


def streets(extract, tmp_path, **options):
    read = finish(read_extract(extract.write(tmp_path / "place.osm")))
    reach = options.pop("reach", 500.0)
    result = write_streets(
        read, tmp_path / "streets.osm", window(extract.latitude, extract.longitude, reach), **options
    )
    root = fromstring((tmp_path / "streets.osm").read_text(encoding="utf-8"))
    return result, [{tag.get("k"): tag.get("v") for tag in way.iter("tag")} for way in root.iter("way")], root


@pytest.mark.parametrize(
    ("tags", "street"),
    [
        ({"highway": "residential"}, True),
        ({"highway": "primary_link"}, True),
        ({"railway": "tram", "name": "Line 41"}, False),
        ({"highway": "service"}, False),
        ({"highway": "footway"}, False),
        ({"highway": "cycleway"}, False),
        ({"highway": "residential", "area": "yes"}, False),
        ({"highway": "primary", "tunnel": "yes"}, False),
        ({"highway": "primary", "tunnel": "building_passage"}, True),
        ({}, False),
    ],
)
def test_what_a_street_is(tags, street):
    assert is_street(tags) is street


@pytest.mark.parametrize(
    ("tags", "track"),
    [
        ({"railway": "tram"}, True),
        ({"railway": "light_rail"}, True),
        ({"railway": "light_rail", "tunnel": "yes"}, False),
        ({"railway": "rail"}, False),
        ({"railway": "subway"}, False),
        ({"highway": "residential"}, False),
    ],
)
def test_what_a_track_is(tags, track):
    assert is_track(tags) is track


@pytest.mark.parametrize(
    ("left_hand", "tags", "written"),
    [
        (False, {"lanes": 2, "width": 10, "cycleway": "lane"}, ("3.50|1.50|2.50", "3.50|1.50|2.50")),
        (True, {"lanes": 2, "width": 10, "cycleway": "lane"}, ("2.50|1.50|3.50", "2.50|1.50|3.50")),
        (True, {"oneway": "yes", "lanes": 2, "width:lanes": "3|5"}, ("2.50|3.00|5.00", "2.50")),
        (False, {"oneway": "yes", "oneway:bus": "no", "lanes": 3}, ("3.20|3.20|2.50", "3.20|2.50")),
        (False, {"oneway": "yes", "cycleway": "opposite_lane", "lanes": 1}, ("3.20|2.50", "1.50|2.50")),
    ],
)
def test_lane_widths_from_left_to_right_in_driving_direction(tmp_path, left_hand, tags, written):
    extract = Extract()
    extract.way([(-100, 0), (100, 0)], highway="residential", **tags)
    _, (found,), _ = streets(extract, tmp_path, left_hand=left_hand)
    forward = found.get("width:lanes:forward", found.get("width:lanes"))
    assert (forward, found["width:lanes:backward"]) == written


@pytest.mark.parametrize(
    ("cuts", "reverse", "lanes"),
    [
        ((0, 12), False, ["2 2"]),
        ((0, 12), True, ["2 2"]),
        ((0, 12, 20, 40), False, ["2 1", "2 2", "2 2"]),
        ((0, 60), False, ["1 1"]),
    ],
)
def test_short_pieces_without_lanes_have_those_of_the_wider_neighbour(tmp_path, cuts, reverse, lanes):
    extract = Extract()
    usual = {"highway": "primary", "name": "Long Street"}
    extract.way([(-100, 0), (0, 0)], lanes=3, lanes__forward=2, **usual)
    extract.way([(cuts[-1], 0), (200, 0)], turn__lanes__forward="left|", turn__lanes__backward="left|", **usual)
    for piece in itertools.pairwise([(x, 0) for x in cuts]):
        extract.way(piece[::-1] if reverse else piece, **usual)
    extract.way([(-100, 0), (-100, 10)], **usual)  # with lanes at one end only
    result, (_, _, *ways, alone), _ = streets(extract, tmp_path)
    assert [f"{way['lanes:forward']} {way['lanes:backward']}" for way in ways] == lanes
    assert len(result.widened) == len(ways) * (lanes != ["1 1"])
    assert alone["lanes"] == "2"


@pytest.mark.parametrize(
    ("tags", "side"),
    [
        ({}, "both"),
        ({"sidewalk": "no"}, "none"),
        ({"sidewalk": "left"}, "left"),
        ({"sidewalk": "separate"}, "both"),
        ({"sidewalk:both": "separate"}, "both"),
        ({"sidewalk:left": "no"}, "right"),
        ({"sidewalk:right": "separate", "sidewalk:left": "no"}, "right"),
        ({"highway": "motorway", "oneway": "yes"}, "none"),
        ({"highway": "secondary_link", "oneway": "yes"}, "right"),
    ],
)
def test_pavements_are_those_of_the_tags_or_usual_for_the_street(tmp_path, tags, side):
    extract = Extract()
    extract.way([(-100, 0), (100, 0)], **({"highway": "residential"} | tags))
    assert streets(extract, tmp_path)[1][0]["sidewalk"] == side


@pytest.mark.parametrize("backward", [False, True])
def test_a_dual_carriageway_has_pavements_at_its_outer_sides(tmp_path, backward):
    _, ways, _ = streets(dual_carriageway(backward=backward), tmp_path)
    assert [way["sidewalk"] for way in ways] == ["right", "right", "both"]


def test_no_pavement_on_a_refuge_between_the_lanes_of_a_street(tmp_path):
    extract = Extract()
    for points in ([(0, 0), (3, -4), (6, -4), (9, -4), (20, 0)], [(20, 0), (9, 4), (6, 4), (3, 4), (0, 0)]):
        extract.way(points, highway="secondary", oneway="yes", name="Split Street")
    assert [way["sidewalk"] for way in streets(extract, tmp_path)[1]] == ["right", "right"]


def test_a_roundabout_shows_the_side_and_stays_whole(tmp_path):
    result, ways, _ = streets(roundabout(), tmp_path)
    assert not result.left_hand
    assert "roundabouts" in result.notes[0]
    assert [len(nodes) for nodes in result.roundabouts] == [16]
    assert ways[0]["sidewalk"] == "right"


LEFT = [
    *(
        (51.5, -0.1),
        (53.3, -6.3),
        (35.7, 139.7),
        (-33.9, 151.2),
        (13.75, 100.5),
        (28.6, 77.2),
        (-1.3, 36.8),
        (-16.8, -179.99),
    ),
    *((22.3, 114.2), (-36.8, 174.8), (18.0, -76.8), (6.5, -58.2), (-26.2, 28.0), (1.3, 103.8), (34.9, 33.6)),
]
RIGHT = [
    *((52.5, 13.4), (40.7, -74.0), (48.86, 2.35), (25.05, 121.5), (39.9, 116.4), (37.57, 126.98), (22.54, 114.06)),
    *((14.6, 121.0), (21.0, 105.8), (50.85, 4.35), (11.55, 104.9), (16.8, 96.2), (9.0, 38.7), (-23.5, -46.6)),
    *((50.95, 1.86), (-8.8, 13.2), (-4.3, 15.3), (41.9, 12.5)),
]


@pytest.mark.parametrize(("place", "left"), [*((place, True) for place in LEFT), *((place, False) for place in RIGHT)])
def test_where_nothing_shows_the_side_the_country_does(tmp_path, place, left):
    extract = Extract(*place)
    extract.way([(0, 0), (10, 0)], highway="residential")
    assert drives_on_the_left(finish(read_extract(extract.write(tmp_path / "place.osm"))))[0] is left


def test_elevations_count_where_nearly_all_nodes_have_one(tmp_path):
    extract = Extract()
    extract.way([extract.node(0, 0, ele="50"), extract.node(100, 0, ele="56")], highway="residential")
    assert streets(extract, tmp_path)[0].elevated
    extract.way([(0, 50), (100, 50)], highway="residential")
    assert not streets(extract, tmp_path)[0].elevated
