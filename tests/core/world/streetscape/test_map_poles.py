"""Poles: those of the map come first, assumed ones stand beside the carriageway and carry nothing unless asked."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from seip_addon.core.progress import finish
from seip_addon.core.site.candidates import assumed_pole_warnings, generate_candidates
from seip_addon.core.site.roles import Role
from seip_addon.core.site.scene_geometry import ASSUMED, DESCRIBED, FROM_EXTRACT, FROM_MAP, Pole
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.streetscape.description import Poles, SiteDescription
from seip_addon.core.world.streetscape.model import site_model
from tests.builders.opendrive_text import document, geometry, lane, read_text, road, section
from tests.builders.plain_street import PLAIN, street
from tests.builders.street_map import street_map

HERE = SiteDescription(near=(0.0, 0.0), radius=30.0)
SIGNAL = '<signal id="1" name="{name}" s="{s}" t="{t}" zOffset="0" orientation="+" dynamic="yes" type="1000001"/>'
OBJECT = '<object id="{id}" type="{kind}" name="{name}" s="{s}" t="{t}" zOffset="0" hdg="0" {size}/>'


def signal(s=95, t=-5, name=""):
    return SIGNAL.format(s=s, t=t, name=name)


def obj(kind="pole", t=-5.5, s=95, name="", size='height="6" radius="0.1"', number=9):
    return OBJECT.format(id=number, kind=kind, name=name, s=s, t=t, size=size)


def model(tmp_path, description=HERE, **options):
    path = tmp_path / "street.xodr"
    path.write_text(street_map(**options), encoding="utf-8")
    return finish(site_model(read_map(path), description))


def poles(built):
    return [part for part in built.parts if Role.POLES in part.roles]


def has_arm(pole):
    return bool(np.abs(pole.solid.vertices[:, 0]).max() > 1.0)


OWN_POSTS = {
    "by type": obj(),
    "by name": obj("-1", name="TrafficMast_02"),
    "by shape": obj("none", size='height="5.5" length="0.2" width="0.25"'),
    "by an outline": '<object id="9" type="-1" name="" s="95" t="-5.5" zOffset="0" hdg="0"><outline>'
    + "".join(f'<cornerLocal u="{u}" v="{v}" z="0" height="6"/>' for u, v in [(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1)])
    + "</outline></object>",
}


@pytest.mark.parametrize("own", OWN_POSTS.values(), ids=OWN_POSTS)
@pytest.mark.parametrize("t", [-5.0, -1.2], ids=["beside", "over the carriageway"])
def test_a_post_of_the_map_carries_the_signal_near_it(tmp_path, own, t):
    (pole,) = poles(model(tmp_path, signals=signal(t=t), furniture=own))
    assert pole.source == FROM_MAP
    np.testing.assert_allclose(pole.foot[:2], [-15, -5.5], atol=0.05)
    assert has_arm(pole)


def test_a_mast_some_way_off_carries_a_lamp_over_the_carriageway_on_an_arm_up_to_it(tmp_path):
    built = model(tmp_path, signals=signal(t=1.5), furniture=obj(t=-7, name="mast"))
    (pole,) = poles(built)
    assert pole.source == FROM_MAP
    tip = np.array(pole.foot[:2]) + 8.5 * np.array([math.cos(pole.yaw), math.sin(pole.yaw)])
    np.testing.assert_allclose(tip, [-15, 1.5], atol=0.05)
    assert pole.solid.vertices[:, 0].max() == pytest.approx(8.5, abs=0.2)


def test_a_street_light_further_off_is_none_of_the_signals(tmp_path):
    built = model(tmp_path, signals=signal(), furniture=obj("streetLamp", s=86))
    assert sorted(pole.source for pole in poles(built)) == [ASSUMED, FROM_MAP]


def test_a_signal_that_is_named_a_post_is_one(tmp_path):
    (pole,) = poles(model(tmp_path, signals=signal(name="Signal_3Light_Post01")))
    assert pole.source == FROM_MAP


def test_posts_without_an_object_are_assumed_and_counted(tmp_path):
    built = model(tmp_path, signals=signal() + signal(s=20))
    assert [(pole.name, pole.source) for pole in poles(built)] == [("Assumed signal pole 1", ASSUMED)]
    assert any(note.startswith("1 post of traffic lights") for note in built.notes)


def test_poles_of_the_site_description_are_marked_as_such(tmp_path):
    lights = (Poles(np.array([[0.0, 6.0]]), 8.0, 1.5, None),)
    (pole,) = poles(model(tmp_path, replace(HERE, street_lights=lights)))
    assert pole.source == DESCRIBED


@pytest.mark.parametrize("place", [(20.0, 20.0), (20.0, 3.0), (38.6, 20.0), (1.0, 1.0)])
def test_an_assumed_pole_stands_in_no_hole_between_the_lanes_of_a_junction(tmp_path, place):
    """Four connecting lanes of 3.5 m round a square of 40 m: its middle is no place for a post."""
    sides = [(0.0, 0.0, 0.0), (40.0, 0.0, math.pi / 2), (40.0, 40.0, math.pi), (0.0, 40.0, -math.pi / 2)]
    strips = [
        road(geometry(length=40.0, x=x, y=y, hdg=hdg), section(lane(1), lane(-1)), number=str(number), junction="7")
        for number, (x, y, hdg) in enumerate(sides)
    ]
    x, y = place
    light = (
        f'<signal id="5" s="0" t="0" zOffset="0" dynamic="yes" type="1"><positionInertial x="{x}" y="{y}" z="0"/>'
        "</signal>"
    )
    strips[0] = strips[0].replace("<signals></signals>", f"<signals>{light}</signals>")
    text = document(*strips, rest='<junction id="7" name="ring"/>')
    built = finish(site_model(read_text(tmp_path, text), SiteDescription(near=(20.0, 20.0), radius=60.0)))
    (pole,) = poles(built)
    square = shapely.box(-3.5, -3.5, 43.5, 43.5).buffer(-3.5).buffer(3.5)  # outer corners may be cut
    foot = np.array(pole.foot[:2]) + built.origin[:2]
    assert square.distance(shapely.Point(foot)) > 0.3
    assert pole.source == ASSUMED


def test_no_pole_is_assumed_across_the_end_of_the_road(tmp_path):
    """The signal hangs 1 m before the end of the map's road, which goes on outside of the map."""
    description = SiteDescription(near=(-100.0, 0.0), radius=30.0)
    built = model(tmp_path, description, signals=signal(s=1.0, t=0.5))
    (pole,) = poles(built)
    foot = np.array(pole.foot[:2]) + built.origin[:2]
    assert abs(foot[1]) > 3.5
    assert foot[0] >= -110.0


