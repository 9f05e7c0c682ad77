"""Objects and signals stand where the map says, row by row and corner by corner."""

import math

import numpy as np
import pytest
import shapely

from seip_addon.core.world.opendrive.objects import extent_in_plan
from tests.builders.opendrive_text import document, geometry, read_text, road

UPHILL = '<elevation s="0" a="5" b="0.1" c="0" d="0"/>'


def objects(folder, inner, **options):
    return read_text(folder, document(road(objects=inner, **options))).objects


def test_a_box_stands_upright_beside_a_sloping_road(tmp_path):
    text = (
        '<object id="3" name="Hall" type="Building" s="20" t="-7" zOffset="0.5" hdg="0.2" length="25" width="10"'
        ' height="8"/>'
    )
    (hall,) = objects(tmp_path, text, plan=geometry(x=100.0, hdg=math.pi / 2), elevation=UPHILL)
    assert (hall.id, hall.name, hall.kind, hall.road_id) == ("3", "Hall", "building", "1")
    np.testing.assert_allclose(hall.position, [107, 20, 7.5], atol=1e-12)
    assert hall.yaw == pytest.approx(math.pi / 2 + 0.2)
    assert (hall.length, hall.width, hall.height, hall.radius) == (25, 10, 8, 0)
    assert hall.outlines == ()


@pytest.mark.parametrize("wrap", ["{}", "<outlines>{}</outlines>"])
def test_local_corners_turn_with_the_object(tmp_path, wrap):
    corners = '<cornerLocal u="2" v="0" z="-0.5" height="3"/><cornerLocal u="0" v="1" z="0"/>'
    outline = f'<outline closed="false">{corners}</outline>'
    text = f'<object id="1" s="10" t="4" zOffset="1" hdg="{math.pi / 2}" height="9">{wrap.format(outline)}</object>'
    (obj,) = objects(tmp_path, text)
    (found,) = obj.outlines
    np.testing.assert_allclose(found.base, [[10, 6, 0.5], [9, 4, 1]], atol=1e-12)
    # The second corner says nothing: the object's height holds.
    assert found.height.tolist() == [3, 9]
    assert not found.closed


def test_corners_on_the_road_follow_its_bend_and_slope(tmp_path):
    corners = '<cornerRoad s="10" t="0" dz="0.5" height="2"/><cornerRoad s="20" t="1" dz="0" height="4"/>'
    text = f'<object id="1" s="0" t="0"><outline>{corners}</outline></object>'
    (obj,) = objects(tmp_path, text, plan=geometry('<arc curvature="0.1"/>'), elevation=UPHILL)
    expected = [
        [10 * math.sin(1), 10 - 10 * math.cos(1), 6.5],
        [9 * math.sin(2), 10 - 9 * math.cos(2), 7.0],
    ]
    np.testing.assert_allclose(obj.outlines[0].base, expected, atol=1e-12)


def test_a_row_has_a_copy_at_each_step_between_its_ends(tmp_path):
    text = (
        '<object id="1" type="tree" s="0" t="-5" height="3" radius="0.2"><repeat s="10" length="30" distance="10"'
        ' tStart="-5" tEnd="-8" heightStart="3" heightEnd="6" zOffsetStart="0" zOffsetEnd="0.3"/></object>'
    )
    trees = objects(tmp_path, text)
    np.testing.assert_allclose([tree.position for tree in trees], [[10 + 10 * i, -5 - i, 0.1 * i] for i in range(4)])
    assert [tree.height for tree in trees] == pytest.approx([3, 4, 5, 6])
    assert {tree.radius for tree in trees} == {0.2}


def test_a_strip_with_width_is_a_closed_outline(tmp_path):
    text = (
        '<object id="1" type="vegetation" s="40" t="1" height="1.5"><repeat s="10" length="50" distance="0" tStart="-5"'
        ' tEnd="-10" widthStart="1" widthEnd="3"/></object>'
    )
    (hedge,) = objects(tmp_path, text)
    (outline,) = hedge.outlines
    assert outline.closed
    expected = shapely.Polygon([(10, -4.5), (10, -5.5), (60, -11.5), (60, -8.5)])
    assert shapely.Polygon(outline.base[:, :2]).symmetric_difference(expected).area < 1e-6
    assert set(outline.height) == {1.5}


def test_extent_of_an_object_includes_its_outline(tmp_path):
    corners = "".join(f'<cornerLocal u="{u}" v="{v}"/>' for u, v in ((0, 0), (40, 0), (40, 10), (0, 10)))
    text = (
        '<object id="near" s="50" t="0"/><object id="far" s="90" t="0"/>'
        f'<object id="large" s="20" t="0"><outline>{corners}</outline></object>'
    )
    area = shapely.Point(50, 2).buffer(5)
    found = [one.id for one in objects(tmp_path, text) if extent_in_plan(one).intersects(area)]
    assert found == ["near", "large"]


def test_signals_have_a_place_and_a_direction(tmp_path):
    texts = (
        '<signal id="1" name="Post" type="1000001" subtype="-1" dynamic="yes" s="30" t="-6" zOffset="-0.5"'
        ' orientation="+" hOffset="0.1" height="1.2" width="0.5"/>'
        '<signal id="2" dynamic="yes" s="30" t="2" zOffset="4" orientation="-"/>'
        '<signal id="3" type="274" dynamic="no" s="30" t="2" zOffset="4" orientation="-"/>'
    )
    road_map = read_text(tmp_path, document(road(geometry(hdg=0.5), signals=texts, elevation=UPHILL)))
    post, lamp = road_map.signals
    assert post.name == "Post"
    ahead, left = np.array([math.cos(0.5), math.sin(0.5)]), np.array([-math.sin(0.5), math.cos(0.5)])
    np.testing.assert_allclose(post.position, [*(30 * ahead - 6 * left), 7.5])
    assert post.yaw == pytest.approx(0.6)
    np.testing.assert_allclose(lamp.position, [*(30 * ahead + 2 * left), 12])
    assert lamp.yaw == pytest.approx(0.5 + math.pi)


def test_a_tunnel_is_a_line_along_its_road(tmp_path):
    (tunnel,) = objects(tmp_path, '<tunnel id="9" name="Hill" s="20" length="30" type="standard"/>')
    assert (tunnel.kind, tunnel.name, tunnel.length) == ("tunnel", "Hill", 30.0)
    base = tunnel.outlines[0].base
    assert np.hypot(*np.diff(base[[0, -1], :2], axis=0)[0]) == pytest.approx(30.0)
