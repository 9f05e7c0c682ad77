"""Roads above roads: a scene has one level, told by how roads connect, or by the user."""

import math
import os
from pathlib import Path

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.site.roles import Role
from seip_addon.core.site.scene_geometry import OTHER_LEVELS
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.streetscape.description import SiteDescription
from seip_addon.core.world.streetscape.terrain import level_land
from tests.builders.map_models import site_model
from tests.builders.opendrive_text import document, geometry, lane, read_text, road, section

MAPS = Path(os.environ.get("SEIP_MAPS") or Path(__file__).resolve().parents[5] / "shared" / "opendrive")
DECK = 6.0
LANES = section(lane(1), lane(-1))


def level(z):
    return f'<elevation s="0" a="{z}" b="0" c="0" d="0"/>'


def street(number, x, y, length, hdg=0.0, *, z=0.0, objects="", signals=""):
    plan = geometry(length=length, x=float(x), y=float(y), hdg=hdg)
    return road(plan, LANES, number=number, elevation=level(z), objects=objects, signals=signals)


LIGHT = '<object id="1" type="streetLamp" name="lamp" s="{s}" t="5" zOffset="0" height="8"/>'
SIGNAL = '<signal id="1" s="{s}" t="-5" zOffset="0" orientation="+" dynamic="yes" type="1000001"/>'


def underpass():
    """A street of three pieces along x at height 0, and one along y 6 m above its middle piece."""
    low = [street(str(n), x, 0, 60) for n, x in ((1, -90), (2, -30), (3, 30))]
    furniture = {"objects": LIGHT.format(s=30), "signals": SIGNAL.format(s=35)}
    high = [
        street(str(n), 0, y, 60, np.pi / 2, z=DECK, **(furniture if n == 5 else {}))
        for n, y in ((4, -90), (5, -30), (6, 30))
    ]
    return document(*low, *high)


def built(tmp_path, near, roads=(), text=None, radius=50.0):
    place = SiteDescription(near=near, radius=radius, level=tuple(roads))
    return finish(site_model(read_text(tmp_path, text or underpass()), place))


def corners(model, *roles):
    """Return the corners (n, 3, 3), map coordinates, of faces in any of the roles; kerbs have none here."""
    return model.origin + np.concatenate(
        [
            part.solid.vertices[np.array([face[:3] for face in part.solid.faces])] + part.foot
            for part in model.parts
            if set(part.roles) & set(roles)
        ]
    )


def heights(model, *roles):
    return corners(model, *roles)[:, :, 2]


@pytest.mark.parametrize(("near", "roads", "z"), [((-40, 0), (), 0), ((0, 40), (), DECK), ((0, 0), ("2",), 0), ((0, 0), ("5",), DECK)])  # fmt: skip  # noqa: E501
def test_road_ground_and_posts_are_all_on_one_level(tmp_path, near, roads, z):
    model = built(tmp_path, near, roads)
    assert model.origin[2] == z
    np.testing.assert_allclose(heights(model, Role.ROADS, Role.CANDIDATE_AREAS, Role.REGION), z, atol=0.1)
    lower = {OTHER_LEVELS, "Retaining walls"}
    ground = [part for part in model.parts if Role.GROUND in part.roles and part.name not in lower]
    assert np.abs(np.concatenate([part.solid.vertices[:, 2] for part in ground]) + model.origin[2] - z).max() < 0.5
    across = 1 if z == 0 else 0
    assert model.region.bounds[across] == pytest.approx(-3.5 - model.origin[across], abs=0.1)
    assert any("is on another level" in note for note in model.notes)


def test_the_road_above_is_in_the_way_and_the_one_below_is_ground(tmp_path):
    below, above = built(tmp_path, (-40, 0)), built(tmp_path, (0, 40))
    (deck,) = [part for part in below.parts if part.name == "Roads above"]
    assert deck.roles == (Role.OCCLUDERS,)
    np.testing.assert_allclose(deck.solid.vertices[:, 2], DECK, atol=1e-6)
    (street,) = [part for part in above.parts if part.name == OTHER_LEVELS]
    assert street.roles == (Role.GROUND,)
    np.testing.assert_allclose(street.solid.vertices[:, 2], -DECK, atol=1e-6)


def test_a_crossing_in_the_middle_of_the_place_is_refused_by_name(tmp_path):
    with pytest.raises(SeipError, match=r"road 5 lies 6\.0 m above road 2 at \(0, 0\).*level 5 or level 2"):
        built(tmp_path, (0, 0))
    with pytest.raises(SeipError, match="no road '9' at this place"):
        built(tmp_path, (0, 0), ("9",))


