"""Numbers of a map or description that no place on Earth has are refused, each by its name."""

import time
import tracemalloc

import numpy as np
import pytest
import shapely

from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from seip_addon.core.site.roles import Role
from seip_addon.core.world.streetscape.description import SiteDescription, describe_place, read_site_description
from seip_addon.core.world.streetscape.model import site_model
from tests.builders.opendrive_text import document, geometry, lane, read_text, road, section
from tests.builders.street_map import street_map

HERE = SiteDescription(near=(50.0, 0.0))
HOUSE = '<object id="5" type="building" name="house" s="80" t="{t}" zOffset="{z}" hdg="0" {size}>{inside}</object>'


def outline(*corners, height=9.0):
    points = "".join(f'<cornerLocal u="{u}" v="{v}" z="0" height="{height}"/>' for u, v in corners)
    return f"<outline>{points}</outline>"


def house(size='height="9" length="9" width="9"', inside="", t=20, z=0):
    return HOUSE.format(size=size, inside=inside, t=t, z=z)


@pytest.mark.parametrize(
    ("sections", "junction"), [("", "-1"), (section(), "-1"), (section(lane(-1, 0.0)), "-1"), (section(), "7")]
)
def test_a_map_without_the_area_of_a_lane_is_refused(tmp_path, sections, junction):
    text = document(road(sections=sections, junction=junction), rest='<junction id="7"/>')
    place = HERE if junction == "-1" else SiteDescription(junction="7")
    with pytest.raises(SeipError, match="'map' has no lane with an area"):
        finish(site_model(read_text(tmp_path, text), place))


@pytest.mark.parametrize("kind", ["none", "sidewalk"])
@pytest.mark.parametrize("place", [{"junction": "7"}, {"junction": "7", "radius": 30.0}, {"near": (50, 0)}])
def test_a_junction_without_driving_lanes_is_named(tmp_path, kind, place):
    text = document(road(sections=section(lane(-1, 3.0, kind)), junction="7"), rest='<junction id="7"/>')
    with pytest.raises(SeipError, match=r"there is no driving lane .*; the nearest junctions are 7 at"):
        finish(site_model(read_text(tmp_path, text), SiteDescription(**place)))


@pytest.mark.parametrize(
    ("furniture", "complaint"),
    [
        (house(inside=outline((0, 0), (9, 0), (9, 200_000))), r"object 5: v=200000 of <cornerLocal> is beyond 5000 m"),
        (house(inside=outline((0, 0), (9, 0), (9, 9), height=1e6)), r"height=1e\+06 of <cornerLocal> is beyond 1000 m"),
        (house('height="1000000" length="9" width="9"'), r"height=1e\+06 of <object> is beyond 1000 m"),
        (house('height="9" length="200000" width="9"'), r"length=200000 of <object> is beyond 5000 m"),
        (house(t=200_000), r"t=200000 of <object> is beyond 5000 m"),
        (house(z=1e6), r"zOffset=1e\+06 of <object> is beyond 1000 m"),
        (house(inside='<repeat s="0" length="9" distance="3" heightEnd="1e5"/>'), "heightEnd=100000 of <repeat>"),
    ],
)
def test_what_no_object_measures_is_named(tmp_path, furniture, complaint):
    with pytest.raises(SeipError, match=rf"road 1, .*{complaint}"):
        read_text(tmp_path, street_map(furniture=furniture))


STRAY = '<paramPoly3 aU="0" bU="{b}" cU="0" dU="0" aV="0" bV="0" cV="0" dV="0" pRange="normalized"/>'


@pytest.mark.parametrize(
    ("plan", "complaint"),
    [
        (geometry(STRAY.format(b=-1_000_000), 20.0), "<paramPoly3> of 20 m reaches 1,000,000 m"),
        (geometry(STRAY.format(b=-32_769), 20.0), "<paramPoly3> of 20 m reaches 32,769 m"),
        (geometry('<poly3 a="90000" b="0" c="0" d="0"/>', 20.0), "<poly3> of 20 m reaches 90,000 m"),
        (geometry(length=20.0) + geometry(s=20.0, x=1e6, length=20.0), "at s=20 begins 1,000,000 m from"),
    ],
)
def test_a_road_farther_from_its_start_than_its_length_is_named(tmp_path, plan, complaint):
    tracemalloc.start()
    with pytest.raises(SeipError, match=rf"road 1: .*{complaint}"):
        read_text(tmp_path, document(road(plan)))
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()


