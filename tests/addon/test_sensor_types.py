"""The list of sensor types, catalogues of one's own, presets, the beams in the viewport, and the cache."""

import bpy
import pytest

from seip_addon.core.site.candidates import DEFAULT_TYPE
from seip_addon.panel import preferences, sensors
from tests.builders.drawn_layout import DrawnLayout

OWN = """
[corner32]
name = "Corner 32"
manufacturer = "Example Optics"
source = "data sheet of 2026"
elevations_deg = [-25.0, -10.0, 0.0]
range_m = [0.5, 150.0]
points_per_second = 320_000
rotation_rate_hz = 10.0
price_usd = [9_000, 9_000]
"""


@pytest.fixture
def survey(add_on):
    return bpy.context.scene.seip.survey


@pytest.fixture
def own(survey):
    """Enable the add-on as an add-on: only then it has preferences."""
    entry = bpy.context.preferences.addons.new()
    entry.module = preferences.ADDON_ID
    yield entry.preferences
    bpy.context.preferences.addons.remove(entry)


@pytest.fixture
def catalogue(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(OWN, encoding="utf-8")
    return path


def used(survey):
    return tuple(one.name for one in survey.types if one.use)


def test_the_choice_is_kept_when_a_file_is_reopened(survey, tmp_path):
    survey.types[DEFAULT_TYPE].use = False
    survey.types["vlp16"].use = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    assert used(bpy.context.scene.seip.survey) == (DEFAULT_TYPE,)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
    assert used(bpy.context.scene.seip.survey) == ("vlp16",)


def test_a_catalogue_of_one_s_own(survey, own, catalogue):
    assert bpy.ops.seip.add_catalogue(filepath=str(catalogue)) == {"FINISHED"}
    assert preferences.catalogue_files() == (catalogue,)
    assert "corner32" in survey.types
    assert not survey.types["corner32"].use
    survey.types["corner32"].use = True
    assert survey.settings().models()["corner32"].channels == 3
    with pytest.raises(RuntimeError, match="a catalogue already"):
        bpy.ops.seip.add_catalogue(filepath=str(catalogue))
    bpy.ops.seip.remove_catalogue(index=0)
    assert preferences.catalogue_files() == ()
    assert "corner32" in survey.types  # it is used: shown as unknown
    with pytest.raises(RuntimeError, match="there is no catalogue 3"):
        bpy.ops.seip.remove_catalogue(index=3)


def test_a_sensor_is_dropped_and_shown(survey):
    survey.types["vlp16"].use = True
    sections = bpy.context.window_manager.seip_sections
    sections.sensors = sections.about_sensor = True
    layout = DrawnLayout()
    sensors.draw(layout, bpy.context)
    assert [options["icon"] for name, options in layout.properties if name == "use"] == ["X", "X"]
    survey.types[DEFAULT_TYPE].use = False  # as a click on its cross does
    assert used(survey) == ("vlp16",)
    survey.about = "vlp16"
    layout = DrawnLayout()
    sensors.draw(layout, bpy.context)
    assert layout.text.count("Velodyne VLP-16 (Puck)") == 2  # the product, and its figures
    assert sensors.status(bpy.context.scene).result == ("VLP-16 (Puck)", "at 3.5–8 m")