def test_a_ramp_belongs_to_the_level_that_it_leaves(tmp_path):
    """It climbs from the end of road 1 beside the street to the bridge's road 4: most of it is nearer to road 1."""
    ramp = road(
        geometry(length=90.0, x=-30.0, y=-4.0, hdg=-np.pi / 2 + 0.3), LANES, number="8",
        elevation=f'<elevation s="0" a="0" b="{DECK / 90}" c="0" d="0"/>',
    )  # fmt: skip
    text = underpass().replace("</OpenDRIVE>", f"{ramp}</OpenDRIVE>")
    model = built(tmp_path, (-40, 0), text=text)
    middles = corners(model, Role.ROADS).mean(axis=1)
    assert middles[:, 2].min() == pytest.approx(0, abs=0.1)
    assert middles[:, 2].max() > 3.0
    on_bridge = (np.abs(middles[:, 0]) < 3.4) & (np.abs(middles[:, 1]) < 70) & (np.abs(middles[:, 1]) > 4)
    assert not on_bridge.any()


@pytest.mark.slow
@pytest.mark.skipif(not MAPS.is_dir(), reason="the maps of other projects are not here; set SEIP_MAPS to their folder")
@pytest.mark.parametrize(("near", "roads", "z"), [((-190, -1), (), 0), ((-236, 40), (), 10), ((-236, -1), ("3",), 0)])
def test_the_bridge_of_a_real_town_makes_no_curtain(near, roads, z):
    model = finish(site_model(read_map(MAPS / "Town05.xodr"), SiteDescription(near=near, radius=60.0, level=roads)))
    surface = [part for part in model.parts if part.name in {"Driving lanes", "Shoulders", "Verge", "Verge strip"}]
    for part in surface:
        np.testing.assert_allclose(part.solid.vertices[:, 2] + model.origin[2], z, atol=0.3)


def test_where_a_street_to_the_other_level_branches_off_the_surface_is_studied(tmp_path):
    """Road 2 climbs from road 1 to a bridge; road 4 turns off road 1 on to road 6, which leads beneath the bridge."""
    climb = road(
        geometry(length=90.0, x=-30.0, y=0.0), LANES, number="2",
        elevation=f'<elevation s="0" a="0" b="{DECK / 90}" c="0" d="0"/>',
    )  # fmt: skip
    turn = street("4", -45, 0, 30, -0.35)
    end = np.array([-45 + 30 * np.cos(0.35), -30 * np.sin(0.35)])
    beneath = street("6", *end, 130, 0.0961)
    text = document(street("1", -90, 0, 60), climb, street("3", 60, 0, 60, z=DECK), turn, beneath)
    model = built(tmp_path, (-60, 0), text=text, radius=170.0)
    assert any("road 6" in note and "the lower one is on another level" in note for note in model.notes)
    where = {part.name: part.solid.vertices + model.origin for part in model.parts}
    assert where[OTHER_LEVELS][:, 0].min() == pytest.approx(end[0], abs=2.0)
    assert where["Driving lanes"][:, 1].min() < end[1]
    above = where.get("Roads above", np.full((1, 3), DECK))
    assert above[:, 2].min() > 5.0  # nothing hangs at knee height over the studied road


def test_a_site_of_roads_that_all_climb_is_built(tmp_path):
    """No road is level: none shares the surface of another."""
    hump = (
        f'<elevation s="0" a="0" b="{DECK / 80}" c="0" d="0"/><elevation s="80" a="{DECK}" b="0" c="0" d="0"/>'
        f'<elevation s="120" a="{DECK}" b="{-DECK / 80}" c="0" d="0"/>'
    )
    bridge = road(geometry(length=200.0, x=-100.0, y=0.0), LANES, number="1", elevation=hump)
    model = built(tmp_path, (0, 0), ("1",), document(bridge, street("2", 0, -100, 200, np.pi / 2)), radius=80.0)
    assert any("road 1 lies 6.0 m above road 2" in note for note in model.notes)


def test_roads_that_cross_beyond_the_scene_and_not_in_it_are_built(tmp_path):
    """Parts of both lie in the scene, on land of known height, but their crossing does not."""
    low = street("1", -52, 0, 52), street("4", -88, 0, 100, math.atan2(60, 23))
    text = document(*low, street("5", -58, 12, 90, math.atan2(48, -7), z=DECK))
    place = SiteDescription(near=(0.0, 0.0), radius=50.0, level=("1", "4"), relief=level_land(0.0))
    model = finish(site_model(read_text(tmp_path, text), place))
    assert model.region.area > 300
