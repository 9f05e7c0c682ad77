"""The command as a user runs it: on maps, extracts and places to download; sources are credited in the scene."""

from headless import build_scene, runtime

import bpy
import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.world.openstreetmap import overpass
from seip_addon.core.world.openstreetmap.network_map import read_network_map
from seip_addon.scene import contract
from seip_addon.scene.read import read_scene
from tests.builders.dem_files import origin_at, sampled, write_dem
from tests.builders.opendrive_text import document, geometry, lane, road, section
from tests.builders.osm_text import Extract, crossing
from tests.builders.overpass_server import DATE, Answer, overpass_server, overpass_xml
from tests.sumo_here import needs_sumo

MAP = """<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="6" name="street"/>
<road id="1" length="200" junction="-1"><planView>
<geometry s="0" x="1000" y="2000" hdg="0" length="200"><line/></geometry>
</planView><lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
<lane id="-1" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="-2" type="sidewalk" level="false"><width sOffset="0" a="2" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"""


@pytest.fixture
def plain(tmp_path):
    path = tmp_path / "street.xodr"
    path.write_text(MAP, encoding="utf-8")
    return path


@pytest.fixture
def site(tmp_path, plain):
    path = tmp_path / "site.toml"
    path.write_text(
        f'name = "Kerbside"\nmap = "{plain.name}"\nnear = [1100, 2000]\nradius = 30\n'
        "[[tree]]\nposition = [1100, 2005]\n",
        encoding="utf-8",
    )
    return path


def opened(path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return bpy.context.scene


def test_a_site_file_alone_is_enough(site, tmp_path):
    build_scene.main([str(site), "-o", str(tmp_path / "site.blend")])
    scene = opened(tmp_path / "site.blend")
    assert scene[contract.TITLE] == "Kerbside"
    assert scene[contract.MAP] == "street.xodr"
    assert "Tree 1" in bpy.data.objects


def test_the_command_line_goes_before_the_site_file(site, plain, tmp_path):
    arguments = [str(plain), "--site", str(site), "--near", "1150", "2000", "-o", str(tmp_path / "site.blend")]
    build_scene.main(arguments)
    assert list(opened(tmp_path / "site.blend")[contract.ORIGIN]) == [1150, 2000, 0]


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["{road}", "-o", "{out}.blend"], "no place is named"),
        (["{road}", "--near", "1100", "2000", "--approaches", "50", "-o", "{out}.blend"], "those of a junction"),
        (["{road}", "--near", "1100", "2000", "--level", "9", "-o", "{out}.blend"], "no road '9' at this place"),
        (["{road}", "--near", "1100", "2000", "-o", "{out}.obj"], r"does not end in \.blend"),
        (["{site}", "--site", "{site}", "-o", "{out}.blend"], "leave out the other one"),
        (["{road}", "--near", "1100", "2000", "-o", "{road}/out.blend"], "cannot write"),
    ],
)
def test_mistakes_are_named(plain, site, tmp_path, arguments, complaint):
    filled = [each.format(road=plain, site=site, out=tmp_path / "out") for each in arguments]
    with pytest.raises(SeipError, match=complaint):
        build_scene.main(filled)


@pytest.fixture
def stand_in(monkeypatch, tmp_path):
    monkeypatch.delenv("http_proxy", raising=False)
    monkeypatch.setattr(build_scene, "user_cache", lambda: tmp_path / "cache")
    with overpass_server() as running:
        running.answers = [Answer(overpass_xml(crossing()))]
        yield running


def downloaded(stand_in, tmp_path, *arguments):
    output = tmp_path / "site.blend"
    build_scene.main([*arguments, "--overpass", stand_in.address, "-o", str(output)])
    return opened(output)


