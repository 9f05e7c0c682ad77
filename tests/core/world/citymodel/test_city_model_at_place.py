"""City models on maps: where they stand, what gives way to them, and how they are laid on a map."""

import math
import sys

import numpy as np
import pytest
import shapely

from seip_addon.core.errors import SeipError
from seip_addon.core.geometry.geo_reference import GeoReference, projection
from seip_addon.core.geometry.reference_systems import epsg_code, reprojection
from seip_addon.core.progress import finish
from seip_addon.core.site.scene_geometry import DESCRIBED, FROM_CITY_MODEL, FROM_EXTRACT
from seip_addon.core.workflows.site_building import SiteRequest, build_site
from seip_addon.core.world.citymodel.at_place import BuildingsRequest, with_city_model
from seip_addon.core.world.streetscape.description import Building, SiteDescription
from seip_addon.core.world.streetscape.model import site_model
from tests.builders.city_text import CityModel, origin_at
from tests.builders.opendrive_text import document, geometry, lane, read_text, road, section

UTM33 = "+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
PLACE = (52.5, 13.4)
ORIGIN = origin_at(*PLACE)
AREA = shapely.Point(0, 0).buffer(150)
MAP = GeoReference(UTM33, (ORIGIN[0], ORIGIN[1], 0.0, 0.0))  # whose zero is the place


def houses(origin=ORIGIN, epsg=25833, **more):
    model = CityModel(origin, epsg, **more)
    return model.add("a", model.gabled(20, 10, 10, 8, 6, 9)).add("far", model.block(900, 0, 5, 5, 5))


def placed(model, tmp_path, description=None, reference=MAP, **asked):
    path = model.write(tmp_path / "model.city.json")
    return finish(with_city_model(description or SiteDescription(), BuildingsRequest(path, **asked), reference, AREA))


def test_a_building_stands_where_its_coordinates_say(tmp_path):
    site, notes = placed(houses(), tmp_path)
    (house,) = site.solids
    assert house.outline.symmetric_difference(shapely.box(20, 10, 30, 18)).area < 0.02
    assert (house.name, house.source, house.on_ground, notes) == ("Building", FROM_CITY_MODEL, True, ())
    assert (house.solid.vertices[:, 2].min(), house.solid.vertices[:, 2].max()) == (0, pytest.approx(9))


def test_another_zone_is_the_same_place(tmp_path):
    """The border zone's coordinates of the same corners, by the map projection itself."""
    east, north = origin_at(*PLACE, zone="EPSG:25832")[:2]
    turned, _ = placed(houses((east, north, 30.0), 25832), tmp_path)
    straight, _ = placed(houses(), tmp_path)
    corner = np.array([25.0, 14.0])
    utm33, utm32 = projection("EPSG:25833"), projection("EPSG:25832")
    latitude, longitude = utm32.inverse(corner[:1] + east, corner[1:] + north)
    expected = np.array(utm33(latitude[0], longitude[0])) - ORIGIN[:2]
    middle = turned.solids[0].outline.centroid
    assert np.hypot(middle.x - expected[0], middle.y - expected[1]) < 1e-3
    assert turned.solids[0].outline.area == pytest.approx(straight.solids[0].outline.area, rel=0.003)


def test_an_origin_places_a_model_without_a_reference_system_and_keeps_its_heights(tmp_path):
    model = houses((0.0, 0.0, 0.0), None)
    site, _ = placed(model, tmp_path, origin=(-25.0, 5.0, 12.0))
    assert site.solids[0].outline.bounds == pytest.approx((-5, 15, 5, 23))
    assert site.solids[0].solid.vertices[:, 2].min() == 12
    assert not site.solids[0].on_ground
    with pytest.raises(SeipError, match="names no reference system: give the EPSG code of the city model"):
        placed(model, tmp_path)
    with pytest.raises(SeipError, match="X or Y is nan, not"):
        placed(model, tmp_path, origin=(math.nan, 0.0, 0.0))


def test_a_model_of_another_place_is_refused_with_its_latitude_and_longitude(tmp_path):
    away = origin_at(48.2, 16.4)
    with pytest.raises(SeipError, match=r"latitude 48\.2\d*, longitude 16\.4\d*, .* from the place at latitude 52\.5"):
        placed(houses(away), tmp_path)


def test_a_map_that_lies_nowhere_takes_no_model(tmp_path):
    with pytest.raises(SeipError, match="names no projection"):
        placed(houses(), tmp_path, reference=GeoReference())
    with pytest.raises(SeipError, match="turns its coordinates"):
        placed(houses(), tmp_path, reference=GeoReference(UTM33, (0.0, 0.0, 0.0, 0.3)))


