"""Networks of SUMO as streets: lanes, links, joints, crossings and heights."""

import numpy as np
import pytest
import shapely

from seip_addon.core.base.errors import SeipError
from seip_addon.core.world.openstreetmap.network_map import credited, read_network_map
from seip_addon.core.world.traffic_simulation.street_network import read_network

NETWORK = """<net version="1.20"{left}>
<location netOffset="-391000.00,-5817000.00" convBoundary="0,0,1,1" origBoundary="0,0,1,1" projParameter="+proj=utm"/>
<edge id=":b_0" function="internal">
  <lane id=":b_0_0" index="0" length="98" allow="pedestrian" width="2.50" shape="98.00,-4.45 102.00,-4.45"/></edge>
<edge id=":b_1" function="internal">
  <lane id=":b_1_0" index="0" length="98" disallow="pedestrian" width="3.20" shape="98.00,-1.60 102.00,-1.60"/></edge>
<edge id=":b_c0" function="crossing" crossingEdges="2">
  <lane id=":b_c0_0" index="0" length="98" allow="pedestrian" width="4.00" shape="100.00,-5.00 100.00,1.00"/></edge>
<edge id=":b_w0" function="walkingarea">
  <lane id=":b_w0_0" index="0" length="98" allow="pedestrian" width="2.5" shape="98,-3.2 98,-5.7 102,-5.7 102,-3.2"/>
</edge>
<edge id="2" from="a" to="b" name="Mill &amp;amp; Lane">
  <lane id="2_0" index="0" length="98" allow="pedestrian" width="2.50" shape="0.00,-4.45 98.00,-4.45"/>
  <lane id="2_1" index="1" length="98" disallow="pedestrian" width="3.20" shape="0.00,-1.60 98.00,-1.60"/></edge>
<edge id="3" from="b" to="c" name="Mill &amp;amp; Lane">
  <lane id="3_0" index="0" length="98" allow="pedestrian" width="2.50" shape="102.00,-4.45 200.00,-4.45"/>
  <lane id="3_1" index="1" length="98" disallow="pedestrian" width="3.20" shape="102.00,-1.60 200.00,-1.60"/></edge>
{more}
<junction id="a" type="dead_end" x="0" y="0" shape="0.00,0.00 0.00,-5.70"/>
<junction id="b" type="priority" x="100" y="0" shape="98.00,0.00 102.00,0.00 102.00,-5.70 98.00,-5.70"/>
<junction id="c" type="dead_end" x="200" y="0" shape="200.00,0.00 200.00,-5.70"/>
<connection from="2" to="3" fromLane="1" toLane="1" via=":b_1_0" tl="b" linkIndex="0" dir="s" state="O"/>
</net>
"""
SIDE_STREET = (
    '<edge id="4" from="d" to="b"><lane id="4_0" index="0" length="98" disallow="tram" shape="100,90 100,4"/></edge>'
)


def read(tmp_path, *, left="", more=""):
    path = tmp_path / "place.net.xml"
    path.write_text(NETWORK.format(left=left, more=more), encoding="utf-8")
    return read_network_map(path)


def lanes(network, road):
    return {lane.lane_id: lane for lane in network.streets.lanes if lane.road_id == road}


def test_lanes_count_from_the_middle_outwards_and_have_their_width(tmp_path):
    network = read(tmp_path)
    found = lanes(network, "2")
    assert {number: lane.lane_type for number, lane in found.items()} == {-1: "driving", -2: "sidewalk"}
    assert found[-1].left[:, 1] == pytest.approx(0.0)
    assert found[-1].right[:, 1] == pytest.approx(-3.2)
    assert found[-2].right[:, 1] == pytest.approx(-5.7)
    assert not found[-1].keeps_left
    left = lanes(read(tmp_path, left=' lefthand="true"'), "2")
    assert set(left) == {1, 2}
    assert left[1].keeps_left


def test_roads_have_links_names_and_the_offset_of_the_projection(tmp_path):
    road_map = read(tmp_path).streets.road_map
    roads = {road.id: road for road in road_map.roads}
    assert roads["2"].name == "Mill & Lane"
    assert (roads[":b_1"].junction_id, roads[":b_1"].predecessor.id, roads[":b_1"].successor.id) == ("b", "2", "3")
    assert road_map.header_offset[:2] == pytest.approx([391000.0, 5817000.0])
    assert roads["2"].frame(np.array([50.0])).origin[0] == pytest.approx([50.0, 0.0, 0.0])


