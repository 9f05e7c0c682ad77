"""Reading extracts, whole and broken."""

import gzip

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.world.openstreetmap import extract as reading
from seip_addon.core.world.openstreetmap.extract import read_extract, window
from tests.builders.osm_text import crossing


def read(path, within=None):
    return finish(read_extract(path, within))


def written(tmp_path, text, name="place.osm"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def osm(body):
    return f'<?xml version="1.0" encoding="UTF-8"?><osm version="0.6">{body}</osm>'


def test_an_extract_is_read_plain_and_packed(tmp_path):
    plain = crossing().write(tmp_path / "place.osm")
    packed = tmp_path / "place.osm.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    one, other = read(plain), read(packed)
    assert len(one.nodes) == len(other.nodes) > 20
    assert one.ways.keys() == other.ways.keys()
    assert any(way.tags.get("name") == "East Road" for way in one.ways.values())


def test_nodes_outside_a_window_are_passed_over(tmp_path):
    path = crossing().write(tmp_path / "place.osm")
    near = read(path, window(52.5, 13.4, 60.0))
    assert 0 < len(near.nodes) < len(read(path).nodes)
    assert len(near.ways) == len(read(path).ways)


INLINE = '<way id="2"><nd ref="1" lat="1" lon="1"/><nd ref="2" lat="1" lon="2"/></way>'
"""A way of Overpass's ``out geom``."""


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("<osm><node id='1' lat='0' lon='0'>", "broken or unfinished XML"),
        (osm(""), "has no node"),
        ("<OpenDRIVE/>", "not an extract of OpenStreetMap: its first element is <OpenDRIVE>"),
        ('<!DOCTYPE osm [<!ENTITY a "aaaa">]><osm>&a;</osm>', "declares a document type or entities"),
        (osm('<node id="x" lat="0" lon="0"/>'), "not a whole number"),
        (osm(f'<node id="{10**20}" lat="0" lon="0"/>'), "not a whole number below"),
        ("<osmChange/>", "list of changes, not an extract: download the place as OpenStreetMap XML"),
        (
            ' {"elements": []}',
            r"is JSON, not an extract: choose OpenStreetMap XML \(.osm\), from Overpass with \[out:xml\]",
        ),
        (osm(INLINE), "has ways without nodes: query Overpass with `out body;"),
        (osm('<node id="1" lat="0" lon="0"/><way id="2"><nd ref=""/></way>'), "not a whole number"),
    ],
)
def test_a_broken_extract_is_refused_in_a_sentence(tmp_path, text, complaint):
    with pytest.raises(SeipError, match=complaint):
        read(written(tmp_path, text))


def test_a_missing_file_and_a_damaged_one_are_named(tmp_path):
    with pytest.raises(SeipError, match="no such file"):
        read(tmp_path / "nowhere.osm")
    path = tmp_path / "place.osm.gz"
    path.write_bytes(gzip.compress(crossing().text().encode())[:-30])
    with pytest.raises(SeipError, match="damaged gzip"):
        read(path)


def test_nodes_without_a_place_and_contradicting_copies_are_counted(tmp_path):
    nodes = ['<node id="1" lat="10" lon="10"/>', '<node id="1" lat="11" lon="10"/>']
    nodes += ['<node id="2" lat="90" lon="0"/>', '<node id="3" lat="0" lon="181"/>', '<node id="4" lat="nan" lon="1"/>']
    nodes += ['<node id="5" lat="0" lon="180"/>', '<node id="6" lat="0" lon="-180"/>', '<node id="7"/>']
    found = read(written(tmp_path, osm("".join(nodes))))
    assert sorted(found.nodes) == [1, 5, 6]
    assert found.nodes[1].latitude == 11
    assert "two versions of 1 element" in found.notes[0]
    assert "4 nodes" in found.notes[1]


@pytest.mark.parametrize("order", [1, -1])
def test_of_two_copies_of_an_element_the_tags_and_nodes_are_kept(tmp_path, order):
    """Overpass repeats elements without tags (``out skel``) and without nodes (``out tags``)."""
    signal = '<tag k="highway" v="traffic_signals"/>'
    street = '<tag k="highway" v="service"/><tag k="oneway" v="-1"/>'
    refs = '<nd ref="1"/><nd ref="2"/>'
    copies = [f'<node id="1" lat="1" lon="1">{signal}</node>', f'<way id="9">{refs}{street}</way>']
    copies += ['<node id="1" lat="1" lon="1"/>', f'<way id="9">{refs}</way>', f'<way id="9">{street}</way>']
    found = read(written(tmp_path, osm("".join(['<node id="2" lat="1" lon="2"/>', *copies[::order]]))))
    assert found.nodes[1].tags == {"highway": "traffic_signals"}
    assert found.ways[9].nodes == (2, 1)
    assert found.ways[9].tags == {"highway": "service", "oneway": "yes"}
    assert not found.notes


