"""The region about a junction follows its approaches along the road, and takes nothing of streets behind."""

import math
import os
from pathlib import Path

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.streetscape.description import SiteDescription
from tests.builders.map_models import site_model
from tests.builders.opendrive_text import document, geometry, lane, read_text, road, section

MAPS = Path(os.environ.get("SEIP_MAPS") or Path(__file__).resolve().parents[5] / "shared" / "opendrive")
LANES = section(lane(1), lane(-1))
JUNCTIONS = '<junction id="7" name="first"/><junction id="8" name="second"/>'


def region(tmp_path, text, **place):
    """Return the region in map coordinates."""
    place = {"junction": "7"} | place
    model = finish(site_model(read_text(tmp_path, text), SiteDescription(**place)))
    return shapely.transform(model.region, lambda xy: xy + model.origin[:2])


def straight(number, x, y, length, hdg=0.0, junction="-1", z=0.0, lanes=LANES):
    plan = geometry(length=float(length), x=float(x), y=float(y), hdg=hdg)
    level = f'<elevation s="0" a="{z}" b="0" c="0" d="0"/>'
    return road(plan, lanes, number=str(number), junction=junction, elevation=level)


def town():
    """A street along x through junctions at 0 and 100, one behind it at y = 30, and side streets along y at 100."""
    return document(
        straight(1, -150, 0, 140),
        straight(2, -10, 0, 20, junction="7"),
        straight(3, 10, 0, 80),
        straight(4, 90, 0, 20, junction="8"),
        straight(5, 110, 0, 100),
        straight(6, -150, 30, 300),
        straight(7, 100, 10, 15, np.pi / 2),
        straight(8, 100, -10, 20, np.pi / 2, junction="8"),
        road(geometry('<arc curvature="-0.1"/>', length=5 * math.pi, x=90.0, y=0.0), section(lane(-1)), number="9",
             junction="8"),
        rest=JUNCTIONS,
    )  # fmt: skip


def test_it_ends_at_a_distance_along_the_road(tmp_path):
    expected = shapely.box(-10 - 40, -3.5, 10 + 40, 3.5)
    assert region(tmp_path, town(), approaches=40.0).symmetric_difference(expected).area < 0.1


def test_it_goes_straight_on_through_other_junctions(tmp_path):
    """Not into their side streets, nor along lanes that turn into these."""
    expected = shapely.box(-10 - 120, -3.5, 10 + 120, 3.5)
    assert region(tmp_path, town(), approaches=120.0).symmetric_difference(expected).area < 0.1


def test_it_follows_bends_by_their_length(tmp_path):
    """A quarter of a circle of 40 m, 63 m long, then a straight road: 20 m of it are left of 82.8 m."""
    bend = road(geometry('<arc curvature="0.025"/>', length=20 * math.pi, x=10.0), LANES, number="2")
    on = straight(3, 50, 40, 100, np.pi / 2)
    text = document(straight(1, -10, 0, 20, junction="7"), bend, on, rest=JUNCTIONS)
    found = region(tmp_path, text, approaches=20 * math.pi + 20.0)
    assert found.bounds[3] == pytest.approx(60.0, abs=0.1)
    assert found.area == pytest.approx(7 * (20 + 20 * math.pi + 20), rel=0.01)


def test_it_does_not_climb_onto_a_bridge_over_the_end_of_a_road(tmp_path):
    over = straight(90, 50, -60, 120, np.pi / 2, z=6.0)
    text = town().replace("</OpenDRIVE>", f"{over}</OpenDRIVE>")
    assert region(tmp_path, text, approaches=60.0).bounds == pytest.approx((-70, -3.5, 70, 3.5), abs=0.1)


@pytest.mark.slow
@pytest.mark.skipif(not MAPS.is_dir(), reason="the maps of other projects are not here; set SEIP_MAPS to their folder")
@pytest.mark.parametrize(("name", "junction", "lenses"), [("Town01", "194", 2), ("Town05", "224", 3)])
def test_at_real_junctions_it_is_in_one_piece(name, junction, lenses):
    road_map = read_map(MAPS / f"{name}.xodr")
    along, circle = (
        finish(site_model(road_map, SiteDescription(junction=junction, **size))).region
        for size in ({"approaches": 80.0}, {"radius": 80.0})
    )
    assert len(shapely.get_parts(along)) == 1
    assert len(shapely.get_parts(circle)) == lenses
