"""The place that a map offers where none is chosen, and its junctions that are a place to work on."""

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.world.streetscape.description import SiteDescription
from tests.builders.map_models import site_model
from tests.builders.opendrive_text import document, geometry, read_text, road


def test_the_middle_lies_on_a_road(tmp_path):
    angle = [road(geometry(length=200.0)), road(geometry(length=80.0, hdg=np.pi / 2), number="2")]
    x, y = read_text(tmp_path, document(*angle)).middle()
    assert (x, y) == pytest.approx((100.0, 0.0), abs=10.0)
    assert y == 0.0


def test_the_title_of_a_site_names_the_map_and_the_junction_that_was_asked_for(tmp_path):
    text = document(road(junction="5"), road(geometry(x=100.0), number="2"), rest='<junction id="5"/>')
    road_map = read_text(tmp_path, text)
    titles = {
        place: finish(site_model(road_map, SiteDescription(**dict(place)))).name
        for place in ((("junction", "5"),), (("near", (50.0, 0.0)),), (("junction", "5"), ("name", "Mill Lane")))
    }
    assert list(titles.values()) == ["map, junction 5", "map", "Mill Lane"]
