"""Streets and crossings of an extract in plan."""

import math

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.geo_reference import TransverseMercator
from seip_addon.core.workflows.site_places import site_places
from seip_addon.core.world.openstreetmap.crossings import named_crossings
from seip_addon.core.world.openstreetmap.extract import read_extract
from seip_addon.core.world.openstreetmap.map_links import parsed_position
from seip_addon.core.world.street_plan import plan_of_extract
from tests.builders.osm_text import Extract, crossing

SPHERE = 4e-3
"""Relative difference between lengths on the sphere that extracts are written on and on the ellipsoid."""


def town(latitude=52.5, longitude=13.4):
    """A main street along x, which a tertiary and a residential street cross; a bent street, a drive, and a river."""
    extract = Extract(latitude, longitude)
    for name, kind, x in (("Tertiary Road", "tertiary", -300), ("Side Street", "residential", 400)):
        extract.way([(x, -200), (x, 0), (x, 500)], highway=kind, name=name)
    extract.way([(-1000, 0), (-300, 0)], highway="primary", name="Main Street")
    extract.way([(-300, 0), (400, 0), (1000, 0)], highway="primary", name="Main Street")
    extract.way([(400, 500), (-300, 500)], highway="secondary_link", name="North Link")
    extract.way([(0, 0), (0, 60)], highway="service", name="Drive")
    extract.way([(0, 100), (100, 100)], waterway="river", name="River")
    extract.way([(0, 0), (50, -50)], highway="residential")
    return extract


def read(extract, path):
    found = finish(read_extract(extract.write(path)))
    crossings = named_crossings(found)
    return crossings, plan_of_extract(found, crossings)


@pytest.fixture
def plan(tmp_path):
    return read(town(), tmp_path / "town.osm")


def test_streets_are_in_plan_with_their_importance(plan):
    _, drawn = plan
    assert sorted(one.importance for one in drawn.streets) == [0, 0, 1, 2, 2, 2]
    lengths = sorted(float(np.linalg.norm(np.diff(one.line, axis=0), axis=1).sum()) for one in drawn.streets)
    assert lengths == pytest.approx(sorted([50 * 2**0.5, 700, 700, 700, 700, 1300]), rel=SPHERE)


@pytest.mark.parametrize("latitude", [0.0, 25.0, 52.5, -33.0, 70.0])
@pytest.mark.parametrize("longitude", [13.4, 179.995])
def test_junctions_are_where_a_transverse_mercator_projection_has_them(latitude, longitude, tmp_path):
    crossings, drawn = read(town(latitude, longitude), tmp_path / "town.osm")
    degrees = np.array([(one.latitude, one.longitude) for one in crossings])
    middle = (degrees.min(axis=0) + degrees.max(axis=0)) / 2
    projection = TransverseMercator(*np.radians(middle), 1.0, 0.0, 0.0)
    expected = [projection(math.radians(one.latitude), math.radians(one.longitude)) for one in crossings]
    assert drawn.junctions == pytest.approx(np.array(expected), abs=0.2)


def test_names_stand_along_their_streets_and_pieces_of_one_street_are_one(plan):
    _, drawn = plan
    names = drawn.names
    assert names.names == ("Main Street", "North Link", "Side Street", "Tertiary Road")
    main = names.street == 0
    assert main.sum() == round(2000 / 150)
    assert names.lengths[main] == pytest.approx(2000, rel=SPHERE)
    assert names.angles[main] == pytest.approx(0.0, abs=1e-6)
    assert np.abs(names.angles[names.street == 2]) == pytest.approx(math.pi / 2, abs=1e-6)
    assert names.importance[main].tolist() == [2] * main.sum()
    assert np.all(np.abs(names.angles) <= math.pi / 2)
    on_main = drawn.junctions[:2, 1].mean()
    assert names.positions[main, 1] == pytest.approx(on_main, abs=0.01)


def test_places_of_an_extract_have_a_map(tmp_path):
    places = finish(site_places(crossing().write(tmp_path / "place.osm")))
    assert places.places
    assert len(places.plan.junctions) == len(places.places) == 1
    assert parsed_position(places.places[0].key) == pytest.approx((52.5, 13.4), abs=1e-6)
    assert places.plan.junctions[0] == pytest.approx((0.0, 0.0), abs=1e-6)
    assert places.plan.attribution.startswith("© OpenStreetMap")