def test_an_arm_that_would_reach_over_no_lane_is_left_out(tmp_path):
    (far,) = poles(model(tmp_path, signals=signal(t=-9.5)))
    (near,) = poles(model(tmp_path, signals=signal(t=-5)))
    assert has_arm(near)
    assert not has_arm(far)


@pytest.mark.parametrize(
    ("furniture", "carries"),
    [
        (obj(size='height="4" radius="0.025"'), False),
        (obj(size='height="4" length="0.05" width="0.05"'), False),
        (obj(name="sign post", size='height="4" radius="0.1"'), False),
        (obj(size='height="4" radius="0.06"'), True),
        (obj("-1", size='height="4" radius="0.05"'), True),
    ],
)
def test_posts_of_traffic_signs_carry_no_sensor(tmp_path, furniture, carries):
    built = model(tmp_path, furniture=furniture)
    (post,) = [part for part in built.parts if np.allclose(part.foot[:2], [-15, -5.5])]
    assert post.roles == ((Role.POLES,) if carries else (Role.OCCLUDERS,))


@pytest.mark.parametrize("kind", ["-1", "none"])
@pytest.mark.parametrize(
    ("name", "size", "material"),
    [
        ("Tree_Oak_3", 'height="9" length="6" width="6"', "bark"),
        ("Baum", 'height="9" radius="0.2"', "bark"),
        ("House 4", 'height="9" length="12" width="10"', "roof"),
        ("StreetLight_07", 'height="8"', "luminaire"),
        ("", 'height="5" radius="0.08"', "steel"),
        ("Block", 'height="5" length="3" width="3"', "wall"),
    ],
)
def test_objects_without_a_type_count_by_their_name_and_shape(tmp_path, kind, name, size, material):
    built = model(tmp_path, furniture=obj(kind, t=-12, name=name, size=size))
    of_map = [part for part in built.parts if part.name.startswith(name or kind)]
    assert material in {each for part in of_map for each in part.solid.materials}