def test_a_one_way_street_against_its_way_is_read_in_driving_direction(tmp_path):
    tags = {
        "oneway": "-1",
        "sidewalk": "left",
        "cycleway:right": "lane",
        "lanes:backward": "2",
        "turn:lanes": "left|",
    }
    lines = "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())
    body = f'<node id="1" lat="1" lon="1"/><way id="9"><nd ref="1"/><nd ref="2"/>{lines}</way>'
    way = read(written(tmp_path, osm(body))).ways[9]
    assert way.nodes == (2, 1)
    assert way.tags == {
        "oneway": "yes",
        "sidewalk": "right",
        "cycleway:left": "lane",
        "lanes:forward": "2",
        "turn:lanes": "left|",
    }


def test_an_extract_that_is_too_large_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "MAX_ELEMENTS", 10)
    with pytest.raises(SeipError, match="more than 10 elements; cut the place out"):
        read(crossing().write(tmp_path / "place.osm"))


def test_places_on_both_sides_of_the_date_line_are_neighbours(tmp_path):
    nodes = '<node id="1" lat="-16.8" lon="179.9999"/><node id="2" lat="-16.8" lon="-179.9998"/>'
    path = written(tmp_path, osm(nodes))
    for found in (read(path), read(path, window(-16.8, 179.9999, 500.0)), read(path, window(-16.8, -179.9999, 500.0))):
        assert found.nodes[2].longitude - found.nodes[1].longitude == pytest.approx(0.0003)


@pytest.mark.parametrize(
    ("head", "credit"),
    [
        ("<osm>", "© OpenStreetMap contributors (ODbL)"),
        ('<osm copyright="OpenStreetMap and contributors">', "© OpenStreetMap contributors (ODbL)"),
        (
            '<osm><meta osm_base="2024-03-22T14:09:45Z"/>',
            "© OpenStreetMap contributors (ODbL), data of 2024-03-22",
        ),
        ('<osm timestamp="2023-01-02T03:04:05Z">', "© OpenStreetMap contributors (ODbL), data of 2023-01-02"),
        (
            '<osm><node id="7" lat="1" lon="1" timestamp="2013-08-03T15:55:30Z"/>',
            "© OpenStreetMap contributors (ODbL), changes up to 2013-08-03",
        ),
        ('<osm timestamp="yesterday">', "© OpenStreetMap contributors (ODbL)"),
        ('<osm copyright="A\n&lt;b&gt; town">', "© A <b> town"),
    ],
)
def test_the_credit_of_an_extract_names_its_holder_and_its_date(tmp_path, head, credit):
    path = written(tmp_path, f'{head}<node id="1" lat="1" lon="1"/></osm>')
    assert read(path).attribution == credit


def as_pbf(path, **header):
    """Write an extract of XML as PBF beside it."""
    osmium = pytest.importorskip("osmium")
    target = path.with_suffix(".osm.pbf")
    about = osmium.io.Header()
    for name, value in header.items():
        about.set(name, value)
    with osmium.SimpleWriter(str(target), header=about, overwrite=True) as writer:
        for element in osmium.FileProcessor(str(path)):
            writer.add(element)
    return target


@pytest.mark.parametrize("within", [None, window(52.5, 13.4, 60.0)], ids=["whole", "window"])
def test_pbf_is_read_as_xml_is(tmp_path, within):
    plain = crossing().write(tmp_path / "place.osm")
    one, other = read(plain, within), read(as_pbf(plain), within)
    assert one.nodes.keys() == other.nodes.keys()
    for number, node in one.nodes.items():
        assert other.nodes[number].latitude == pytest.approx(node.latitude, abs=1e-7)
        assert other.nodes[number].longitude == pytest.approx(node.longitude, abs=1e-7)
        assert dict(other.nodes[number].tags) == dict(node.tags)
    assert {number: (way.nodes, dict(way.tags)) for number, way in one.ways.items()} == {
        number: (way.nodes, dict(way.tags)) for number, way in other.ways.items()
    }
    assert {number: one.members for number, one in one.relations.items()} == {
        number: one.members for number, one in other.relations.items()
    }
    assert one.attribution == other.attribution
