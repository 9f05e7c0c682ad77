"""Laser surveys: the ground, what stands on it, boxes that keep lines of sight, and what is refused."""

import struct
import time

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.geo_reference import GeoReference, projection
from seip_addon.core.geometry.height_raster import HeightRaster
from seip_addon.core.site.scene_geometry import FROM_EXTRACT, FROM_SURVEY
from seip_addon.core.world.elevation import obstacles
from seip_addon.core.world.elevation.at_place import MapSurroundings, TerrainRequest, with_terrain
from seip_addon.core.world.elevation.obstacles import ObstacleRaster, blocked, merged, random_rays
from seip_addon.core.world.streetscape.description import Building, SiteDescription
from tests.builders.dem_files import origin_at
from tests.builders.survey_files import UNCLASSIFIED, VEGETATION, block_points, ground_points, write_survey

pytest.importorskip("lazrs")

X, Y, _ = origin_at(52.5, 13.4)
MAP = GeoReference("+proj=utm +zone=33 +datum=WGS84 +units=m", (X, Y, 0.0, 0.0))
AREA = shapely.Point(0, 0).buffer(60)
ROAD = shapely.box(-80, -4, 80, 4)
WKT = projection("EPSG:25833").wkt
HOUSE, TREE, TRUCK, POST = (10, 10, 20, 12), (-25, 8, 8, 8), (-10, -2, 9, 3), (-20, -12, 0.3, 0.3)


def slope(x, y):
    return 40 + 0.02 * x + 0 * y


def town(rng, surface=slope):
    return np.concatenate([
        ground_points(rng, surface, 90, without=[HOUSE]),
        block_points(rng, *HOUSE, 52.0),
        block_points(rng, *TREE, 50.0, VEGETATION, low=44.5),
        block_points(rng, *TRUCK, 44.0, UNCLASSIFIED),
        block_points(rng, *POST, 48.0, UNCLASSIFIED, density=400),
        block_points(rng, 40, -30, 4, 2, 41.5, UNCLASSIFIED),  # a car
    ])  # fmt: skip


def around(lanes=None, area=AREA):
    flat = np.zeros((9, 3))
    return MapSurroundings(MAP, area, flat if lanes is None else lanes, ROAD)


def surveyed(tmp_path, points, *, suffix=".laz", description=None, lanes=None, wkt=WKT, epsg=None):
    path = write_survey(tmp_path / f"survey{suffix}", points, (X, Y), wkt)
    return finish(with_terrain(description or SiteDescription(), TerrainRequest(path, epsg), around(lanes)))


def bounds(site, name):
    vertices = np.concatenate([one.solid.vertices for one in site.solids if one.name == name])
    return vertices.min(axis=0), vertices.max(axis=0)


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_ground_and_what_stands_on_it(suffix, tmp_path):
    site, notes = surveyed(tmp_path, town(np.random.default_rng(3)), suffix=suffix)
    places = np.random.default_rng(4).uniform(-55, 55, (300, 2))
    assert np.abs(site.relief.rise(places) - slope(*places.T)).max() < 0.06  # the most under the house
    assert {one.name for one in site.solids} == {"Surveyed building", "Surveyed vegetation"}
    assert {one.source for one in site.solids} == {FROM_SURVEY}
    low, high = bounds(site, "Surveyed building")
    assert low[:2] == pytest.approx([10, 10], abs=1.0)
    assert high == pytest.approx([30, 22, 52], abs=1.0)
    assert high[2] == pytest.approx(52, abs=0.01)
    assert low[2] < slope(10, 10)
    low, high = bounds(site, "Surveyed vegetation")
    tolerance = obstacles.TOLERANCES[0]  # the coarsest changes 0.18 % of the lines of sight here
    assert 44.5 <= low[2] <= 45.5 + tolerance  # a crown that light passes under
    assert 49.5 - tolerance <= high[2] <= 50
    assert any("0.18% of 4,000 random lines of sight" in note for note in notes)


def test_a_building_of_an_extract_is_not_there_twice(tmp_path):
    own = Building(shapely.box(10, 10, 30, 22), 9.0, source=FROM_EXTRACT)
    site, notes = surveyed(tmp_path, town(np.random.default_rng(3)), description=SiteDescription(buildings=(own,)))
    assert not site.buildings
    assert notes[-1] == "1 building of the extract replaced by those of the survey"


def raster_of(kind, top, low=None):
    ground = HeightRaster(np.zeros(2), 1.0, np.zeros(kind.shape))
    return ObstacleRaster(ground, kind, np.full(kind.shape, -0.5) if low is None else low, top)


