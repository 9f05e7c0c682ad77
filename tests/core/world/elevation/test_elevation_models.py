"""Elevation models: places and heights exactly, smoothing, and what is refused."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from seip_addon.core.base.errors import SeipError
from seip_addon.core.geometry.geo_reference import GeoReference
from seip_addon.core.geometry.height_raster import HeightRaster
from seip_addon.core.world.elevation.at_place import MapSurroundings, with_terrain
from seip_addon.core.world.elevation.geotiff import read_geotiff
from seip_addon.core.world.streetscape.description import SiteDescription
from tests.builders.dem_files import KEYS, SCALE, TIE_POINT, origin_at, sampled, write_dem

X, Y, _ = origin_at(52.5, 13.4)
UTM33 = "+proj=utm +zone=33 +datum=WGS84 +units=m"
MAP = GeoReference(UTM33, (X, Y, 0.0, 0.0))
AREA = shapely.Point(0, 0).buffer(60)
FLAT = np.zeros((4, 3))


def plane(x, y):
    return 40 + 0.03 * (x - X) - 0.05 * (y - Y)


def relief(path, reference=MAP, lanes=FLAT, area=AREA):
    around = MapSurroundings(reference, area, lanes)
    return with_terrain(SiteDescription(), path, around)[0].relief


@pytest.mark.parametrize("point", [False, True])
def test_pixels_lie_where_the_tags_say(tmp_path, point):
    heights = np.arange(12, dtype=np.float32).reshape(3, 4)
    model = read_geotiff(write_dem(tmp_path / "dem.tif", heights, 1000, 2000, 10.0, point=point))
    first = np.array([1000, 2000]) + (0 if point else np.array([5, -5]))
    places = first + np.array([[0, 0], [30, 0], [0, -20], [15, -10]])
    assert model.at(places).tolist() == [0, 3, 8, 5.5]
    assert np.isnan(model.at(first + np.array([[-6, 0], [0, 6], [36, 0], [0, -26]]))).all()
    assert model.epsg == 25833


@pytest.mark.parametrize(("kind", "factor"), [(np.int16, 1), (np.uint16, 1), (np.int32, 1), (np.float32, 0.25)])
def test_whole_and_broken_heights_are_read_and_no_data_is_left_out(tmp_path, kind, factor):
    heights = (np.arange(20).reshape(4, 5) * factor).astype(kind)
    heights[1, 1] = 999
    model = read_geotiff(write_dem(tmp_path / "dem.tif", heights, 0, 0, no_data=999))
    assert np.isnan(model.heights[1, 1])
    assert np.nansum(model.heights) == np.arange(20).sum() * factor - 6 * factor


def test_a_plane_stays_the_plane_it_is(tmp_path):
    path = write_dem(tmp_path / "dem.tif", sampled(plane, X - 150, Y + 150, 300), X - 150, Y + 150)
    places = np.random.default_rng(1).uniform(-50, 50, (200, 2))
    found = relief(path).rise(places)
    assert found == pytest.approx(plane(places[:, 0] + X, places[:, 1] + Y), abs=1e-4)


def test_degrees_and_another_zone_are_the_same_ground(tmp_path):
    step = np.array([1.5e-5, 1e-5])
    west, north = 13.4 - 200 * step[0], 52.5 + 200 * step[1]
    heights = sampled(lambda x, y: 40 + 0 * x, 0, 0, 400)
    heights += np.linspace(10, -10, 400, dtype=np.float32)[:, None]
    degrees = write_dem(tmp_path / "degrees.tif", heights, west, north, step, 4326)
    ground = relief(degrees)
    metre = np.degrees(1 / 6_371_000)
    for y in (-30.0, 0.0, 30.0):
        expected = 40 + 10 * (y * metre) / (200 * step[1])
        assert ground.rise(np.array([[0.0, y]]))[0] == pytest.approx(expected, abs=0.03)
    away = GeoReference("EPSG:25832", (*origin_at(52.5, 13.4, "EPSG:25832")[:2], 0.0, 0.0))
    assert relief(degrees, away).rise(np.zeros((1, 2)))[0] == pytest.approx(40, abs=0.03)


def test_holes_are_filled_from_what_is_around_them(tmp_path):
    heights = sampled(lambda x, y: 40 + 0 * x, 0, 0, 300)
    heights[120:170, 120:170] = -9999
    path = write_dem(tmp_path / "dem.tif", heights, X - 150, Y + 150, no_data=-9999)
    assert relief(path).rise(np.zeros((1, 2)))[0] == pytest.approx(40, abs=1e-4)


@settings(max_examples=60, deadline=None)
@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(0.4, 6), st.integers(0, 2**32 - 1))
def test_smoothing_keeps_planes_and_stays_between_the_extremes(slope_x, slope_y, sigma, seed):
    raster = HeightRaster(np.array([3.0, -7.0]), 0.8, np.zeros((60, 60)))
    x, y = raster.places.T
    level = HeightRaster(raster.low, 0.8, (slope_x * x + slope_y * y).reshape(60, 60))
    middle = np.array([[3 + 0.8 * 30.3, -7 + 0.8 * 29.6]])
    expected = slope_x * middle[0, 0] + slope_y * middle[0, 1]
    assert level.smoothed(sigma).at(middle)[0] == pytest.approx(expected, abs=1e-9)
    rough = np.random.default_rng(seed).normal(0, 1, (60, 60))
    rough[np.random.default_rng(seed).random((60, 60)) < 0.4] = np.nan
    smooth = HeightRaster(raster.low, 0.8, rough).smoothed(sigma).heights
    assert np.isfinite(smooth).all()
    assert np.nanmin(rough) - 1e-9 <= smooth.min() <= smooth.max() <= np.nanmax(rough) + 1e-9


def test_a_model_of_another_place_is_refused_with_both_places(tmp_path):
    path = write_dem(tmp_path / "dem.tif", sampled(plane, X + 9850, Y + 150, 300), X + 9850, Y + 150)
    with pytest.raises(SeipError, match=r"0% of the place: its middle is at latitude 52\.5\d*, longitude 13\.5"):
        relief(path)


@pytest.mark.parametrize(("epsg", "reference", "complaint"), [
    (28992, MAP, r"dem\.tif is in EPSG:28992: .* gdalwarp -t_srs EPSG:32633 "),
    (25833, GeoReference("EPSG:31468"), "projection of the scene's map, 'EPSG:31468', is not supported"),
    (25833, GeoReference(UTM33, (X, Y, 0.0, 0.1)), "turns its coordinates"),
])  # fmt: skip
def test_a_system_that_cannot_be_converted_is_refused_with_the_cure(tmp_path, epsg, reference, complaint):
    path = write_dem(tmp_path / "dem.tif", sampled(plane, X - 150, Y + 150, 300), X - 150, Y + 150, epsg=epsg)
    with pytest.raises(SeipError, match=complaint):
        relief(path, reference)


def test_a_map_with_heights_keeps_them(tmp_path):
    path = write_dem(tmp_path / "dem.tif", sampled(plane, X - 150, Y + 150, 300), X - 150, Y + 150)
    with pytest.raises(SeipError, match=r"own heights there \(0\.0 to 9\.0 m\)"):
        relief(path, lanes=np.linspace([0, 0, 0], [50, 0, 9], 10))


ONES = np.ones((4, 4), np.float32)
BROKEN = {
    "not there": (lambda path: None, "no such file"),
    "text": (lambda path: path.write_text("ncols 4", encoding="utf-8"), "is not a TIFF file"),
    "cut": (lambda path: path.write_bytes(write_dem(path, np.ones((99, 99)), 0, 0).read_bytes()[:900]), "no TIFF|read"),
    "a picture": (lambda path: Image.new("RGB", (8, 8)).save(path), "one band of heights"),
    "no georeference": (lambda path: Image.fromarray(ONES).save(path), "has no georeference"),
    "no scale": (lambda path: write_dem(path, ONES, 0, 0, leave_out=(SCALE,)), "no georeference"),
    "no tie point": (lambda path: write_dem(path, ONES, 0, 0, leave_out=(TIE_POINT,)), "no georeference"),
    "no keys": (lambda path: write_dem(path, ONES, 0, 0, leave_out=(KEYS,)), "names no reference system"),
    "its own system": (lambda path: write_dem(path, ONES, 0, 0, epsg=32767), "names no reference system"),
    "steps of nothing": (
        lambda path: write_dem(path, ONES, 0, 0, step=0.0),
        "a georeference that lies nowhere on Earth",
    ),
    "not a number": (lambda path: write_dem(path, ONES, float("nan"), 0), "a georeference that lies nowhere on Earth"),
    "a place off the Earth": (
        lambda path: write_dem(path, ONES, 1e30, 0),
        "a georeference that lies nowhere on Earth",
    ),
    "a latitude of 100 degrees": (
        lambda path: write_dem(path, ONES, 13.0, 100.0, 0.001, 4326),
        "a georeference that lies nowhere on Earth",
    ),
    "vast steps": (lambda path: write_dem(path, ONES, 0, 0, step=1e7), "a georeference that lies nowhere on Earth"),
    "feet": (lambda path: write_dem(path, ONES, 0, 0, keys=[3076, 0, 1, 9002]), "is not in metres"),
    "nothing": (lambda path: write_dem(path, ONES * np.nan, 0, 0), "no height between"),
    "no data that is none": (lambda path: write_dem(path, ONES, 0, 0, no_data="none"), "damaged tags"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_file_that_is_no_elevation_model_is_refused_in_a_sentence(tmp_path, name):
    spoil, complaint = BROKEN[name]
    path = tmp_path / "dem.tif"
    spoil(path)
    with pytest.raises(SeipError, match=complaint) as refusal:
        read_geotiff(path)
    assert "\n" not in str(refusal.value)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_no_damage_breaks_the_reader(data, tmp_path_factory):
    """Any byte of the file may change: it is read, or refused."""
    path = tmp_path_factory.mktemp("dem") / "dem.tif"
    content = bytearray(write_dem(path, np.ones((6, 5), np.float32), 0, 0, no_data=-1).read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.one_of(st.just(len(content)), st.integers(0, len(content))))])
    try:
        read_geotiff(path)
    except SeipError:
        return


def test_a_small_file_that_claims_many_pixels_is_refused(tmp_path):
    """Its length was changed to 2 million rows: reading them took a gigabyte and seconds."""
    path = write_dem(tmp_path / "dem.tif", np.full((40, 40), 30.0, dtype=np.float32), 0, 0)
    content = bytearray(path.read_bytes())
    entry = content.index(bytes([1, 1, 4, 0, 1, 0, 0, 0]))  # ImageLength, one LONG
    content[entry + 8 : entry + 12] = (2_000_000).to_bytes(4, "little")
    path.write_bytes(content)
    with pytest.raises(SeipError, match=r"dem\.tif has far fewer bytes"):
        read_geotiff(path)
