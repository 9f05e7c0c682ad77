"""Sites of a network: tables with faults, folders, keys, and the division of the road between neighbours."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.geo_reference import GeoReference
from seip_addon.core.site.roles import Role
from seip_addon.core.workflows.network_sites import (
    NetworkPlace,
    divided,
    extract_places,
    site_key,
    site_source,
    table_places,
)
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.openstreetmap.extract import read_extract
from seip_addon.core.world.streetscape.description import SiteDescription
from tests.builders.map_models import site_model
from tests.builders.opendrive_text import document, geometry, lane, road, section
from tests.builders.osm_text import Extract

UTM33 = "+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"


def write(tmp_path, text, encoding="utf-8"):
    (tmp_path / "map.osm").write_text("<osm/>", encoding="utf-8")
    path = tmp_path / "sites.csv"
    path.write_bytes(text.encode(encoding))
    return path


def test_table_with_names_weights_and_any_usual_delimiter(tmp_path):
    for delimiter in ",;\t":
        text = "Source,Latitude,Longitude,Name,Weight\nmap.osm,54.1,7.1,Straße ä/ö,2.5\nmap.osm,54.2,7.1,Straße ä/ö,\n"
        first, second = table_places(write(tmp_path, "\ufeff" + text.replace(",", delimiter)), 40.0)
        assert (first.name, first.weight, second.weight) == ("Straße ä/ö", 2.5, 1.0)
        assert (first.folder, second.folder) == ("strasse-a-o", "strasse-a-o-2")
        assert first.source == tmp_path / "map.osm"


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("source,latitude,longitude\n", "has no sites"),
        ("latitude,longitude\n1,2\n", "has no column 'source'"),
        ("source,latitude,longitude\nmap.osm,95,7\n", "row 2: the latitude must be"),
        ("source,latitude,longitude,weight\nmap.osm,54,7,-1\n", "row 2: the weight must be"),
        ("source,latitude,longitude\nnone.osm,54,7\n", "row 2: there is no file"),
        ("latitude,longitude,source\n54,7\n", "row 2: there is no file"),
        ("source,latitude,longitude\nmap.osm,54,7\n\nmap.osm,54,7.0002\n", "rows 2 and 4 are 13 m apart"),
    ],
)
def test_faulty_tables_are_refused_in_one_sentence(tmp_path, text, fault):
    with pytest.raises(SeipError, match=fault) as refused:
        table_places(write(tmp_path, text), 40.0)
    assert len(str(refused.value)) < 600


@pytest.fixture
def two_junctions(tmp_path):
    extract = Extract()
    extract.way([(-400.0, 0.0), (0.0, 0.0), (90.0, 0.0), (500.0, 0.0)], highway="secondary", name="Main Street")
    extract.way([(0.0, -300.0), (0.0, 0.0), (0.0, 300.0)], highway="tertiary", name="First Lane")
    extract.way([(90.0, -300.0), (90.0, 0.0), (90.0, 300.0)], highway="tertiary", name="Second Lane")
    extract.way([(5000.0, 0.0), (5100.0, 0.0)], highway="tertiary", name="Far Lane")
    return extract.write(tmp_path / "two.osm")


def test_key_of_a_site_changes_with_its_surroundings_only(two_junctions, tmp_path):
    first, second = finish(extract_places(two_junctions, ["all"], None, 40.0))
    assert first.neighbours == ((second.latitude, second.longitude),)
    extract = finish(read_extract(two_junctions))

    def key(changed):
        return site_key(first, site_source(first, 40.0, changed), "settings")

    def renamed(name):
        number = next(number for number, way in extract.ways.items() if way.tags["name"] == name)
        ways = {**extract.ways, number: replace(extract.ways[number], tags={**extract.ways[number].tags, "lanes": "2"})}
        return replace(extract, ways=ways)

    assert key(extract) == key(renamed("Far Lane"))
    assert key(extract) != key(renamed("First Lane"))
    assert key(extract) != site_key(first, site_source(first, 40.0, extract), "other settings")


def test_road_and_positions_between_neighbours_are_divided_exactly(tmp_path):
    x, y = 391_000.0, 5_818_000.0
    head = f'<header><offset x="{x}" y="{y}" z="0" hdg="0"/><geoReference><![CDATA[{UTM33}]]></geoReference></header>'
    path = tmp_path / "street.xodr"
    body = road(geometry(length=300.0, x=-100.0), section(lane(1), lane(-1)))
    path.write_text(document(body, header=head), encoding="utf-8")
    road_map = read_map(path)
    models, places = [], []
    middle = []
    for along in (0.0, 60.0):
        model = finish(site_model(road_map, SiteDescription(near=(along, 0.0), radius=50.0)))
        points = np.array([(along - model.origin[0], -model.origin[1], 0.0)])
        models.append(model)
        reference = GeoReference(model.geo_reference, tuple(model.header_offset.tolist()))
        longitude, latitude, _ = reference.geographic(points + model.origin)[0]
        middle.append((float(latitude), float(longitude)))
    for own, other in ((0, 1), (1, 0)):
        places.append(NetworkPlace("A", "a", *middle[own], 1.0, path, (middle[other],)))
    cut = [divided(model, place) for model, place in zip(models, places, strict=True)]
    on_map = [shapely.transform(one.region, lambda xy, one=one: xy + one.origin[:2]) for one in cut]
    whole = [shapely.transform(one.region, lambda xy, one=one: xy + one.origin[:2]) for one in models]
    assert on_map[0].intersection(on_map[1]).area < 0.01
    assert shapely.union_all(on_map).area == pytest.approx(shapely.union_all(whole).area, abs=0.05)
    for one in cut:
        (forbidden,) = [part for part in one.parts if part.name == "Neighbouring sites"]
        assert Role.FORBIDDEN_AREAS in forbidden.roles
