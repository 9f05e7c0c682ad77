"""The list of sensor types, catalogues of one's own, presets, the beams in the viewport, and the cache."""

import bpy
import pytest

from seip_addon import preferences
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.site.candidates import DEFAULT_TYPE
from seip_addon.panels import sensors
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


def test_a_bad_catalogue_is_refused(survey, own, tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text("[x]\nname = 1\n", encoding="utf-8")
    with pytest.raises(RuntimeError, match="manufacturer is missing"):
        bpy.ops.seip.add_catalogue(filepath=str(path))
    assert preferences.catalogue_files() == ()


def test_a_preset_brings_types_heights_and_tilts_back(survey, tmp_path, monkeypatch):
    folder = tmp_path / "presets" / "seip" / "survey"
    monkeypatch.setattr(bpy.utils, "user_resource", lambda *_, path="", create=False: _made(tmp_path / path))
    survey.heights, survey.grid, survey.types["vlp16"].use = "4 6", 2.5, True
    survey.tilts = "0 10"
    assert bpy.ops.seip.add_survey_preset(name="Two heights") == {"FINISHED"}
    (file,) = folder.glob("*.py")
    survey.heights, survey.grid, survey.types["vlp16"].use = "8", 1.0, False
    survey.tilts = "0"
    bpy.ops.script.execute_preset(filepath=str(file), menu_idname="SEIP_MT_survey_presets")
    assert (survey.heights, survey.grid, survey.tilts) == ("4 6", 2.5, "0 10")
    assert used(survey) == ("vlp16", DEFAULT_TYPE)
    assert [one.name for one in survey.types] == list(load_catalogue())


def _made(path):
    path.mkdir(parents=True, exist_ok=True)
    return str(path)


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


def test_the_cache_is_emptied_of_grids_alone(survey):
    folder = preferences.cache_folder()
    with pytest.raises(RuntimeError, match="The cache is empty"):
        bpy.ops.seip.empty_cache()
    folder.mkdir(parents=True)
    (folder / f"{'a' * 32}.npz").write_bytes(b"x" * 1000)
    (folder / f"{'b' * 32}.returns.npz").write_bytes(b"x" * 500)
    (folder / "mine.txt").write_text("mine", encoding="utf-8")
    assert bpy.ops.seip.empty_cache() == {"FINISHED"}
    assert [entry.name for entry in folder.iterdir()] == ["mine.txt"]