@pytest.mark.parametrize(("more", "is_joint"), [("", True), (SIDE_STREET, False)])
def test_a_junction_of_two_arms_is_a_joint_whose_lanes_are_those_of_the_street(tmp_path, more, is_joint):
    network = read(tmp_path, more=more)
    (area,) = [one for one in network.streets.junctions if one.id == "b"]
    assert area.is_joint is is_joint
    assert {lane.junction_id for lane in lanes(network, ":b_1").values()} == {None if is_joint else "b"}
    assert area.carriageway.equals_exact(shapely.box(98, -3.2, 102, 0), 0.01) or area.carriageway.symmetric_difference(
        shapely.box(98, -3.2, 102, 0)
    ).area == pytest.approx(0.0, abs=0.1)
    assert area.walking.area == pytest.approx(10.0, abs=0.1)


def test_crossings_and_signals_are_placed(tmp_path):
    streets = read(tmp_path).streets
    (crossing,) = streets.road_map.objects
    assert crossing.position[:2] == pytest.approx([100.0, -2.0])
    assert (crossing.length, crossing.width) == pytest.approx((4.0, 6.0))
    (signal,) = streets.road_map.signals
    assert signal.position[:2] == pytest.approx([98.0, -1.6])


def test_corners_of_lanes_are_mitred(tmp_path):
    bent = (
        '<edge id="5" from="a" to="d"><lane id="5_0" index="0" length="98" width="2" shape="0,50 10,50 10,60"/></edge>'
    )
    lane = lanes(read(tmp_path, more=bent), "5")[-1]
    assert lane.left[1, :2] == pytest.approx([9.0, 51.0])
    assert lane.right[1, :2] == pytest.approx([11.0, 49.0])


def test_raised_streets_and_their_file_agree(tmp_path):
    network = read(tmp_path)
    profiles = {"2": (np.array([0.0, 40.0, 98.0]), np.array([0.0, 2.0, 3.0]))}
    profiles[":b_1"] = (np.array([0.0, 4.0]), np.array([3.0, 4.0]))
    raised = network.streets.raised(profiles)
    (lane,) = [one for one in raised.lanes if one.road_id == "2" and one.lane_type == "driving"]
    assert np.interp([40.0, 69.0], lane.s, lane.left[:, 2]) == pytest.approx([2.0, 2.5])
    path = tmp_path / "raised.net.xml"
    path.write_text(network.raised(profiles).text, encoding="utf-8")
    again = {one.road_id: one for one in read_network_map(path).streets.lanes if one.lane_type == "driving"}
    assert np.interp([40.0, 69.0], again["2"].s, again["2"].right[:, 2]) == pytest.approx([2.0, 2.5])
    assert again[":b_1"].left[[0, -1], 2] == pytest.approx([3.0, 4.0])
    assert not again["3"].left[:, 2].any()


@pytest.mark.parametrize(
    ("line", "y"),
    [
        ([(0, -8), (99, -8)], -8.0),
        ([(30, -7), (80, -7)], -7.0),
        ([(0, -2), (99, -2)], -4.45),  # in the carriageway
        ([(0, 2), (99, 2)], -4.45),  # on the other side of it
        ([(0, -8), (20, -8)], -4.45),  # along a short part of the street only
    ],
)
def test_people_walk_on_a_mapped_sidewalk(tmp_path, line, y):
    network = read(tmp_path).walking_on(shapely.MultiLineString([line]))
    path = tmp_path / "walked.net.xml"
    path.write_text(network.text, encoding="utf-8")
    walked = read_network(path)
    assert walked.lane("2_0").line[:, 1] == pytest.approx(y)
    assert walked.lane("2_0").line[[0, -1], 0] == pytest.approx([0.0, 98.0])
    assert walked.lane("3_0").line[:, 1] == pytest.approx(-4.45)
    assert walked.lane("2_1").line[:, 1] == pytest.approx(-1.6)


def test_credits_are_comments_that_xml_allows(tmp_path):
    path = tmp_path / "credited.net.xml"
    path.write_text(credited(NETWORK.format(left="", more=""), ["© mappers -- 2026"]), encoding="utf-8")
    assert "<!-- © mappers - 2026 -->" in path.read_text(encoding="utf-8")
    assert read_network_map(path).streets.lanes


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ('shape="0.00,-4.45 98.00,-4.45"', 'shape="here"', "is not a valid SUMO network"),
        ("netOffset", "offset", "is not a valid SUMO network"),
        ("<net ", "<routes ", "broken"),
    ],
)
def test_a_damaged_network_is_refused_in_a_sentence(tmp_path, old, new, complaint):
    path = tmp_path / "place.net.xml"
    path.write_text(NETWORK.format(left="", more="").replace(old, new), encoding="utf-8")
    with pytest.raises(SeipError, match=complaint):
        read_network_map(path)
