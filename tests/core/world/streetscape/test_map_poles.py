"""Poles: those of the map come first, assumed ones stand beside the carriageway and carry nothing unless asked."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from seip_addon.core.site.candidates import assumed_pole_warnings, generate_candidates
from seip_addon.core.site.roles import Role
from seip_addon.core.site.scene_geometry import ASSUMED, FROM_EXTRACT, FROM_MAP, Pole
from seip_addon.core.world.streetscape.clearing import SETBACK, clear
from seip_addon.core.world.streetscape.description import Poles, SiteDescription, Trees
from tests.builders.map_models import HERE, model_of_street
from tests.builders.plain_street import PLAIN, street

SIGNAL = '<signal id="1" name="{name}" s="{s}" t="{t}" zOffset="0" orientation="+" dynamic="yes" type="1000001"/>'
OBJECT = '<object id="{id}" type="{kind}" name="{name}" s="{s}" t="{t}" zOffset="0" hdg="0" {size}/>'


def signal(s=95, t=-5, name=""):
    return SIGNAL.format(s=s, t=t, name=name)


def obj(kind="pole", t=-5.5, s=95, name="", size='height="6" radius="0.1"', number=9):
    return OBJECT.format(id=number, kind=kind, name=name, s=s, t=t, size=size)


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
    (pole,) = poles(model_of_street(tmp_path, signals=signal(t=t), furniture=own))
    assert pole.source == FROM_MAP
    np.testing.assert_allclose(pole.foot[:2], [-15, -5.5], atol=0.05)
    assert has_arm(pole)


def test_a_mast_some_way_off_carries_a_lamp_over_the_carriageway_on_an_arm_up_to_it(tmp_path):
    built = model_of_street(tmp_path, signals=signal(t=1.5), furniture=obj(t=-7, name="mast"))
    (pole,) = poles(built)
    assert pole.source == FROM_MAP
    tip = np.array(pole.foot[:2]) + 8.5 * np.array([math.cos(pole.yaw), math.sin(pole.yaw)])
    np.testing.assert_allclose(tip, [-15, 1.5], atol=0.05)
    assert pole.solid.vertices[:, 0].max() == pytest.approx(8.5, abs=0.2)


def test_posts_without_an_object_are_assumed_and_counted(tmp_path):
    built = model_of_street(tmp_path, signals=signal() + signal(s=20))
    assert [(pole.name, pole.source) for pole in poles(built)] == [("Assumed signal pole 1", ASSUMED)]
    assert any(note.startswith("1 post of traffic lights") for note in built.notes)


def test_no_pole_is_assumed_across_the_end_of_the_road(tmp_path):
    """The signal hangs 1 m before the end of the map's road, which goes on outside of the map."""
    description = SiteDescription(near=(-100.0, 0.0), radius=30.0)
    built = model_of_street(tmp_path, description, signals=signal(s=1.0, t=0.5))
    (pole,) = poles(built)
    foot = np.array(pole.foot[:2]) + built.origin[:2]
    assert abs(foot[1]) > 3.5
    assert foot[0] >= -110.0


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


@pytest.mark.parametrize(("t", "carries"), [(-5.5, True), (-3.2, True), (-2.0, False)])
def test_a_post_that_the_map_has_in_a_lane_carries_no_sensor(tmp_path, t, carries):
    """The driving lanes end 3.5 m from the middle."""
    built = model_of_street(tmp_path, furniture=obj("streetLamp", t=t, name="lamp", size='height="8"'))
    (lamp,) = (part for part in built.parts if part.name == "lamp")
    assert lamp.roles == ((Role.POLES,) if carries else (Role.OCCLUDERS,))


def test_what_keeps_sensors_off_a_pole_goes_with_it(tmp_path):
    pole = Poles(np.array([[0.0, -8.0]]), 9.0, 0.0, None, FROM_EXTRACT, name="Power pole", keep_off="power-poles")
    built = model_of_street(tmp_path, replace(HERE, posts=(pole,)))
    (part,) = (part for part in built.parts if part.name == "Power pole 1")
    assert (part.roles, part.keep_off) == ((Role.POLES,), "power-poles")


TREE = '<object id="1" type="{kind}" name="{name}" s="80" t="-12" zOffset="0" hdg="0" {size}/>'


def tree_of(tmp_path, size, kind="tree", name="Tree"):
    place = SiteDescription(near=(0.0, 0.0), radius=40.0)
    model = model_of_street(tmp_path, place, furniture=TREE.format(kind=kind, name=name, size=size))
    return next(part for part in model.parts if part.name == name), model


@pytest.mark.parametrize(
    ("size", "crown"),
    [
        ('height="21" radius="0.125"', 0.6 * 21),
        ('height="21" length="0.4" width="0.4"', 0.6 * 21),
        ('height="12" radius="0.95"', 1.9),  # a cypress
        ('height="7" radius="1.96"', 3.92),
        ('height="9"', 0.6 * 9),
        ('length="4" width="2.5"', 4.0),  # of no height: 8 m
    ],
)
def test_the_crown_is_the_maps_unless_that_can_only_be_the_trunk(tmp_path, size, crown):
    tree, model = tree_of(tmp_path, size)
    assert 2 * np.abs(tree.solid.vertices[:, :2]).max() == pytest.approx(crown)
    assert any("the width of a trunk" in note for note in model.notes) == (crown == 0.6 * 21)


ROAD = shapely.box(-50.0, -3.5, 50.0, 3.5)
MOUTHS = shapely.MultiLineString([[(x, -3.5), (x, 3.5)] for x in (-50.0, 50.0)])


def cleared(*positions):
    trees = Trees(np.array(positions, dtype=float), 8.0, 4.0, FROM_EXTRACT)
    description, _ = clear(SiteDescription(trees=(trees,)), ROAD, MOUTHS)
    return description.trees[0].positions


@pytest.mark.parametrize("depth", [2.0, SETBACK, 0.15, 0.05, 1e-3, 1e-8, 0.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_tree_is_set_back_by_the_same_distance_whatever_its_depth(depth, side):
    ((x, y),) = cleared((7.0, side * (3.5 - depth)))
    assert (x, y) == pytest.approx((7.0, side * (3.5 + SETBACK)), abs=1e-6)