@settings(max_examples=120, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), filled=st.floats(0.05, 0.95), tolerance=st.sampled_from([0.0, 0.3, 1.0, 4.0]))
def test_boxes_cover_each_cell_once_and_no_other_within_the_tolerance(seed, filled, tolerance):
    rng = np.random.default_rng(seed)
    kind = np.where(rng.random((14, 17)) < filled, rng.integers(0, 3, (14, 17)), -1)
    top = 2 + np.round(rng.random((14, 17)) * 5, 1)
    raster = raster_of(kind, top, np.where((kind == 1) & (rng.random(kind.shape) < 0.5), top - 1, -0.5))
    boxes = merged(raster, tolerance)
    covered = np.zeros(kind.shape, int)
    for box in boxes:
        cells = slice(*box.rows), slice(*box.columns)
        covered[cells] += 1
        assert (kind[cells] == box.kind).all()
        assert np.abs(top[cells] - box.top).max() <= tolerance + 1e-9
        assert np.abs(raster.low[cells] - box.low).max() <= tolerance + 1e-9
    assert (covered == (kind >= 0)).all()


def test_a_ray_is_blocked_where_a_block_stands_in_it():
    """Against the crossing of a segment and a box in closed form."""
    kind = np.full((60, 60), -1)
    kind[20:30, 25:45] = 0
    raster = raster_of(kind, np.where(kind >= 0, 5.0, 0.0))
    begin, end = random_rays(raster, np.random.default_rng(2))
    low, high = np.array([24.5, 19.5, -0.5]), np.array([44.5, 29.5, 5.0])
    with np.errstate(divide="ignore"):
        enter, leave = (low - begin) / (end - begin), (high - begin) / (end - begin)
    first = np.minimum(enter, leave).max(axis=1).clip(0)
    last = np.maximum(enter, leave).min(axis=1).clip(None, 1)
    length = np.linalg.norm(end - begin, axis=1)
    found = blocked(raster, begin, end)
    assert not found[first > last].any()
    assert found[(last - first) * length > 2 * obstacles.RAY_STEP].all()


def test_a_survey_without_a_system_asks_for_it(tmp_path):
    points = town(np.random.default_rng(3))
    with pytest.raises(SeipError, match="give the EPSG code of the terrain"):
        surveyed(tmp_path, points, wkt=None)
    assert surveyed(tmp_path, points, wkt=None, epsg=25833)[0].solids


def test_a_survey_of_another_place_is_refused_with_both(tmp_path):
    points = town(np.random.default_rng(3))
    points[:, 0] += 9000
    with pytest.raises(SeipError, match=r"0% of the place: its middle is at latitude 52\.\d+, longitude 13\.53"):
        surveyed(tmp_path, points)
    points[:, 0] -= 9000 - 130
    with pytest.raises(SeipError, match=r"has points on \d+% of the place"):
        surveyed(tmp_path, points)


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_a_damaged_survey_is_refused(suffix, tmp_path):
    path = tmp_path / f"survey{suffix}"
    asked = with_terrain(SiteDescription(), TerrainRequest(path), around())
    with pytest.raises(SeipError, match="no such file"):
        finish(asked)
    for text in (b"", b"nothing", b"LASF" + bytes(400)):
        path.write_bytes(text)
        with pytest.raises(SeipError, match="not a readable LAS or LAZ file"):
            finish(with_terrain(SiteDescription(), TerrainRequest(path), around()))
    whole = write_survey(path, town(np.random.default_rng(3)), (X, Y), WKT).read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(SeipError, match=r"survey\.la[sz]"):
        finish(with_terrain(SiteDescription(), TerrainRequest(path), around()))


FIRST_CHUNK = 8 + 30 + 4  # bytes from where points begin to the layers of the first chunk: its offset, a point, a count
DAMAGE = {
    "variable-length records": (".las", 100, "<I", 2**32 - 1, "4,294,967,295 variable-length records"),
    "points": (".las", 247, "<Q", 2**40, "1,099,511,627,776 points"),
    "packed points": (".laz", 247, "<Q", 2**40, "1,099,511,627,776 points"),
    "a scale": (".las", 131, "<d", float("nan"), "coordinate is nan"),
    "a bound": (".las", 179, "<d", float("inf"), "bound is inf"),
    "chunks": (".laz", "table", "<xxxxI", 2**32 - 1, "4,294,967,295 chunks"),
    "a layer that lazrs would reserve 4 GB for": (".laz", FIRST_CHUNK, "<I", 2**32 - 1, "a layer"),
    "symbols that lazrs panics at": (".laz", FIRST_CHUNK + 9 * 4, "<I", 2**32 - 1, "not a readable"),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_what_a_file_does_not_bear_out_is_refused_at_once(name, tmp_path, capfd):
    suffix, at, form, value, complaint = DAMAGE[name]
    path = write_survey(tmp_path / f"survey{suffix}", ground_points(np.random.default_rng(3), slope, 5), (X, Y), WKT)
    content = bytearray(path.read_bytes())
    (begin,) = struct.unpack_from("<I", content, 96)
    if suffix == ".laz" and at != 247:
        at = struct.unpack_from("<q", content, begin)[0] if at == "table" else begin + at
    struct.pack_into(form, content, at, value)
    path.write_bytes(content)
    begin = time.process_time()
    with pytest.raises(SeipError, match=complaint):
        finish(with_terrain(SiteDescription(), TerrainRequest(path), around()))
    assert time.process_time() - begin < 1.0
    assert capfd.readouterr() == ("", "")
