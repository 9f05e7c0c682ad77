"""Where SUMO is missing, panel and preferences say so and install it."""

import sys

import bpy
import pytest

from seip_addon.core.programs import sumo_programs
from seip_addon.core.programs.sumo_installation import DOWNLOAD_SIZE, SUMO_VERSION
from seip_addon.panel import preferences, site
from tests.builders.drawn_layout import DrawnLayout
from tests.builders.osm_text import crossing
from tests.builders.sumo_wheel import write_programs, write_wheel

BUTTON = f"Install SUMO ({DOWNLOAD_SIZE} MB)"


@pytest.fixture
def machine(tmp_path, monkeypatch, online):
    """A machine without SUMO, whose pip has a stand-in, and an extension with an empty folder of its own."""
    monkeypatch.setenv("PATH", "/usr/bin:/bin")
    monkeypatch.delenv("SUMO_HOME", raising=False)
    monkeypatch.setattr(sumo_programs, "SYSTEM_HOMES", ())
    monkeypatch.setattr(sumo_programs.importlib.util, "find_spec", lambda _name: None)
    monkeypatch.setattr(preferences, "own_sumo_folder", lambda: tmp_path / "own")
    monkeypatch.setattr(preferences, "pip", lambda: [sys.executable, "-m", "pip"])
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path / "index"))
    return write_wheel(tmp_path / "index")


@pytest.fixture
def chosen(scene, machine, tmp_path):
    """An extract of one junction, chosen where SUMO is missing."""
    assert bpy.ops.seip.choose_map(filepath=str(crossing().write(tmp_path / "place.osm"))) == {"FINISHED"}
    return scene


def drawn(draw, *arguments):
    layout = DrawnLayout()
    draw(layout, *arguments)
    return layout


def test_panel_and_button_say_that_sumo_is_missing_before_the_last_click(chosen, online):
    layout = drawn(site.draw, bpy.context)
    assert " ".join(layout.text.split()).count(preferences.NO_SUMO) == 1
    assert ("seip.install_sumo", BUTTON) in layout.operators
    chosen.seip.site.junction = chosen.seip.site.junctions[0].name
    assert preferences.NO_SUMO in drawn(site.draw, bpy.context).text
    with pytest.raises(RuntimeError, match=preferences.NO_SUMO):
        bpy.ops.seip.build_site()
    online(False)
    with pytest.raises(RuntimeError, match="Allow Online Access"):
        bpy.ops.seip.install_sumo()


def test_the_panel_says_which_place_is_chosen_or_what_is_wrong_with_it(chosen, online):
    site_properties = chosen.seip.site
    link = "https://maps.example.org/" + "a-very-long-part-of-a-link/" * 8
    for choice, words in (
        ({"junction": site_properties.junctions[0].name}, "this junction"),
        ({"position": "52.5, 13.4", "region_shape": "CIRCLE"}, "this position"),
        ({"terrain": "//dem.tif"}, "Choose a junction"),
        ({"position": link}, "browser and copy"),
        ({"position": "99, 13.4"}, "latitude first"),
    ):
        for name in ("junction", "position", "region_shape", "terrain"):
            site_properties.property_unset(name)
        for name, value in choice.items():
            setattr(site_properties, name, value)
        assert words in " ".join(drawn(site.draw, bpy.context).text.split())


def test_after_the_installation_nothing_is_missing(chosen, tmp_path):
    assert bpy.ops.seip.install_sumo() == {"FINISHED"}
    where = tmp_path / "own" / SUMO_VERSION / "sumo"
    assert preferences.sumo().netconvert == where / "bin" / "netconvert"
    layout = drawn(site.draw, bpy.context)
    assert preferences.NO_SUMO not in layout.text
    assert "seip.install_sumo" not in {name for name, _ in layout.operators}
    status = drawn(preferences.draw_status)
    assert f"SUMO{SUMO_VERSION}in{where / 'bin'}" in "".join(status.text.split())
    assert not status.operators
    chosen.seip.site.junction = chosen.seip.site.junctions[0].name
    assert bpy.ops.seip.build_site.poll()
    assert chosen.seip.site.request().sumo == (tmp_path / "own" / SUMO_VERSION,)


def test_a_sumo_that_does_not_start_can_be_replaced(scene, machine, tmp_path):
    write_programs(tmp_path / "own" / SUMO_VERSION, script="echo 'libGL.so.1 is missing' >&2; exit 127")
    status = drawn(preferences.draw_status)
    assert "libGL.so.1 is missing" in status.text
    assert ("seip.install_sumo", BUTTON) in status.operators
