"""Crossings of the extract in the map of its streets, in place of those that netconvert guesses."""

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.workflows.site_building import SiteRequest, build_site
from tests.builders.osm_text import Extract, corner_houses
from tests.sumo_here import needs_sumo

pytestmark = needs_sumo
ORIGIN_ROUNDING = 0.8  # metres: local origins are whole metres of the map


def streets(*, crossing=None, footway=False):
    """Return a crossing of two streets, and a node or a footway across the eastern one."""
    extract = Extract(52.5, 15.0)  # where the map's north is north
    usual = {"lanes": 2, "maxspeed": "30"}
    east = [(0, 0), (30, 0), (200, 0)]
    if crossing is not None:
        east[1] = extract.node(30, 0, **crossing)
    extract.way([(-200, 0), *east], highway="secondary", name="East Road", **usual)
    extract.way([(0, -200), (0, 0), (0, 200)], highway="secondary", name="North Road", **usual)
    if footway:
        extract.way([(30, 12), (30, 0), (30, -12)], highway="footway", footway="crossing", width="3")
    return corner_houses(extract)


def built(extract, tmp_path):
    path = extract.write(tmp_path / "place.osm")
    return finish(build_site(path, SiteRequest(near_latlon=(extract.latitude, extract.longitude))))


def crossings(site):
    return {place.name: place.polygon for place in site.model.places if place.name.startswith("Crossing")}


@pytest.mark.parametrize(
    ("how", "depth"),
    [
        ({"crossing": {"highway": "crossing"}}, 4.0),
        ({"crossing": {"highway": "crossing", "width": "6"}}, 6.0),
        ({"footway": True}, 3.0),
    ],
)
def test_the_extract_s_crossings_replace_guessed_ones(tmp_path, how, depth):
    site = built(streets(**how), tmp_path)
    ((name, area),) = crossings(site).items()
    assert name == "Crossing of East Road"
    assert area.area == pytest.approx(6.4 * depth, rel=0.03)
    assert area.centroid.distance(shapely.Point(30, 0)) < ORIGIN_ROUNDING
    x, y = np.ptp(shapely.get_coordinates(area), axis=0)
    assert (x, y) == pytest.approx((depth, 6.4), abs=0.2)
    assert not any("crossings of pedestrians" in note for note in site.model.notes)


def test_a_crossing_within_the_map_s_junction_lies_where_the_extract_has_it(tmp_path):
    extract = Extract(52.5, 15.0)
    node = extract.node(9, 0, highway="crossing")
    extract.way([(-200, 0), (0, 0), node, (200, 0)], highway="secondary", name="East Road", lanes=2)
    extract.way([(0, -200), (0, 0), (0, 200)], highway="secondary", name="North Road", lanes=4)
    ((_, area),) = crossings(built(corner_houses(extract), tmp_path)).items()
    assert area.centroid.distance(shapely.Point(9, 0)) < ORIGIN_ROUNDING
    assert area.area == pytest.approx(4 * 6.4, abs=1.0)
