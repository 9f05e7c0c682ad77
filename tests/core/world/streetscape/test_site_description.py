import math
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.site.roles import Role
from seip_addon.core.world.streetscape.description import SiteDescription
from seip_addon.core.world.streetscape.site_file import describe_place, read_site_description
from tests.builders.map_models import site_model
from tests.builders.opendrive_text import document, geometry, lane, read_text, road, section
from tests.builders.street_map import street_map

FULL = """
name = "Crossing"
map = "maps/crossing.xodr"
near = [10, -20.5]
radius = 60

[[weighted_region]]
junction = "7"
weight = 3

[[weighted_region]]
name = "Box"
polygon = [[0, 0], [4, 0], [4, 4]]

[[building]]
outline = [[0, 0], [10, 0], [10, 5], [0, 5]]
height = 12

[[tree]]
from = [0, 0]
to = [0, 20]
spacing = 9
height = 10

[[wall]]
line = [[0, 0], [5, 0]]

[[street_light]]
position = [1, 2]
heading = 90

[[signal_pole]]
position = [3, 4]

[[forbidden_area]]
name = "Church"
polygon = [[0, 0], [1, 0], [1, 1]]

[[mandatory_area]]
polygon = [[0, 0], [1, 0], [1, 1]]
"""


def read(folder: Path, text: str):
    path = folder / "site.toml"
    path.write_text(text, encoding="utf-8")
    return read_site_description(path)


def test_every_key_arrives(tmp_path):
    site = read(tmp_path, FULL)
    assert (site.name, site.map, site.near, site.radius) == (
        "Crossing",
        tmp_path / "maps/crossing.xodr",
        (10.0, -20.5),
        60.0,
    )
    assert [(w.name, w.weight, w.junction) for w in site.weighted_regions] == [
        ("Junction 7", 3.0, "7"),
        ("Box", 2.0, None),
    ]
    assert site.weighted_regions[1].polygon.area == 8.0
    assert (site.buildings[0].outline.area, site.buildings[0].height, site.buildings[0].base) == (50.0, 12.0, 0.0)
    np.testing.assert_allclose(site.trees[0].positions, [[0, 0], [0, 9], [0, 18]])
    assert (site.trees[0].height, site.trees[0].crown_diameter) == (10.0, 6.0)
    assert (site.walls[0].height, site.walls[0].thickness) == (2.0, 0.25)
    assert math.isclose(site.street_lights[0].heading, math.pi / 2)
    assert (site.signal_poles[0].height, site.signal_poles[0].arm, site.signal_poles[0].heading) == (6.0, 5.0, None)
    assert (site.forbidden_areas[0].name, site.mandatory_areas[0].name) == ("Church", "Area")


def test_a_row_ends_on_its_last_whole_step_in_spite_of_rounding(tmp_path):
    row = read(tmp_path, "[[tree]]\nfrom = [0, 0]\nto = [0.9, 0]\nspacing = 0.3\n").trees[0]
    np.testing.assert_allclose(row.positions[:, 0], [0, 0.3, 0.6, 0.9], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("radious = 3", "unknown key 'radious'; did you mean radius"),
        ("[[building]]\noutline = [[0, 0], [1, 0], [1, 1]]\nheigth = 3", "building 1: height is missing"),
        ("[[building]]\noutline = [[0, 0], [1, 0], [1, 1]]\nheight = 3\nhight = 4", "did you mean height"),
        ("radius = -1", "radius must be 0.1 to 5,000 m, not -1"),
        ("radius = nan", "radius must be a number"),
        ("near = [1]", r"near must be a point \[x, y\]"),
        ("name = 3", "name must be a text"),
        ('near = [0, 0]\njunction = "1"', "either near or junction"),
        ("region = [[0, 0], [1, 1]]", "region must be a list of at least three points"),
        ("region = [[0, 0], [2, 2], [2, 0], [0, 2]]", "does not cross itself"),
        ("[[tree]]\nposition = [0, 0]\nheight = 0", "tree 1: height must be 0.01 to"),
        ('[[weighted_region]]\njunction = "1"\nweight = 1e300', "weight must be"),
        ("region = [[0, 0], [1e-9, 0], [0, 1e-9]]", "no area"),
        ("[[tree]]\nfrom = [0, 0]\nto = [1, 0]", "a row with from, to and spacing"),
        ("[[wall]]\nline = [[0, 0]]", "at least two points"),
        ("[[street_light]]\nposition = [0, 0]\narm = -1", "arm must be 0 to"),
        ('[[weighted_region]]\nname = "x"', "either polygon or junction"),
        ("[building]\nheight = 3", r"begins with \[\[building\]\]"),
        ("name = ", "is not valid TOML"),
    ],
)
def test_a_mistake_is_named_with_its_cure(tmp_path, text, complaint):
    with pytest.raises(SeipError, match=complaint) as raised:
        read(tmp_path, text)
    assert "site.toml" in str(raised.value)
    assert "\n" not in str(raised.value).strip()


HOUSE = '<object id="5" type="building" name="house" s="80" t="{t}" zOffset="{z}" hdg="0" {size}>{inside}</object>'


def house(size='height="9" length="9" width="9"', inside="", t=20, z=0):
    return HOUSE.format(size=size, inside=inside, t=t, z=z)


@pytest.mark.parametrize("kind", ["none", "sidewalk"])
@pytest.mark.parametrize("place", [{"junction": "7"}, {"junction": "7", "radius": 30.0}, {"near": (50, 0)}])
def test_a_junction_without_driving_lanes_is_named(tmp_path, kind, place):
    text = document(road(sections=section(lane(-1, 3.0, kind)), junction="7"), rest='<junction id="7"/>')
    with pytest.raises(SeipError, match=r"there is no driving lane .*; the nearest junctions are 7 at"):
        finish(site_model(read_text(tmp_path, text), SiteDescription(**place)))


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


def test_the_largest_building_takes_little_memory_and_the_ground_ends_near(tmp_path):
    """The largest that is accepted: 5 km on each side and 1,000 m high, and a fence as long as the map."""
    wall = '<object id="6" type="barrier" name="fence" s="0" t="9" height="2"><repeat s="0" length="90" distance="0"/></object>'  # noqa: E501
    text = street_map(furniture=house('height="1000" length="5000" width="5000"', t=4000) + wall)
    tracemalloc.start()
    model = finish(site_model(read_text(tmp_path, text), SiteDescription(near=(-30.0, 0.0), radius=30.0)))
    assert tracemalloc.get_traced_memory()[1] < 200e6
    tracemalloc.stop()
    ground = np.concatenate([part.solid.vertices for part in model.parts if Role.GROUND in part.roles])
    assert np.abs(ground[:, :2]).max() < 500


@pytest.mark.parametrize(
    ("table", "complaint"),
    [
        (
            "[[building]]\noutline = [[0, 9], [9, 9], [9, 19]]\nheight = 90000",
            "building 1: height must be 0.01 to 1,000 m",
        ),
        ("[[tree]]\nposition = [0, 9]\nheight = 2000", "tree 1: height must be 0.01 to 1,000 m"),
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
