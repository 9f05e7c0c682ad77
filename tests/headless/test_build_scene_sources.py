"""The command with other sources: each is in the scene, and a mistake leaves nothing half-written."""

from headless import build_scene

import bpy
import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.world.openstreetmap.network_map import read_network_map
from seip_addon.scene.read import read_scene
from tests.builders.dem_files import origin_at, sampled, write_dem
from tests.builders.opendrive_text import document, geometry, lane, road, section
from tests.builders.osm_text import Extract
from tests.sumo_here import needs_sumo

X, Y, _ = origin_at(52.5, 13.4)
UTM33 = "+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"


@pytest.fixture
def street(tmp_path):
    head = f'<header><offset x="{X}" y="{Y}" z="0" hdg="0"/><geoReference><![CDATA[{UTM33}]]></geoReference></header>'
    path = tmp_path / "street.xodr"
    body = road(geometry(length=200.0, x=-100.0), section(lane(1), lane(-1)))
    path.write_text(document(body, header=head), encoding="utf-8")
    return path


def build(street, tmp_path, *more):
    output = tmp_path / "site.blend"
    build_scene.main(
        [str(street), "--near-latlon", "52.5", "13.4", "--radius", "40", "-o", str(output), *map(str, more)]
    )
    bpy.ops.wm.open_mainfile(filepath=str(output))
    return bpy.context.scene


def test_ground_of_a_terrain_file_is_in_the_scene(street, tmp_path, capsys):
    heights = sampled(lambda x, y: 40 + 0.04 * (x - X) + 0 * y, X - 200, Y + 200, 400)
    dem = write_dem(tmp_path / "dem.tif", heights, X - 200, Y + 200, credit="Surveyors of the State, 2021")
    scene = build(street, tmp_path, "--terrain", dem)
    found = read_scene(scene).geometry
    assert found.attribution == ("Surveyors of the State, 2021",)
    road = np.concatenate([mesh.triangles.reshape(-1, 3) for mesh in found.roads]) + found.origin
    assert road[:, 2] == pytest.approx(40 + 0.04 * road[:, 0], abs=0.02)
    assert "smoothed by a Gaussian of 4 m" in capsys.readouterr().out
    assert any("smoothed by a Gaussian of 4 m" in one for one in found.assumptions)


@pytest.mark.parametrize(("more", "complaint"), [
    (["--terrain", "none.tif"], "no such file"),
    (["--terrain", "street.xodr"], "is not a TIFF file"),
])  # fmt: skip
def test_a_mistake_leaves_nothing_behind(more, complaint, street, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = set(tmp_path.iterdir())
    with pytest.raises(SeipError, match=complaint):
        build(street, tmp_path, *more)
    assert set(tmp_path.iterdir()) == before


@needs_sumo
def test_the_map_is_written_where_the_level_must_be_chosen(tmp_path):
    extract = Extract()
    for line, more in (((-300, -20), {}), ((-20, 20), {"bridge": "yes"}), ((20, 300), {})):
        extract.way([(x, 0) for x in line], highway="primary", name="High Road", **more)
    extract.way([(0, -300), (0, 300)], highway="trunk", name="Trunk Road")
    path, output = extract.write(tmp_path / "place.osm"), tmp_path / "site.blend"
    asked = [str(path), "--near-latlon", "52.5, 13.4", "--radius", "60", "-o", str(output)]
    with pytest.raises(SeipError, match=r"level 'High Road' or level 'Trunk Road'\); .*site\.net\.xml is written"):
        build_scene.main(asked)
    assert not output.exists()
    assert {road.name for road in read_network_map(tmp_path / "site.net.xml").streets.road_map.roads} >= {
        "High Road",
        "Trunk Road",
    }
    build_scene.main([*asked, "--level", "High Road"])
    assert output.exists()
