"""Where lanes are added the edge of the carriageway widens along the road, with the pavement beside it."""

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.workflows.site_building import SiteRequest, build_site
from tests.builders.osm_text import Extract
from tests.oracles.face_areas import plan
from tests.sumo_here import needs_sumo

pytestmark = needs_sumo
STEP = 2.0
MAX_STEP = 0.4
"""Metres by which an edge may move to the side in two metres along the road: the taper, and 2 % of a turned street."""


def street(tmp_path, *, lanes, one_way=False, left_hand=False):
    """Return the parts of a street along x with a crossing at zero, and other lanes up to 60 m before it."""
    extract = Extract(-31.95, 115.86) if left_hand else Extract()
    usual = {"highway": "primary", "name": "High Street"} | ({"oneway": "yes"} if one_way else {})
    before, after = lanes
    extract.way([(-300, 0), (-60, 0)], lanes=before, **usual)
    extract.way([(-60, 0), (0, 0)], lanes=after, **usual)
    extract.way([(0, 0), (300, 0)], lanes=after, **usual)
    for y in (-200, 200):
        extract.way([(0, y), (0, 0)], highway="residential", name="Mill Lane")
    place = SiteRequest(near_latlon=(extract.latitude, extract.longitude), approaches=150)
    return finish(build_site(extract.write(tmp_path / "place.osm"), place)).model.parts


def across(area, x):
    return area.intersection(shapely.LineString([(x, -40), (x, 40)]))


@pytest.mark.parametrize(
    ("kind", "lanes"),
    [
        ("two ways", (2, 4)),
        pytest.param("two ways", (4, 2), marks=pytest.mark.slow),
        pytest.param("one way", (2, 4), marks=pytest.mark.slow),
        pytest.param("left hand", (2, 4), marks=pytest.mark.slow),
    ],
)
def test_edges_do_not_jog_where_lanes_are_added(tmp_path, kind, lanes):
    parts = street(tmp_path, lanes=lanes, one_way=kind == "one way", left_hand=kind == "left hand")
    driving = plan([part for part in parts if part.name == "Driving lanes"])
    edges = np.array([across(driving, x).bounds for x in np.arange(-110.0, -20.0, STEP)])[:, [1, 3]]
    width = np.ptp(edges, axis=1)
    assert abs(width[-1] - width[0]) > 2.5
    assert np.abs(np.diff(edges, axis=0)).max() < MAX_STEP
    if kind != "one way":  # the pavement on the left of these is a road of its own, and gives way
        walked = plan([part for part in parts if part.name.startswith("Pavements")])
        assert min(across(walked, x).length for x in np.arange(-110.0, -20.0, STEP)) > 3.5


def test_a_street_whose_lanes_stay_the_same_is_left_as_it_is(tmp_path):
    parts = street(tmp_path, lanes=(4, 4))
    driving = plan([part for part in parts if part.name == "Driving lanes"])
    width = [across(driving, x).length for x in np.arange(-110.0, -20.0, STEP)]
    assert np.ptp(width) < 0.01