def test_assumed_poles_are_no_candidates_unless_asked_for():
    scene = street(poles=(Pole("a", np.array((0.0, 9.0, 0.1)), source=ASSUMED), Pole("b", np.array((9.0, 9.0, 0.1)))))
    allowed = replace(PLAIN, allow=("assumed-poles",))
    plain, asked = generate_candidates(scene, PLAIN), generate_candidates(scene, allowed)
    assert "a" not in plain.position_name
    assert plain.dropped["on an assumed pole"] == 1
    assert "1 pole is assumed" in assumed_pole_warnings(scene, plain)[0]
    assert "carries no sensors" in assumed_pole_warnings(scene, plain)[0]
    assert dict(zip(asked.position_name, asked.pole_source, strict=True))["a"] == ASSUMED
    assert "may carry sensors" in assumed_pole_warnings(scene, asked)[0]
    assert assumed_pole_warnings(street(), plain) == ()


def test_an_assumed_pole_that_is_marked_mandatory_is_meant():
    scene = street(poles=(Pole("a", np.array((0.0, 9.0, 0.1)), source=ASSUMED, mandatory=True),))
    assert "a" in generate_candidates(scene, PLAIN).position_name


@pytest.mark.parametrize(("t", "carries"), [(-5.5, True), (-3.2, True), (-2.0, False)])
def test_a_post_that_the_map_has_in_a_lane_carries_no_sensor(tmp_path, t, carries):
    """The driving lanes end 3.5 m from the middle."""
    built = model(tmp_path, furniture=obj("streetLamp", t=t, name="lamp", size='height="8"'))
    (lamp,) = (part for part in built.parts if part.name == "lamp")
    assert lamp.roles == ((Role.POLES,) if carries else (Role.OCCLUDERS,))


@pytest.mark.parametrize(("y", "carries"), [(-5.5, True), (-3.2, True), (-2.0, False), (-0.1, None)])
def test_a_lamp_of_an_extract_that_lies_in_a_lane_carries_no_sensor(tmp_path, y, carries):
    lamp = Poles(np.array([[0.0, y]]), 8.0, 1.5, None, FROM_EXTRACT)
    built = model(tmp_path, replace(HERE, street_lights=(lamp,)))
    lamps = [part for part in built.parts if part.name.startswith("Street light")]
    assert [part.roles for part in lamps] == ([] if carries is None else [(Role.POLES if carries else Role.OCCLUDERS,)])
    assert any("in a lane" in note for note in built.notes) is (carries is not True)


def test_what_keeps_sensors_off_a_pole_goes_with_it(tmp_path):
    pole = Poles(np.array([[0.0, -8.0]]), 9.0, 0.0, None, FROM_EXTRACT, name="Power pole", keep_off="power-poles")
    built = model(tmp_path, replace(HERE, posts=(pole,)))
    (part,) = (part for part in built.parts if part.name == "Power pole 1")
    assert (part.roles, part.keep_off) == ((Role.POLES,), "power-poles")


@pytest.mark.parametrize("height", ["0", "1e-300", "0.004", "-3"])
@pytest.mark.parametrize("signals", ["", signal()], ids=["alone", "with a signal"])
def test_a_post_without_a_height_that_can_be_stands_as_high_as_others(tmp_path, height, signals):
    own = obj(size=f'height="{height}" radius="0.1"')
    built = model(tmp_path, furniture=own, signals=signals)
    tops = [part.solid.vertices[:, 2].max() for part in built.parts if "pole" in part.name.lower()]
    assert np.isfinite(tops).all()
    assert min(tops, default=math.inf) > 4.0
    assert all(np.isfinite(part.solid.vertices).all() for part in built.parts)
