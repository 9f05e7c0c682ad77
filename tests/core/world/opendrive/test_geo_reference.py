"""Latitude and longitude on a map, and files of other formats."""

import gzip
import math

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.openstreetmap.site import place_on_map
from seip_addon.core.world.streetscape.description import SiteDescription
from tests.builders.map_models import site_model
from tests.builders.opendrive_text import document, geometry, lane, read_text, road, section

AXIS, ECCENTRICITY = 6_378_137.0, math.sqrt(0.00669437999014)
BERLIN = "+proj=tmerc +lat_0=52.5 +lon_0=13.4 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m"


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
    road_map = street(tmp_path, BERLIN, x=-offset[0], y=-offset[1], offset=header)
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
