"""Back from metres of a map to latitude and longitude."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.geometry.geo_reference import projection

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
