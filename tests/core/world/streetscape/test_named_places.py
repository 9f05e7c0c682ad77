"""Streets and crossings of a map by name."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.world.streetscape.description import SiteDescription
from tests.builders.map_models import site_model
from tests.builders.opendrive_text import read_text
from tests.builders.street_map import street_map

CROSSWALK = '<object id="5" type="crosswalk" {name}s="80" t="0" hdg="0" length="4" width="7" orientation="none"/>'


@pytest.fixture
def places(tmp_path):
    def places(**how):
        road_map = read_text(tmp_path, street_map(**how))
        model = finish(site_model(road_map, SiteDescription(near=(0.0, 0.0), radius=60.0)))
        return {place.name: place.polygon for place in model.places}, model

    return places


def test_roads_without_a_name_are_called_after_their_ids_and_junctions_are_none_of_them(places):
    found, model = places()
    assert list(found) == ["Road 1", "Road 3"]
    for area in found.values():
        assert area.area == pytest.approx(50 * 7, rel=0.02)
        assert shapely.difference(area, model.region.buffer(0.01)).area == 0


@pytest.mark.parametrize(("name", "called"), [('name="School crossing" ', "School crossing"), ("", "Crossing 5")])
def test_painted_crossings_are_where_the_map_has_them(places, name, called):
    found, _ = places(furniture=CROSSWALK.format(name=name))
    assert list(found) == ["Road 1", "Road 3", called]
    assert found[called].symmetric_difference(shapely.box(-32, -3.5, -28, 3.5)).area < 0.3


def test_several_crossings_of_one_street_are_told_apart_by_their_arm(tmp_path):
    text = street_map(furniture="".join(CROSSWALK.format(name="").replace('"80"', f'"{s}"') for s in (60, 80)))
    text = text.replace('<road name="" id="1"', '<road name="Mill Lane" id="1"')
    road_map = read_text(tmp_path, text)
    roads = tuple(replace(one, name="Mill Lane") for one in road_map.roads)
    first = road_map.objects[0]
    east = replace(first, position=first.position + np.array([80.0, 0.0, 0.0]))
    road_map = replace(road_map, roads=roads, objects=(*road_map.objects, east))
    model = finish(site_model(road_map, SiteDescription(near=(0.0, 0.0), radius=60.0)))
    found = {place.name: place.polygon.centroid.x for place in model.places}
    assert found == {
        "Mill Lane": pytest.approx(0.0, abs=1.0),
        "Crossing of Mill Lane, west arm": pytest.approx(-30.0, abs=0.1),
        "Crossing of Mill Lane, west arm (2)": pytest.approx(-50.0, abs=0.1),
        "Crossing of Mill Lane, east arm": pytest.approx(30.0, abs=0.1),
    }


def test_the_crossings_of_two_carriageways_are_one(tmp_path):
    halves = "".join(
        f'<object id="{number}" type="crosswalk" s="80" t="{t}" hdg="0" length="4" width="2.5"/>'
        for number, t in ((5, 2), (6, -2))
    )
    text = street_map(furniture=halves)
    road_map = read_text(tmp_path, text)
    road_map = replace(road_map, roads=tuple(replace(one, name="Mill Lane") for one in road_map.roads))
    model = finish(site_model(road_map, SiteDescription(near=(0.0, 0.0), radius=60.0)))
    found = {place.name: place.polygon.area for place in model.places}
    assert found["Crossing of Mill Lane"] == pytest.approx(4 * 5, rel=0.02)
    assert len(found) == 2
