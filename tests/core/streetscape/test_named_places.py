"""Streets and crossings of a map by name."""

import pytest
import shapely
from opendrive_text import read_text
from street_map import street_map

from seip_addon.core.progress import finish
from seip_addon.core.streetscape.description import SiteDescription
from seip_addon.core.streetscape.model import site_model

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


def test_what_lies_outside_the_region_is_left_out(places):
    found, _ = places(furniture=CROSSWALK.format(name="").replace('s="80"', 's="5"'))
    assert list(found) == ["Road 1", "Road 3"]
