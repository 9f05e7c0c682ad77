"""Crossings by the names of their streets, and places as people type them."""

from pathlib import Path

import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.workflows.site_places import site_places
from seip_addon.core.world.openstreetmap import extract as reading
from seip_addon.core.world.openstreetmap.crossings import named_crossings
from seip_addon.core.world.openstreetmap.extract import read_extract
from seip_addon.core.world.openstreetmap.map_links import parsed_position
from tests.builders.osm_text import JUNCTIONS, crossing

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