@needs_sumo
def test_a_place_is_downloaded_built_and_credited(stand_in, tmp_path):
    scene = downloaded(
        stand_in, tmp_path, "--at", "https://www.openstreetmap.org/#map=19/52.5/13.4", "--approaches", "40"
    )
    (extract,) = (tmp_path / "cache").iterdir()
    assert scene[contract.MAP] == extract.name
    credit = f"© OpenStreetMap contributors (ODbL), data of {DATE}"
    assert read_scene(scene).geometry.attribution == (credit,)
    assert credit in (tmp_path / "site.net.xml").read_text(encoding="utf-8")
    before = (tmp_path / "site.net.xml").read_bytes()
    downloaded(stand_in, tmp_path, "--at", "52.5,13.4", "--approaches", "40")
    assert len(stand_in.queries) == 1
    assert (tmp_path / "site.net.xml").read_bytes() == before


@pytest.mark.parametrize(
    "arguments", [["--at", "-31.97,", "-115.86"], ["--at=-31.97,-115.86"], ["--at", "-31.97 -115.86"]]
)
def test_a_place_may_be_south_and_west(stand_in, tmp_path, arguments):
    stand_in.answers = [Answer("", 413)]
    with pytest.raises(SeipError, match="too large for 127"):
        downloaded(stand_in, tmp_path, *arguments)
    assert "(node(-31.97" in stand_in.queries[0]
    assert ",-115.86" in stand_in.queries[0]


@pytest.mark.parametrize(("arguments", "complaint"), [
    ([], "no map is named: give a map or an extract, or --at LAT,LON to download one"),
    (["--near-latlon", "52.5", "13.4"], "no map is named"),
    (["--at", "Harbour Road"], "'Harbour Road' is not a position"),
    (["--at", "52.5,13.4", "--radius", "9000"], "choose a smaller radius"),
    (["{tmp_path}/none.osm", "--at", "52.5,13.4"], "no such file"),
])  # fmt: skip
def test_mistakes_with_a_place_are_named_and_nothing_is_asked_for(stand_in, tmp_path, arguments, complaint):
    with pytest.raises(SeipError, match=complaint):
        downloaded(stand_in, tmp_path, *(one.format(tmp_path=tmp_path) for one in arguments))
    assert not stand_in.queries
    assert not list(tmp_path.iterdir())


def test_blender_s_setting_decides_and_a_command_of_python_is_its_user_s_word(stand_in, tmp_path, monkeypatch):
    assert runtime.why_offline() == ""
    monkeypatch.setattr(runtime, "in_blender", lambda: True)  # in tests Blender's setting is off
    with pytest.raises(SeipError, match="Blender may not go online: start it with --online-mode"):
        downloaded(stand_in, tmp_path, "--at", "52.5,13.4")
    assert not stand_in.queries


def test_the_public_server_is_the_default():
    options = build_scene._parser().parse_args(["--at", "1,2", "-o", "x.blend"])  # noqa: SLF001  # nothing may ask it
    assert options.overpass == overpass.OVERPASS


X, Y, _ = origin_at(52.5, 13.4)
UTM33 = "+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"


@pytest.fixture
def street(tmp_path):
    head = f'<header><offset x="{X}" y="{Y}" z="0" hdg="0"/><geoReference><![CDATA[{UTM33}]]></geoReference></header>'
    path = tmp_path / "street.xodr"
    body = road(geometry(length=200.0, x=-100.0), section(lane(1), lane(-1)))
    path.write_text(document(body, header=head), encoding="utf-8")
    return path


def on_ground(street, tmp_path, *more):
    output = tmp_path / "site.blend"
    build_scene.main(
        [str(street), "--near-latlon", "52.5", "13.4", "--radius", "40", "-o", str(output), *map(str, more)]
    )
    return opened(output)


def test_ground_of_a_terrain_file_is_in_the_scene(street, tmp_path, capsys):
    heights = sampled(lambda x, y: 40 + 0.04 * (x - X) + 0 * y, X - 200, Y + 200, 400)
    dem = write_dem(tmp_path / "dem.tif", heights, X - 200, Y + 200, credit="Surveyors of the State, 2021")
    scene = on_ground(street, tmp_path, "--terrain", dem)
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
        on_ground(street, tmp_path, *more)
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
