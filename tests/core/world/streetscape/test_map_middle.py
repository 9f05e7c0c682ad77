"""The place that a map offers where none is chosen, and its junctions that are a place to work on."""

import numpy as np
import pytest
import shapely

from seip_addon.core.progress import finish
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.streetscape.description import SiteDescription, describe_place
from seip_addon.core.world.streetscape.model import site_model
from seip_addon.core.world.streetscape.road_surface import _line
from tests.builders.opendrive_text import document, geometry, read_text, road
from tests.builders.street_map import street_map


def test_the_middle_lies_on_a_road(tmp_path):
    angle = [road(geometry(length=200.0)), road(geometry(length=80.0, hdg=np.pi / 2), number="2")]
    x, y = read_text(tmp_path, document(*angle)).middle()
    assert (x, y) == pytest.approx((100.0, 0.0), abs=10.0)
    assert y == 0.0


def test_the_middle_of_a_street_is_its_middle(tmp_path):
    path = tmp_path / "street.xodr"
    path.write_text(street_map(x=1000.0, y=-50.0), encoding="utf-8")
    road_map = read_map(path)
    assert road_map.middle() == pytest.approx((1000.0, -50.0), abs=5.0)
    _, description = describe_place(path, near=road_map.middle(), radius=30.0)
    assert finish(site_model(road_map, description)).region.area > 300


def test_junctions_without_roads_are_left_out(tmp_path):
    text = document(road(junction="5"), road(number="2"), rest='<junction id="5" name="A"/><junction id="6" name="B"/>')
    assert [each.id for each in read_text(tmp_path, text).junctions_with_roads()] == ["5"]


def test_the_title_of_a_site_names_the_map_and_the_junction_that_was_asked_for(tmp_path):
    text = document(road(junction="5"), road(geometry(x=100.0), number="2"), rest='<junction id="5"/>')
    road_map = read_text(tmp_path, text)
    titles = {
        place: finish(site_model(road_map, SiteDescription(**dict(place)))).name
        for place in ((("junction", "5"),), (("near", (50.0, 0.0)),), (("junction", "5"), ("name", "Mill Lane")))
    }
    assert list(titles.values()) == ["map, junction 5", "map", "Mill Lane"]


def test_a_line_outside_the_painted_area_is_not_painted():
    edge = np.array([(0.0, 0.0, 0.0), (10.0, 0.0, 0.0)])
    assert _line(edge, shapely.box(11, -1, 20, 1), dashed=True) == []