def test_roads_of_a_junction_far_from_each_other_are_named(tmp_path):
    far = road(geometry(x=1e6), number="2", junction="7")
    text = document(road(junction="7"), far, rest='<junction id="7"/>')
    with pytest.raises(SeipError, match=r"road 2 lies 1,000,000 m from road 1"):
        finish(site_model(read_text(tmp_path, text), SiteDescription(junction="7")))


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"offset": '<laneOffset s="0" a="1e6" b="0" c="0" d="0"/>'}, r"lies 1,000,00\d m beside the road"),
        ({"elevation": '<elevation s="0" a="1e8" b="0" c="0" d="0"/>'}, r"100,000,000 m above or below zero"),
        ({"elevation": '<elevation s="0" a="0" b="1e6" c="0" d="0"/>'}, r"m above or below zero"),
        ({"sections": section(lane(-1, 1e6))}, r"a lane is 1,000,000 m wide"),
    ],
)
def test_where_no_road_lies_is_named(tmp_path, options, complaint):
    with pytest.raises(SeipError, match=rf"road 1, lane section at s=0: .*{complaint}"):
        finish(site_model(read_text(tmp_path, document(road(**options))), HERE))


def test_the_largest_building_is_built_soon_and_the_ground_ends_near(tmp_path):
    """The largest that is accepted: 5 km on each side and 1,000 m high, and a fence as long as the map."""
    wall = '<object id="6" type="barrier" name="fence" s="0" t="9" height="2"><repeat s="0" length="90" distance="0"/></object>'  # noqa: E501
    text = street_map(furniture=house('height="1000" length="5000" width="5000"', t=4000) + wall)
    tracemalloc.start()
    start = time.process_time()
    model = finish(site_model(read_text(tmp_path, text), SiteDescription(near=(-30.0, 0.0), radius=30.0)))
    assert time.process_time() - start < 20
    assert tracemalloc.get_traced_memory()[1] < 200e6
    tracemalloc.stop()
    ground = np.concatenate([part.solid.vertices for part in model.parts if Role.GROUND in part.roles])
    assert np.abs(ground[:, :2]).max() < 500


def test_a_long_fence_does_not_spread_the_ground_over_the_map(tmp_path):
    long = road(geometry(length=60_000.0), section(lane(-1)), objects=(
        '<object id="6" type="barrier" name="fence" s="0" t="9" height="2"><repeat s="0" length="60000" distance="0"/>'
        "</object>"
    ))  # fmt: skip
    model = finish(site_model(read_text(tmp_path, document(long)), HERE))
    verge = next(part for part in model.parts if part.name == "Verge")
    assert np.abs(verge.solid.vertices[:, :2]).max() < 1000


@pytest.mark.parametrize(
    ("table", "complaint"),
    [
        (
            "[[building]]\noutline = [[0, 9], [9, 9], [9, 19]]\nheight = 90000",
            "building 1: height must be 0.01 to 1,000 m",
        ),
        ("[[tree]]\nposition = [0, 9]\nheight = 2000", "tree 1: height must be 0.01 to 1,000 m"),
        ("[[street_light]]\nposition = [0, 9]\nheight = 2000", "street_light 1: height must be 0.01 to 1,000 m"),
        ("radius = 6000", "radius must be 0.1 to 5,000 m"),
        ("region = [[0, 0], [12000, 0], [0, 9]]", "region must be at most 10000 m across"),
    ],
)
def test_a_description_has_limits_too(tmp_path, table, complaint):
    path = tmp_path / "site.toml"
    path.write_text(table, encoding="utf-8")
    with pytest.raises(SeipError, match=complaint):
        read_site_description(path)
    if table.startswith("radius"):
        with pytest.raises(SeipError, match=r"must be 0\.1 to 5,000 m"):
            describe_place(tmp_path / "map.xodr", near=(0.0, 0.0), radius=6000.0)


def test_limits_leave_real_places_alone(tmp_path):
    """A wood of 2 km, a tower of 800 m, a road at 5,000 m."""
    wood = house(inside=outline((0, 0), (2000, 0), (2000, 1500), (0, 1500), height=25), t=20)
    read_text(tmp_path, street_map(furniture=wood + house('height="828" radius="40"', t=-200)))
    high = road(elevation='<elevation s="0" a="5000" b="0" c="0" d="0"/>')
    model = finish(site_model(read_text(tmp_path, document(high)), HERE))
    assert model.origin[2] == 5000
    assert shapely.area(model.region) > 300