def test_another_system_needs_pyproj(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyproj", None)
    with pytest.raises(SeipError, match=r"is in EPSG:28992, which needs pyproj: pip install pyproj"):
        placed(houses(epsg=7415), tmp_path)


def test_pyproj_knows_rd_new_and_refuses_what_is_none():
    pytest.importorskip("pyproj")
    netherlands = GeoReference("+proj=utm +zone=31 +datum=WGS84 +units=m", (0.0, 0.0, 0.0, 0.0))
    rd = reprojection(7415, netherlands, "model")
    amersfoort = np.array([[155_000.0, 463_000.0]])  # the tower, whose place is published with the system
    assert rd.to_geographic(amersfoort)[0] == pytest.approx([5.3872, 52.1552], abs=1e-4)
    assert rd.from_map(rd.to_map(amersfoort))[0] == pytest.approx(amersfoort[0], abs=1e-3)
    easting, northing = projection("EPSG:32631")(*np.radians([52.15517, 5.38720]))
    assert rd.to_map(amersfoort)[0] == pytest.approx([easting, northing], abs=1.5)
    with pytest.raises(SeipError, match=r"EPSG:99999.* pyproj does not know"):
        reprojection(99999, netherlands, "model")
    own = reprojection(28992, GeoReference("EPSG:28992"), "model")
    assert own.to_map(amersfoort)[0] == pytest.approx(amersfoort[0], abs=1e-6)
    with pytest.raises(SeipError, match="not known to pyproj"):
        reprojection(28992, GeoReference("local grid"), "model")


def test_codes_are_read_as_they_are_written():
    written = ("EPSG:7415", "urn:ogc:def:crs:EPSG::7415", "https://www.opengis.net/def/crs/EPSG/0/7415", "epsg:7415")
    assert {epsg_code(text) for text in written} == {7415}
    earth = 'GEOGCS["y",DATUM["z",AUTHORITY["EPSG","6326"]],AUTHORITY["EPSG","4326"]]'
    unit = 'UNIT["metre",1,AUTHORITY["EPSG","9001"]]'
    plan = f'PROJCS["x",{earth},{unit},AUTHORITY["EPSG","28992"]]'
    both = f'COMPD_CS["both",{plan},VERT_CS["h",{unit},AUTHORITY["EPSG","5709"]],AUTHORITY["EPSG","7415"]]'
    newer = 'PROJCRS["x",BASEGEOGCRS["y",ID["EPSG",4289]],CS[Cartesian,2],ID["EPSG",28992]]'
    assert {epsg_code(text) for text in (plan, both, newer)} == {28992}
    assert {epsg_code(text) for text in (f'PROJCS["x",{earth},{unit}]', earth, "RD New", "")} == {None}


@pytest.mark.parametrize(("shift", "source", "left"), [
    (0.0, FROM_EXTRACT, 0), (4.9, FROM_EXTRACT, 0), (5.1, FROM_EXTRACT, 1), (0.0, DESCRIBED, 1),
])  # fmt: skip
def test_what_a_modelled_building_covers_by_more_than_half_gives_way(shift, source, left, tmp_path):
    own = Building(shapely.box(20 + shift, 10, 30 + shift, 18), 5.0, source=source)
    site, notes = placed(houses(), tmp_path, SiteDescription(buildings=(own,)))
    assert len(site.buildings) == left
    assert notes == (() if left else ("1 building of the extract replaced by those of the city model",))


HOUSE = '<object id="1" type="building" name="Old" s="50" t="14" zOffset="0" hdg="0" length="10" width="8" height="4"/>'
BARN = '<object id="2" type="building" name="Barn" s="90" t="14" zOffset="0" hdg="0" length="10" width="8" height="4"/>'


def street(rest=""):
    hill = '<elevation s="0" a="70" b="0.05" c="0" d="0"/>'
    plan = geometry(length=200.0, x=-100.0, y=0.0)
    x, y = ORIGIN[:2]
    place = f'<offset x="{x}" y="{y}" z="0" hdg="0"/><geoReference><![CDATA[{UTM33}]]></geoReference>'
    body = road(plan, section(lane(1), lane(-1)), elevation=hill, objects=rest)
    return document(body, header=f"<header>{place}</header>")


def test_on_a_hill_it_stands_on_the_lowest_ground_under_it_and_the_map_s_own_gives_way(tmp_path):
    path = tmp_path / "street.xodr"
    path.write_text(street(HOUSE + BARN), encoding="utf-8")
    model = CityModel(ORIGIN, 25833)
    model.add("a", model.gabled(-56, 9, 12, 10, 6, 9)).write(tmp_path / "model.json")
    asked = SiteRequest(near=(-50.0, 0.0), radius=60.0, buildings=BuildingsRequest(tmp_path / "model.json"))
    built = finish(build_site(path, asked)).model
    assert "1 building of the map replaced by those of the city model or the survey" in built.notes
    names = {part.name: part for part in built.parts}
    assert "Old" not in names
    assert "Barn" in names
    house = names["Building 1"]
    low = house.solid.vertices[:, 2].min() + built.origin[2]
    assert low == pytest.approx(70 + 0.05 * (100 - 56), abs=0.02)
    assert np.ptp(house.solid.vertices[:, 2]) == pytest.approx(9)
    rows = {(row.kind, row.source): row for row in built.sources()}
    assert (rows["Building", FROM_CITY_MODEL].count, rows["Building", FROM_CITY_MODEL].assumed) == (1, 0)


def test_without_a_model_nothing_changes(tmp_path):
    road_map = read_text(tmp_path, street())
    model = finish(site_model(road_map, SiteDescription(near=(0.0, 0.0), radius=40.0)))
    assert not [note for note in model.notes if "replaced by" in note]
