"""A place that is pasted into the panel: its surroundings are downloaded where Blender may go online."""

import threading
from concurrent.futures import CancelledError
from types import SimpleNamespace

import bpy
import pytest

from seip_addon.core.workflows.site_building import SiteRequest, site_source
from seip_addon.panel import preferences, scene_status
from seip_addon.panel import site as site_panel
from seip_addon.panel.session import RunningWork
from seip_addon.scene import contract
from tests.builders.drawn_layout import DrawnLayout
from tests.builders.osm_text import Extract, crossing
from tests.builders.overpass_server import DATE, Answer, overpass_server, overpass_xml
from tests.sumo_here import needs_sumo

LINK = "https://www.openstreetmap.org/#map=19/52.50001/13.40001"


@pytest.fixture
def stand_in(monkeypatch, tmp_path, online):
    """A server that is named in the preferences."""
    monkeypatch.delenv("http_proxy", raising=False)
    monkeypatch.setattr(preferences, "_own_folder", lambda name: tmp_path / name)
    with overpass_server() as running:
        values = SimpleNamespace(overpass=running.address, sumo="", python="", catalogues=())
        monkeypatch.setattr(preferences, "own", lambda: values)
        running.answers = [Answer(overpass_xml(crossing()))] * 3
        yield running


def drawn():
    layout = DrawnLayout()
    site_panel.draw(layout, bpy.context)
    return layout


def test_a_pasted_link_lists_the_junctions_there_and_is_the_place(scene, stand_in, tmp_path):
    site = scene.seip.site
    assert "new_site" in [name for name, _ in drawn().properties]
    assert "seip.download_map" not in [name for name, _ in drawn().operators]
    site.new_site = LINK
    assert "seip.download_map" in [name for name, _ in drawn().operators]
    assert scene_status.next_step(scene) == "seip.download_map"
    assert bpy.ops.seip.download_map() == {"FINISHED"}
    (extract,) = (tmp_path / "openstreetmap").iterdir()
    assert site.source == str(extract)
    assert site.position == "52.500010, 13.400010"
    assert [one.name for one in site.junctions] == ["East Road / North Road"]
    assert scene_status.next_step(scene) == "seip.build_site"
    assert bpy.ops.seip.download_map() == {"FINISHED"}
    assert len(stand_in.queries) == 1


@needs_sumo
def test_the_site_is_built_with_its_credit_and_a_larger_one_downloads_more(scene, stand_in, tmp_path):
    scene.seip.site.new_site = LINK
    bpy.ops.seip.download_map()
    scene.seip.site.radius = 40.0
    assert bpy.ops.seip.build_site() == {"FINISHED"}
    assert scene[contract.ATTRIBUTION] == f"© OpenStreetMap contributors (ODbL), data of {DATE}"
    assert len(stand_in.queries) == 1
    scene.seip.site.radius = 200.0
    assert bpy.ops.seip.build_site() == {"FINISHED"}
    assert len(stand_in.queries) == 2
    for path in (tmp_path / "openstreetmap").iterdir():
        path.unlink()
    assert bpy.ops.seip.build_site() == {"FINISHED"}
    assert len(stand_in.queries) == 3


def test_a_stopped_download_ends_at_once_and_leaves_no_file(stand_in, tmp_path):
    stand_in.answers = [Answer(overpass_xml(crossing()), sent=400, held=threading.Event())]
    work = RunningWork("", site_source(SiteRequest(near_latlon=(52.5, 13.4), overpass=preferences.overpass())))
    work.stop()
    assert work.join(2.0)
    with pytest.raises(CancelledError):
        work.result()
    assert not (tmp_path / "openstreetmap").exists()


def test_nothing_is_downloaded_where_blender_may_not_go_online(scene, stand_in, online):
    scene.seip.site.new_site = LINK
    online(False)
    assert "switch on Allow Online Access in Preferences, System, or export the area" in drawn().text
    with pytest.raises(RuntimeError, match="Allow Online Access"):
        bpy.ops.seip.download_map()
    online(True)
    bpy.ops.seip.download_map()
    online(False)
    request = scene.seip.site.request()
    assert "Allow Online Access" in request.overpass.obstacle
    assert len(stand_in.queries) == 1


@pytest.mark.parametrize(("pasted", "answer", "complaint"), [
    ("", None, "Paste latitude and longitude, or a link of a web map, into New Site"),
    ("Harbour Road", None, "'Harbour Road' is not a position"),
    (LINK, Answer(overpass_xml(Extract())), "OpenStreetMap has no streets within"),
    (LINK, Answer("", 413), "the area is too large for 127.0.0.1"),
])  # fmt: skip
def test_a_mistake_is_one_sentence_and_changes_nothing(scene, stand_in, tmp_path, pasted, answer, complaint):
    scene.seip.site.new_site = pasted
    stand_in.answers = [answer] if answer else []
    with pytest.raises(RuntimeError, match=complaint):
        bpy.ops.seip.download_map()
    assert not scene.seip.site.source
    assert not (tmp_path / "openstreetmap").exists()
