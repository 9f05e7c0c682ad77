"""Each place of a modelled street has one surface: no pavement in a lane, no two faces in one place."""

import os
from pathlib import Path

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.site.roles import Role
from seip_addon.core.workflows.site_building import SiteRequest, build_site
from seip_addon.core.world.opendrive.lanes import LaneSurface
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.streetscape.description import SiteDescription
from seip_addon.core.world.streetscape.road_surface import roadside, without_gaps
from tests.builders.map_models import site_model
from tests.builders.osm_text import Extract
from tests.builders.street_map import street_map
from tests.oracles.face_areas import check_surfaces, plan
from tests.sumo_here import needs_sumo

ROOT = Path(__file__).resolve().parents[4]
SHARED = Path(os.environ.get("SEIP_MAPS", ROOT.parent / "shared" / "opendrive")).parent
REAL = {
    "osm/neukolln.osm": {"near_latlon": (52.47391, 13.44048)},
    "osm/borough_sausage_links.osm": {"near_latlon": (51.50103, -0.09301)},
    "osm/northgate_dual_carriageway.osm": {"near_latlon": (47.70856, -122.32636)},
    "osm/taipei.osm": {"near_latlon": (25.05217, 121.52256)},
    "osm/perth_stretched_lights.osm": {"near_latlon": (-31.97471, 115.89771)},
    "opendrive/Town05.xodr": {"near": (-49.0, -1.0)},
    "opendrive/Town01.xodr": {"anywhere": True},
}


@needs_sumo
def test_surfaces_of_the_shipped_extract_lie_beside_each_other():
    asked = SiteRequest(junction=("Harbour Road", "Rope Lane"))
    check_surfaces(finish(build_site(ROOT / "scenes" / "harbour.osm", asked)).model)


@pytest.mark.slow
@needs_sumo
@pytest.mark.parametrize("name", REAL)
def test_surfaces_of_real_places_lie_beside_each_other(name):
    source = SHARED / name
    if not source.is_file():
        pytest.skip(f"{source} is not beside the project")
    check_surfaces(finish(build_site(source, SiteRequest(**REAL[name]))).model)


def test_a_lane_that_overlaps_another_road_gives_way(tmp_path):
    path = tmp_path / "street.xodr"
    text = street_map(lane_types=("driving", "sidewalk"))
    beside = street_map(y=6.0, lane_types=("driving",)).replace('id="1"', 'id="11"').replace('id="3"', 'id="13"')
    roads = [part for part in beside.split("<road ")[1:] if part.startswith(('id="11"', 'id="13"'))]
    path.write_text(
        text.replace("<junction ", "".join(f"<road {road.split('<junction')[0]}" for road in roads) + "<junction "),
        encoding="utf-8",
    )
    path.write_text(path.read_text().replace("</OpenDRIVE></OpenDRIVE>", "</OpenDRIVE>"), encoding="utf-8")
    model = finish(site_model(read_map(path), SiteDescription(near=(0.0, 0.0), radius=60.0)))
    check_surfaces(model)
    roads = plan([part for part in model.parts if Role.ROADS in part.roles])
    assert shapely.contains_xy(roads, *(np.array([[-40.0, 5.0]]) - model.origin[:2]).T).all()


@needs_sumo
@pytest.mark.parametrize("away", [4.0, 8.0])
def test_a_mapped_sidewalk_is_the_pavement(tmp_path, away):
    extract = Extract(52.5, 15.0)  # where the map's north is north
    extract.way([(-200, 0), (0, 0), (200, 0)], highway="secondary", name="East Road", lanes=2)
    extract.way([(0, -200), (0, 0)], highway="residential", name="South Road")
    extract.way([(-90, 3.2 + away), (90, 3.2 + away)], highway="footway", footway="sidewalk", width="2")
    site = finish(build_site(extract.write(tmp_path / "place.osm"), SiteRequest(near_latlon=(52.5, 15.0))))
    walked = plan([part for part in site.model.parts if part.name.startswith("Pavements")])
    driven = plan([part for part in site.model.parts if part.name == "Driving lanes"])
    for x in range(-70, 71, 10):
        north = shapely.LineString([(x, 0), (x, 30)])
        kerb, (low, high) = driven.intersection(north).bounds[3], walked.intersection(north).bounds[1::2]
        assert (low - kerb, high - kerb) == pytest.approx((away - 1.0, away + 1.0), abs=0.1)
    assert not [part for part in site.model.parts if part.name == "Verge strip"]


def strip(low_x, low_y, high_x, high_y, lane_type="driving", road="1"):
    """Return a lane of a junction over a rectangle."""
    xs = np.array([low_x, high_x], dtype=float)
    left, right = (np.column_stack([xs, np.full(2, y), np.zeros(2)]) for y in (high_y, low_y))
    return LaneSurface(road, "7", 0, -1, lane_type, False, xs - low_x, left, right)


def around(size):
    """Return lanes around a square gap."""
    return (
        strip(-10, size, 10, size + 4),
        strip(-10, -4, 10, 0, road="2"),
        strip(-10, 0, 0, size, road="3"),
        strip(size, 0, 10, size, road="4"),
    )


@pytest.mark.parametrize(("size", "filled"), [(1.5, True), (3.0, False)])
def test_a_small_gap_between_the_lanes_of_a_junction_is_no_island(size, filled):
    lanes = around(size)
    gap = shapely.box(0, 0, size, size)
    assert without_gaps(roadside(lanes), lanes).contains(gap.centroid) is filled
    median = strip(0, 0, size, size, "median", "5")
    assert not without_gaps(roadside(lanes), (*lanes, median)).contains(gap.centroid)
