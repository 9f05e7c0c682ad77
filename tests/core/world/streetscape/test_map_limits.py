"""Numbers of a map or description that no place on Earth has are refused, each by its name."""

import time
import tracemalloc

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
