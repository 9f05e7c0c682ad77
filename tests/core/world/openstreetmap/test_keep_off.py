"""Ground of an extract that new posts keep off: ways, landings of crossings, private ground."""

import math

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.geo_reference import projection
from seip_addon.core.world.openstreetmap.extract import read_extract
from seip_addon.core.world.openstreetmap.plan_shapes import PlanShapes
from seip_addon.core.world.openstreetmap.street_objects import surroundings
from tests.builders.osm_text import Extract

UTM = projection("+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs")
ORIGIN = np.array(UTM(math.radians(52.5), math.radians(13.4)))
ROAD = shapely.box(-200, -4, 200, 4)


def found(extract, tmp_path):
    shapes = PlanShapes(finish(read_extract(extract.write(tmp_path / "place.osm"))), UTM, ORIGIN)
    return surroundings(shapes, shapely.Point(0, 0).buffer(300), ROAD)


def kept_off(extract, tmp_path, x, y):
    """Return the rules that keep a post off a place in metres."""
    return {
        one.rule
        for one in found(extract, tmp_path).keep_off_areas
        if one.polygon.dwithin(shapely.Point(_plan(extract, x, y)), 0.01)
    }


def _plan(extract, x, y):
    return np.array(UTM(*map(math.radians, extract.place(x, y)))) - ORIGIN


def test_cycle_tracks_and_driveways_count_up_to_the_carriageway(tmp_path):
    extract = Extract()
    extract.way([(-100, 6), (100, 6)], highway="cycleway", width="1.6")
    extract.way([(20, 0), (20, 40)], highway="service", service="driveway")
    assert kept_off(extract, tmp_path, 0, 6.7) == {"cycle-tracks"}
    assert kept_off(extract, tmp_path, 0, 7.3) == set()
    assert kept_off(extract, tmp_path, 21, 8) == {"driveways"}
    assert kept_off(extract, tmp_path, 21, 4.5) == {"driveways"}
    assert kept_off(extract, tmp_path, 23, 8) == set()


def test_a_mapped_crossing_has_landings_wherever_it_ends(tmp_path):
    extract = Extract()
    extract.way([(0, -2), (0, 2)], highway="footway", footway="crossing")
    extract.way([(40, -9), (40, 9)], highway="footway", footway="crossing", width="6")
    for x, y, landing in ((0, 5, True), (1.9, -5.5, True), (2.3, 5, False), (0, 6.5, False), (42.5, 5, True)):
        assert kept_off(extract, tmp_path, x, y) == ({"landings"} if landing else set()), (x, y)


@pytest.mark.parametrize(
    ("tags", "private"),
    [
        ({"leisure": "garden"}, True),
        ({"leisure": "garden", "access": "public"}, False),
        ({"leisure": "garden", "garden__type": "community"}, False),
        ({"landuse": "grass", "access": "private"}, True),
        ({"landuse": "grass"}, False),
        ({"amenity": "parking"}, True),
        ({"amenity": "parking", "access": "yes"}, False),
        ({"leisure": "park"}, False),
        ({"building": "yes", "access": "private"}, False),
        ({"highway": "service", "area": "yes", "access": "private"}, False),
    ],
)
def test_gardens_and_areas_without_access_are_private(tmp_path, tags, private):
    extract = Extract()
    extract.area([(-20, 6), (20, 6), (20, 30), (-20, 30)], **tags)
    assert ("private" in kept_off(extract, tmp_path, 0, 8)) is private


def test_ground_behind_a_fence_is_private_and_a_pavement_behind_a_guard_rail_is_not(tmp_path):
    extract = Extract()
    extract.way([(-50, 6), (0, 6)], barrier="fence")
    extract.way([(10, 4.4), (50, 4.4)], barrier="fence")  # at the kerb
    extract.way([(-50, -6), (50, -6)], barrier="guard_rail")
    assert kept_off(extract, tmp_path, -20, 7) == {"private"}
    assert kept_off(extract, tmp_path, -20, 5.5) == set()
    assert kept_off(extract, tmp_path, 30, 6) == set()
    assert kept_off(extract, tmp_path, 0, -7) == set()
