"""Crossings by the names of their streets, and places as people type them."""

from pathlib import Path

import numpy as np
import pytest
import shapely

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.tangent_plane import plan_metres
from seip_addon.core.workflows.network_sites import extract_xml
from seip_addon.core.workflows.site_places import site_places
from seip_addon.core.world.openstreetmap import extract as reading
from seip_addon.core.world.openstreetmap.crossings import SAME_JUNCTION, named_crossings, selected_junctions
from seip_addon.core.world.openstreetmap.extract import cropped, read_extract, window
from seip_addon.core.world.openstreetmap.map_links import parsed_position
from tests.builders.osm_text import JUNCTIONS, Extract, crossing

SCENES = Path(__file__).resolve().parents[4] / "scenes"


def crossings(extract, tmp_path):
    return named_crossings(finish(read_extract(extract.write(tmp_path / "place.osm"))))


@pytest.mark.parametrize("name", JUNCTIONS)
def test_each_kind_of_junction_is_one_crossing_in_its_middle(name, tmp_path):
    extract = JUNCTIONS[name]()
    (found,) = crossings(extract, tmp_path)
    assert (found.latitude, found.longitude) == pytest.approx((extract.latitude, extract.longitude), abs=1e-5)
    assert len(found.streets) >= 2
    assert list(found.streets) == sorted(found.streets)


def test_streets_that_meet_twice_have_two_crossings(tmp_path):
    extract = crossing()
    extract.way([(0, 200), (150, 200), (150, 0)], highway="residential", name="North Road")
    extract.way([(100, -50), (150, 0), (200, 50)], highway="service", name="Drive")
    extract.way([(150, 0), (150, 0.5)], highway="residential")
    east = extract.node(150, 0)
    extract.way([(120, 0), east, (180, 0)], highway="residential", name="East Road")
    found = crossings(extract, tmp_path)
    assert [one.name for one in found] == ["East Road / North Road"] * 2
    places = finish(site_places(tmp_path / "place.osm")).places
    assert [place.name for place in places] == ["East Road / North Road", "East Road / North Road (2)"]
    assert [parsed_position(place.key) for place in places] == [
        pytest.approx((one.latitude, one.longitude), abs=1e-7) for one in found
    ]


def test_junctions_of_a_map_have_their_streets_names():
    found = finish(site_places(SCENES / "corridor.xodr"))
    assert [place.key for place in found.places] == ["100", "200", "300"]
    assert found.places[1].name == "200 · School Street junction · High Street / School Street"


def test_a_node_with_a_negative_id_is_not_taken_for_a_roundabout():
    """Editors give negative ids to nodes that are not saved yet."""
    ring = {1: (52.0, 13.0), 2: (52.0001, 13.0001), 3: (52.0, 13.0002), 4: (51.9999, 13.0001)}
    far = {-1: (52.01, 13.01), 10: (52.01, 13.011), 11: (52.011, 13.01), 12: (52.0, 12.999), 13: (52.0, 13.001)}
    nodes = {number: reading.Node(*place, {}) for number, place in (ring | far).items()}
    street = {"highway": "residential"}
    ways = {
        1: reading.Way((1, 2, 3, 4, 1), {**street, "junction": "roundabout"}),
        2: reading.Way((12, 1), {**street, "name": "West Road"}),
        3: reading.Way((3, 13), {**street, "name": "East Road"}),
        4: reading.Way((10, -1), {**street, "name": "Elm Road"}),
        5: reading.Way((-1, 11), {**street, "name": "Oak Road"}),
    }
    found = named_crossings(reading.Extract("place.osm", nodes, ways, {}))
    assert [one.streets for one in found] == [("East Road", "West Road"), ("Elm Road", "Oak Road")]


@pytest.fixture
def town(tmp_path):
    """Three streets in a row, 300 m apart, across one main street; signals at the first, and a divided fourth one."""
    extract = Extract()
    main = [(x, 0.0) for x in (-200.0, 0.0, 300.0, 600.0, 900.0, 918.0, 1100.0)]
    extract.way(main, highway="secondary", name="Main Street")
    extract.way([(0.0, -150.0), (0.0, 0.0), (0.0, 150.0)], highway="residential", name="First Lane")
    extract.way([(300.0, -150.0), (300.0, 0.0), (300.0, 150.0)], highway="tertiary", name="Second Lane")
    extract.way([(600.0, 0.0), (600.0, 150.0)], highway="residential", name="Third Lane")
    extract.way([(900.0, -150.0), (900.0, 0.0), (900.0, 150.0)], highway="primary", name="Fourth Road", oneway="yes")
    extract.way([(918.0, 150.0), (918.0, 0.0), (918.0, -150.0)], highway="primary", name="Fourth Road", oneway="yes")
    extract.way([(0.0, 150.0), (300.0, 150.0)], highway="residential", name="Back Lane")
    extract.node(0.0, -20.0, highway="traffic_signals")
    return finish(read_extract(extract.write(tmp_path / "town.osm")))


def names(junctions):
    return [one.name for one in junctions]


def test_rules_select_by_signals_and_by_class(town):
    assert names(selected_junctions(town, ["signals"])) == ["First Lane / Main Street"]
    assert names(selected_junctions(town, ["primary"])) == ["Fourth Road / Main Street"]
    assert len(selected_junctions(town, ["all"])) == 6
    assert names(selected_junctions(town, ["primary", "signals"])) == [
        "First Lane / Main Street",
        "Fourth Road / Main Street",
    ]


def test_two_carriageways_are_one_junction(town):
    found = selected_junctions(town, ["all"])
    assert names(found).count("Fourth Road / Main Street") == 1
    plane = plan_metres([(one.latitude, one.longitude) for one in found], (52.5, 13.4))
    apart = np.hypot(*(plane[:, None] - plane[None]).transpose(2, 0, 1))
    assert apart[~np.eye(len(found), dtype=bool)].min() > SAME_JUNCTION


def test_area_leaves_out_what_is_outside(town):
    (first,) = selected_junctions(town, ["signals"])
    area = shapely.Point(first.longitude, first.latitude).buffer(0.0005)
    assert names(selected_junctions(town, ["all"], area)) == ["First Lane / Main Street"]
    with pytest.raises(SeipError, match="no junction in the given area"):
        selected_junctions(town, ["all"], shapely.box(0, 0, 1, 1))


def test_written_part_reads_back_the_same(town, tmp_path):
    part = cropped(town, window(52.5, 13.4, 400.0))
    path = tmp_path / "part.osm"
    path.write_bytes(extract_xml(part))
    again = finish(read_extract(path))
    assert again.nodes.keys() == part.nodes.keys()
    assert again.ways.keys() == part.ways.keys()
    for number, node in part.nodes.items():
        other = again.nodes[number]
        assert (other.latitude, other.longitude, dict(other.tags)) == (node.latitude, node.longitude, dict(node.tags))
    for number, way in part.ways.items():
        assert (again.ways[number].nodes, dict(again.ways[number].tags)) == (way.nodes, dict(way.tags))
    assert again.attribution == part.attribution
    assert extract_xml(again) == path.read_bytes()
