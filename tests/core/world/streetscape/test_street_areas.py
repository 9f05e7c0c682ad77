"""Areas of the streets of an extract: one carriageway, pavements where people walk, and links in the region."""

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.site.roles import Role
from seip_addon.core.workflows.site_building import SiteRequest, build_site
from tests.builders.osm_text import JUNCTIONS, Extract
from tests.few import few
from tests.oracles.face_areas import plan
from tests.sumo_here import needs_sumo

pytestmark = needs_sumo
SEAM = 0.05  # metres


def built(extract, tmp_path):
    path = extract.write(tmp_path / "place.osm")
    return finish(build_site(path, SiteRequest(near_latlon=(extract.latitude, extract.longitude)))).model


def area(model, *names):
    return plan([part for part in model.parts if part.name.startswith(names)])


def crossroads(**tags):
    extract = Extract(52.5, 15.0)  # where the map's north is north
    extract.way(
        [(-250, 0), (0, 0), (30, 0), (250, 0)], **({"highway": "secondary", "name": "East Road", "lanes": 2} | tags)
    )
    extract.way([(0, -200), (0, 0)], highway="residential", name="South Road")
    return extract


@pytest.mark.parametrize("name", few(JUNCTIONS, 3))
def test_carriageway_is_one_piece_and_contains_the_region(tmp_path, name):
    model = built(JUNCTIONS[name](), tmp_path)
    roads = plan([part for part in model.parts if Role.ROADS in part.roles]).buffer(SEAM)
    (around,) = [part for part in shapely.get_parts(roads) if part.intersects(model.region)]
    assert model.region.difference(around).area < 0.5
    posts = plan([part for part in model.parts if Role.CANDIDATE_AREAS in part.roles])
    assert posts.intersection(around.buffer(-2 * SEAM)).area < 1e-3


def test_no_pavement_is_assumed_between_a_track_and_the_carriageway(tmp_path):
    extract = crossroads(sidewalk="both")
    extract.way([(-250, 9), (250, 9)], railway="tram")
    model = built(extract, tmp_path)
    north = shapely.box(-70, 0, 70, 20)
    assert area(model, "Pavements").intersection(north).is_empty
    assert area(model, "Pavements").intersection(shapely.box(20, -20, 70, 0)).area > 100


def test_tram_is_not_a_street(tmp_path):
    extract = JUNCTIONS["tram"]()
    extract.way([(-200, 9), (200, 9)], railway="tram", name="Line 41")
    model = built(extract, tmp_path)
    assert model.name == "East Road / North Road"
    assert [place.name for place in model.places if place.street] == ["East Road", "North Road"]
    assert [place.name for place in model.places if place.track] == ["Tram track"]
    crossings = [place.name for place in model.places if place.crossing]
    assert sum(name.startswith("Crossing of East Road") for name in crossings) == 2
    assert all("Road" in name for name in crossings)


def test_no_pavement_and_no_place_for_posts_lies_in_a_building(tmp_path):
    extract = crossroads()
    extract.house(30, 4, 20, 20)
    model = built(extract, tmp_path)
    house = area(model, "Building")
    assert house.area > 300
    assert area(model, "Pavements", "Verge strip").intersection(house).area < 0.01


def test_a_link_whose_ends_lie_in_the_region_belongs_to_it(tmp_path):
    extract = Extract(52.5, 15.0)
    extract.way([(-250, 0), (-45, 0), (0, 0), (250, 0)], highway="primary", name="East Road", lanes=4)
    extract.way([(0, 200), (0, 0), (0, -60), (0, -200)], highway="primary", name="North Road", lanes=2)
    extract.way([(-45, 0), (-30, -14), (0, -60)], highway="primary_link", oneway="yes")
    region = built(extract, tmp_path).region
    ends = [shapely.Point(x, y) for x, y in ((-24, -23), (-18, -32), (-12, -42))]
    assert max(region.distance(point) for point in ends) < 1.5
    assert any(shapely.Polygon(ring).area > 300 for ring in region.interiors)


def test_pavements_meet_the_ends_of_a_crossing(tmp_path):
    extract = crossroads()
    extract.way([(30, 12), (30, 0), (30, -12)], highway="footway", footway="crossing")
    model = built(extract, tmp_path)
    (crossing,) = [place.polygon for place in model.places if place.crossing and place.polygon.centroid.x > 20]
    walked = area(model, "Pavements").buffer(SEAM)
    x = crossing.centroid.x
    for y in crossing.bounds[1::2]:
        assert walked.distance(shapely.Point(x, y)) < 0.2
    assert np.ptp(crossing.bounds[1::2]) == pytest.approx(6.4, abs=0.1)


def test_posts_keep_off_islands_that_are_wider_than_a_median(tmp_path):
    extract = crossroads()
    extract.way(
        [(60, 0), (80, 9), (110, 9), (130, 0)], highway="secondary", name="East Road", oneway="yes", sidewalk="no"
    )
    extract.way([(75, 4), (115, 4)], highway="footway", footway="sidewalk")
    model = built(extract, tmp_path)
    islands = [part for part in model.parts if part.keep_off == "islands"]
    assert plan(islands).contains(shapely.Point(95, 4.5))


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
