"""The command with a place in place of a file: the extract is downloaded, and credited in the scene."""

from headless import build_scene, runtime

import bpy
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.world.openstreetmap import overpass
from seip_addon.scene import contract
from seip_addon.scene.read import read_scene
from tests.builders.osm_text import crossing
from tests.builders.overpass_server import DATE, Answer, overpass_server, overpass_xml
from tests.sumo_here import needs_sumo


@pytest.fixture
def stand_in(monkeypatch, tmp_path):
    monkeypatch.delenv("http_proxy", raising=False)
    monkeypatch.setattr(build_scene, "user_cache", lambda: tmp_path / "cache")
    with overpass_server() as running:
        running.answers = [Answer(overpass_xml(crossing()))]
        yield running


def build(stand_in, tmp_path, *arguments):
    output = tmp_path / "site.blend"
    build_scene.main([*arguments, "--overpass", stand_in.address, "-o", str(output)])
    bpy.ops.wm.open_mainfile(filepath=str(output))
    return bpy.context.scene


@needs_sumo
def test_a_place_is_downloaded_built_and_credited(stand_in, tmp_path):
    scene = build(stand_in, tmp_path, "--at", "https://www.openstreetmap.org/#map=19/52.5/13.4", "--approaches", "40")
    (extract,) = (tmp_path / "cache").iterdir()
    assert scene[contract.MAP] == extract.name
    credit = f"© OpenStreetMap contributors (ODbL), data of {DATE}"
    assert read_scene(scene).geometry.attribution == (credit,)
    assert credit in (tmp_path / "site.net.xml").read_text(encoding="utf-8")
    before = (tmp_path / "site.net.xml").read_bytes()
    build(stand_in, tmp_path, "--at", "52.5,13.4", "--approaches", "40")
    assert len(stand_in.queries) == 1
    assert (tmp_path / "site.net.xml").read_bytes() == before


@pytest.mark.parametrize(
    "arguments", [["--at", "-31.97,", "-115.86"], ["--at=-31.97,-115.86"], ["--at", "-31.97 -115.86"]]
)
def test_a_place_may_be_south_and_west(stand_in, tmp_path, arguments):
    stand_in.answers = [Answer("", 413)]
    with pytest.raises(SeipError, match="too large for 127"):
        build(stand_in, tmp_path, *arguments)
    assert "(node(-31.97" in stand_in.queries[0]
    assert ",-115.86" in stand_in.queries[0]


@pytest.mark.parametrize(("arguments", "complaint"), [
    ([], "no map is named: give a map or an extract, or --at LAT,LON to download one"),
    (["--near-latlon", "52.5", "13.4"], "no map is named"),
    (["--at", "Harbour Road"], "'Harbour Road' is not a position"),
    (["--at", "52.5,13.4", "--radius", "9000"], "choose a smaller radius"),
    (["{tmp_path}/none.osm", "--at", "52.5,13.4"], "no such file"),
])  # fmt: skip
def test_mistakes_are_named_and_nothing_is_asked_for(stand_in, tmp_path, arguments, complaint):
    with pytest.raises(SeipError, match=complaint):
        build(stand_in, tmp_path, *(one.format(tmp_path=tmp_path) for one in arguments))
    assert not stand_in.queries
    assert not list(tmp_path.iterdir())


def test_blender_s_setting_decides_and_a_command_of_python_is_its_user_s_word(stand_in, tmp_path, monkeypatch):
    assert runtime.why_offline() == ""
    monkeypatch.setattr(runtime, "in_blender", lambda: True)  # in tests Blender's setting is off
    with pytest.raises(SeipError, match="Blender may not go online: start it with --online-mode"):
        build(stand_in, tmp_path, "--at", "52.5,13.4")
    assert not stand_in.queries


def test_the_public_server_is_the_default():
    options = build_scene._parser().parse_args(["--at", "1,2", "-o", "x.blend"])  # noqa: SLF001  # nothing may ask it
    assert options.overpass == overpass.OVERPASS
