"""What a file may look like, and what is said of one that cannot be read."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.world.opendrive.junctions import find_junction
from seip_addon.core.world.opendrive.read import read_map
from tests.builders.opendrive_text import document, geometry, lane, map_lanes, read_text, road, section
from tests.oracles.random_cases import cases


def test_the_header_is_kept_and_not_applied(tmp_path):
    header = (
        '<header name="Old town"><geoReference><![CDATA[ +proj=nonsense ]]></geoReference>'
        '<offset x="1.5" y="-2" z="3" hdg="0.25"/></header>'
    )
    road_map = read_text(tmp_path, document(road(), header=header, rest='<junction id="5" name="Market"/>'))
    assert (road_map.name, road_map.geo_reference) == ("Old town", "+proj=nonsense")
    np.testing.assert_array_equal(road_map.header_offset, [1.5, -2, 3, 0.25])
    assert map_lanes(road_map)[0].left[0].tolist() == [0, 0, 0]
    assert [(junction.id, junction.name) for junction in road_map.junctions] == [("5", "Market")]


def test_sections_and_geometries_may_come_in_any_order(tmp_path):
    plan = geometry(s=40.0, length=60.0, x=40.0) + geometry(length=40.0)
    sections = section(lane(-1, 5.0), s=50.0) + section(lane(-1, 3.0)) + section(lane(-1), s=250.0)
    first, second = map_lanes(read_text(tmp_path, document(road(plan, sections))))
    assert first.polygon.area == pytest.approx(150)
    assert second.polygon.area == pytest.approx(250)


BROKEN = {
    "curvature": (road(geometry('<arc curvature="nan"/>')), "road 1: curvature='nan' of <arc> is not a plausible"),
    "huge": (road(geometry(x=1e300)), "road 1: x='1e\\+300' of <geometry> is not a plausible"),
    "zero": (road(geometry(length=0.0)), "road 1: length=0 of <geometry> must be above zero"),
    "missing": ('<road id="9"><planView><geometry s="0" x="0" y="0"/></planView></road>', "has no 'length'"),
    "nameless": ("<road/>", "<road> has no 'id'"),
    "planless": ('<road id="9"/>', "road 9 has no <geometry>"),
    "shapeless": (road(geometry("<helix/>", s=0.0)), "road 1: a <geometry> at s=0 holds no line"),
    "endless": (road(geometry(length=1e8)), "road 1: its <geometry> reaches 1e\\+08 m"),
    "coil": (road(geometry('<arc curvature="1000"/>')), "road 1: a <arc> of 100 m turns more than a hundred times"),
    "point": (
        road(geometry('<paramPoly3 aU="0" bU="0" cU="0" dU="0" aV="0" bV="0" cV="0" dV="0"/>')),
        "road 1: a <paramPoly3> has no extent",
    ),
    "half lane": (road(sections=section(lane(-1.5))), "road 1: id=-1.5 of <lane> must be a whole number"),
    "object": (road(objects='<object id="4" s="x" t="0"/>'), "road 1, object 4: s='x' of <object>"),
    "repeat": (
        road(objects='<object id="4" s="0" t="0"><repeat distance="-1"/></object>'),
        "road 1, object 4: distance=-1 of <repeat> is below zero",
    ),
    "signal": (road(signals='<signal id="4" s="0" dynamic="yes"/>'), "road 1, signal 4: <signal> has no 't'"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_number_without_sense_is_named_with_its_road_and_element(tmp_path, name):
    text, message = BROKEN[name]
    with pytest.raises(SeipError, match=message) as caught:
        read_text(tmp_path, document(text))
    assert "\n" not in str(caught.value)


def test_roads_with_one_id_are_named(tmp_path):
    with pytest.raises(SeipError, match=r"has 300 roads with the id 7; export the map again"):
        read_text(tmp_path, document(*[road(number="7")] * 300))


def refused(path, message):
    with pytest.raises(SeipError, match=message):
        read_map(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is broken XML: no element found: line 1"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "is broken XML"),
        (b"<OpenDRIVE>\n<road id='1'>\n</OpenDRIVE>", "is broken XML: mismatched tag: line 3"),
        (b"<net version='1.0'/>", "is not OpenDRIVE: it begins with <net>"),
        (b"<OpenDRIVE><header/></OpenDRIVE>", "has no roads"),
        (b"<?xml version='1.0' encoding='klingon'?><OpenDRIVE/>", "unknown encoding|is in an encoding"),
    ],
)
def test_what_is_no_map_is_told_so(tmp_path, content, message):
    path = tmp_path / "map.xodr"
    path.write_bytes(content)
    refused(path, message)


BOMB = "".join(f'<!ENTITY e{i + 1} "{f"&e{i};" * 10}">' for i in range(9))


@pytest.mark.parametrize(
    "declared",
    [
        f'<!ENTITY e0 "ha">{BOMB}',
        '<!ENTITY e9 SYSTEM "file:///etc/passwd">',
        '<!ENTITY % e SYSTEM "http://localhost:9/e.dtd"> %e;',
        "",
    ],
)
def test_hostile_xml_is_refused(tmp_path, declared):
    text = f"<!DOCTYPE OpenDRIVE [{declared}]>" + document(road(), header='<header name="&e9;"/>')
    with pytest.raises(SeipError, match="declares a document type or entities"):
        read_text(tmp_path, text)


@pytest.fixture
def three_junctions(tmp_path):
    roads = [road(geometry(length=20.0, x=100.0 * i), number=str(i), junction=f"70{i}") for i in range(3)]
    names = ["North gate", "South gate", "South gate"]
    rest = "".join(f'<junction id="70{i}" name="{name}"/>' for i, name in enumerate(names)) + '<junction id="800"/>'
    road_map = read_text(tmp_path, document(*roads, rest=rest))
    return road_map, map_lanes(road_map)


def test_a_junction_is_found_by_its_id_or_its_name(three_junctions):
    assert find_junction(*three_junctions, "702").id == "702"
    assert find_junction(*three_junctions, "North gate").id == "700"


@pytest.mark.parametrize(
    ("kind", "said"), [("direct", r"is a direct one.*--near 100 0"), ("default", "has no lanes; ")]
)
def test_of_a_junction_without_lanes_the_place_is_named(tmp_path, kind, said):
    into = '<link><successor elementType="junction" elementId="5"/></link><planView>'
    text = document(road().replace("<planView>", into), rest=f'<junction id="5" type="{kind}"/>')
    road_map = read_text(tmp_path, text)
    with pytest.raises(SeipError, match=said):
        find_junction(road_map, map_lanes(road_map), "5")


EVERYTHING = document(
    road(
        geometry('<poly3 a="0.1" b="0.1" c="0.001" d="-0.0001"/>', 30.0)
        + geometry(
            '<paramPoly3 pRange="arcLength" aU="0" bU="1" cU="0" dU="-0.001" aV="0" bV="0.2" cV="0.01" dV="0"/>',
            20.0,
            s=30.0,
            x=30.0,
        )
        + geometry('<spiral curvStart="0.1" curvEnd="-0.02"/>', 30.0, s=50.0, x=50.0)
        + geometry('<arc curvature="0.05"/>', 20.0, s=80.0, x=80.0),
        section(
            lane(1, inside='<height sOffset="0" inner="0.1" outer="0.2"/><height sOffset="10" inner="0" outer="0"/>'),
            lane(-1, None, inside='<border sOffset="0" a="3" b="0.1" c="0" d="0"/>'),
            lane(-2, level="true"),
        )
        + section(lane(1), s=40.0),
        offset='<laneOffset s="0" a="0" b="0.1" c="0" d="0"/>',
        elevation='<elevation s="0" a="0" b="0.1" c="0.001" d="0"/>',
        lateral='<superelevation s="0" a="0.1" b="0.001" c="0" d="0"/><crossfall s="0" side="left" a="0.02"/>'
        '<shape s="0" t="-4" a="0" b="0.1" c="0" d="0"/><shape s="30" t="-4" a="0" b="0.1" c="0" d="0"/>',
        objects='<object id="1" s="5" t="9" zOffset="0" hdg="1" pitch="0" roll="0" length="4" width="2" height="3">'
        '<repeat s="5" length="40" distance="8" tStart="9" tEnd="12" zOffsetStart="0" zOffsetEnd="1"/>'
        '<repeat s="5" length="40" distance="0" widthStart="1" widthEnd="2" heightStart="1" heightEnd="2"/>'
        '<outline closed="true"><cornerLocal u="1" v="2" z="3"/><cornerRoad s="7" t="8" dz="0.5" height="2"/></outline>'
        "</object>",
        signals='<signal id="1" dynamic="yes" s="10" t="-5" zOffset="2" hOffset="0.1" height="1" width="1"/>',
    )
)
VALUES = [match.span(1) for match in re.finditer(r'(?<![a-z])[a-zA-Z]+="([^"]*)"', EVERYTHING)]

WRONG = ["0", "-1", "0.5", "3", "1e5", "1e9", "-1e9", "1e-300", "1e300", "nan", "-inf", "x", ""]


@given(st.sampled_from(VALUES), st.sampled_from(WRONG))
@cases(300, 30)
def test_a_value_gone_wrong_is_read_or_refused_in_words(tmp_path_factory, span, value):
    text = EVERYTHING[: span[0]] + value + EVERYTHING[span[1] :]
    try:
        road_map = read_text(tmp_path_factory.getbasetemp(), text, "mutant.xodr")
        surfaces = map_lanes(road_map)
        objects = (*road_map.objects, *road_map.signals)
    except SeipError:
        return
    assert all(np.isfinite(surface.triangles).all() for surface in surfaces)
    assert all(np.isfinite(obj.position).all() for obj in objects)
