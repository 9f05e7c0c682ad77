"""Latitude and longitude on a map, and files of other formats."""

import gzip
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.geo_reference import projection
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.openstreetmap.site import place_on_map
from seip_addon.core.world.streetscape.description import SiteDescription
from tests.builders.map_models import site_model
from tests.builders.opendrive_text import document, geometry, lane, read_text, road, section

AXIS, ECCENTRICITY = 6_378_137.0, math.sqrt(0.00669437999014)
METRES_OF_BERLIN = "+proj=tmerc +lat_0=52.5 +lon_0=13.4 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m"


def radii(latitude):
    """Return the radii of curvature of WGS 84 along the meridian and across it."""
    root = 1 - (ECCENTRICITY * math.sin(latitude)) ** 2
    return AXIS * (1 - ECCENTRICITY**2) / root**1.5, AXIS / root**0.5


def street(tmp_path, reference, *, x=0.0, y=0.0, offset=""):
    header = f"<header><geoReference>{reference}</geoReference>{offset}</header>"
    street = road(geometry(length=400.0, x=x - 200, y=y), section(lane(1), lane(-1)))
    return read_text(tmp_path, document(street, header=header))


def built(road_map, near):
    return finish(site_model(road_map, SiteDescription(near=near, radius=30.0)))


@pytest.mark.parametrize("offset", [(0.0, 0.0), (4000.0, -3000.0)])
def test_latitude_and_longitude_are_converted_by_the_maps_projection(tmp_path, offset):
    header = f'<offset x="{offset[0]}" y="{offset[1]}" z="0" hdg="0"/>'
    road_map = street(tmp_path, METRES_OF_BERLIN, x=-offset[0], y=-offset[1], offset=header)
    model = built(road_map, place_on_map(road_map, (52.5, 13.402)))
    east = math.radians(0.002) * radii(math.radians(52.5))[1] * math.cos(math.radians(52.5))
    np.testing.assert_allclose(model.origin[:2], [east - offset[0], -offset[1]], atol=1.0)


CITY = b'{"type": "CityJSON", "version": "1.1", "CityObjects": {}}'


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (gzip.compress(b"<OpenDRIVE/>", mtime=0), "town.xodr is compressed with gzip; unpack it"),
        (CITY, "town.xodr is CityJSON, a model of buildings, not OpenDRIVE"),
        (b"\xef\xbb\xbf\n " + CITY, "is CityJSON"),
        (b'{"type": "FeatureCollection"}', "town.xodr is JSON, not OpenDRIVE"),
        (b"PK\x03\x04....", "is a zip archive"),
        (b"BLENDER-v405", "is a .blend file, not a map"),
        (b"<osm version='0.6'/>", "begins with <osm> as extracts of OpenStreetMap do"),
        (b"<net version='1.9'/>", "begins with <net> as networks of SUMO do"),
    ],
)
def test_a_file_of_another_format_is_named_as_such(tmp_path, content, complaint):
    path = tmp_path / "town.xodr"
    path.write_bytes(content)
    with pytest.raises(SeipError, match=complaint):
        read_map(path)


BERLIN = "+proj=tmerc +lat_0=52.5 +lon_0=13.4 +k=1 +x_0=1000 +y_0=-500 +datum=WGS84 +units=m"


@given(st.floats(-84, 84), st.floats(-6, 6), st.integers(1, 60), st.booleans())
def test_there_and_back_is_the_same_place(latitude, east, zone, south):
    mercator = projection(f"EPSG:{327 if south else 326}{zone:02d}")
    longitude = mercator.longitude + math.radians(east)
    easting, northing = mercator(math.radians(latitude), longitude)
    back, across = mercator.inverse(np.array([easting]), np.array([northing]))
    assert abs(back[0] - math.radians(latitude)) < 1e-13  # less than a micrometre
    apart = (across[0] - longitude + math.pi) % math.tau - math.pi
    assert abs(apart) * math.cos(math.radians(latitude)) < 1e-13
    assert -math.pi <= across[0] < math.pi


@pytest.mark.parametrize(
    ("reference", "latitude", "longitude", "easting", "northing"),
    [
        ("EPSG:32632", 52.52, 13.405, 798812.8025713167, 5827999.900109869),
        ("EPSG:25832", 48.1371, 11.5754, 691596.7099517148, 5334746.440806219),
        ("+proj=utm +zone=17 +datum=WGS84", 43.642567, -79.387139, 630084.3008341494, 4833438.585674325),
        ("+proj=utm +zone=56 +south", -33.8568, 151.2153, 334900.56965226424, 6252288.752888294),
        (BERLIN, 52.55, 13.45, 4391.658231533212, 5065.040152415682),
    ],
)
def test_known_places_are_where_proj_says(reference, latitude, longitude, easting, northing):
    """The metres are those of PROJ 9.5, which shares no code with this."""
    mercator = projection(reference)
    np.testing.assert_allclose(
        mercator(math.radians(latitude), math.radians(longitude)), [easting, northing], rtol=0, atol=1e-6
    )
    back = np.degrees(mercator.inverse(np.array([easting]), np.array([northing]))).ravel()
    np.testing.assert_allclose(back, [latitude, longitude], rtol=0, atol=1e-11)
