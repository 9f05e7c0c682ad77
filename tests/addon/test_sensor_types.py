"""The list of sensor types, catalogues of one's own, presets, the beams in the viewport, and the cache."""

import argparse

from headless.options import read_settings
from headless.survey import add_options

import bpy
import numpy as np
import pytest

from seip_addon import preferences
from seip_addon.core.errors import SeipError
from seip_addon.core.geometry.orientation import orientation
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.ray_casting import MAX_THREADS
from seip_addon.core.sensing.visibility.ring_resolution import unresolved_from
from seip_addon.core.site.candidates import DEFAULT_TYPE, CandidateSettings
from seip_addon.panels import sensor_table, sensors
from seip_addon.session import session
from seip_addon.viewport import beam_preview
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


def test_the_list_is_the_catalogue_and_the_choice_the_default(survey):
    assert [one.name for one in survey.types] == list(load_catalogue())
    assert used(survey) == (DEFAULT_TYPE,)
    assert survey.settings().candidates == CandidateSettings(sensors=(DEFAULT_TYPE,))


def test_rules_on_positions_are_allowed_in_the_panel_as_on_the_command_line(survey):
    allowed = ["cycle-tracks", "islands", "assumed-poles"]
    survey.allow = set(allowed)
    parser = argparse.ArgumentParser()
    add_options(parser)
    typed = parser.parse_args(["-o", "out", "--allow", *allowed, "--sensor", DEFAULT_TYPE])
    assert survey.settings().candidates == read_settings(CandidateSettings, typed)


def test_the_choice_is_kept_when_a_file_is_reopened(survey, tmp_path):
    survey.types[DEFAULT_TYPE].use = False
    survey.types["vlp16"].use = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    assert used(bpy.context.scene.seip.survey) == (DEFAULT_TYPE,)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
    assert used(bpy.context.scene.seip.survey) == ("vlp16",)


def test_an_unknown_type_that_is_used_stays_and_one_that_is_not_goes(survey):
    for name, use in (("gone", False), ("lost", True)):
        one = survey.types.add()
        one.name, one.use = name, use
    assert bpy.ops.seip.list_sensor_types() == {"FINISHED"}
    assert "gone" not in survey.types
    assert "lost" in survey.types
    assert "lost" not in session.sensor_types


def test_no_type_is_a_mistake(survey):
    for one in survey.types:
        one.use = False
    with pytest.raises(Exception, match="no sensor type is chosen"):
        survey.settings()


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


def test_a_catalogue_that_broke_leaves_the_shipped_types(survey, own, catalogue):
    bpy.ops.seip.add_catalogue(filepath=str(catalogue))
    catalogue.unlink()
    with pytest.raises(RuntimeError, match="cannot read the LiDAR catalogue"):
        bpy.ops.seip.list_sensor_types()
    assert session.catalogue_error
    assert list(session.sensor_types) == list(load_catalogue())


def test_without_preferences_catalogues_cannot_be_kept(survey, catalogue):
    with pytest.raises(RuntimeError, match="Install the add-on"):
        bpy.ops.seip.add_catalogue(filepath=str(catalogue))


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


def test_beams_are_shown_until_hidden_or_another_file_is_opened(survey):
    assert bpy.ops.seip.preview_beams() == {"FINISHED"}
    assert beam_preview.is_shown()
    bpy.ops.seip.preview_beams()
    assert not beam_preview.is_shown()
    bpy.ops.seip.preview_beams()
    bpy.ops.wm.read_homefile(use_empty=True)
    assert not beam_preview.is_shown()
    bpy.ops.seip.preview_beams()  # and the fixture sees that it goes with the add-on


def test_the_table_has_every_product_by_manufacturer_and_those_of_the_paper_last(survey):
    layout = DrawnLayout()
    sensor_table.draw_table(layout, survey)
    titles = [options["text"] for name, options in layout.properties if name == "use"]
    assert len(titles) == len(load_catalogue())
    assert [title.split()[0] for title in titles[-3:]] == ["Type", "Type", "Type"]
    assert titles[:-3] == sorted(titles[:-3], key=str.casefold)
    texts = [text for text, _ in layout.labels]
    row = texts[texts.index("120° × 25°") - 1 :]
    assert row[:5] == ["128", "120° × 25°", "200 m", "$1,250", "data sheet"]


@pytest.mark.parametrize(("wanted", "number"), [("ouster os1-128", 2), ("HESAI", 7), ("nothing of that name", 0)])
def test_the_table_is_filtered_by_what_is_typed(survey, wanted, number):
    survey.filter = wanted
    layout = DrawnLayout()
    sensor_table.draw_table(layout, survey)
    titles = [options["text"] for name, options in layout.properties if name == "use"]
    assert len(titles) == number
    assert all(wanted.casefold() in title.casefold() for title in titles)
    assert ("No product has this in its name." in layout.text) == (number == 0)


def test_a_sensor_is_dropped_and_shown(survey):
    survey.types["vlp16"].use = True
    assert bpy.ops.seip.drop_sensor_type(key=DEFAULT_TYPE) == {"FINISHED"}
    assert used(survey) == ("vlp16",)
    with pytest.raises(RuntimeError, match="no sensor type 'none'"):
        bpy.ops.seip.drop_sensor_type(key="none")
    assert bpy.ops.seip.about_sensor(key="vlp16") == {"FINISHED"}
    assert bpy.context.scene.seip.sections.about_sensor
    layout = DrawnLayout()
    bpy.context.scene.seip.sections.sensors = True
    sensors.draw(layout, bpy.context)
    assert "Velodyne VLP-16 (Puck)" in layout.text
    assert sensors.status(bpy.context.scene) == "VLP-16 (Puck) at 3.5–8 m"


def test_the_preview_is_of_the_shown_type_at_the_cursor(survey):
    bpy.context.scene.cursor.location = (7.0, 8.0, 1.0)
    survey.types["vlp16"].use = True
    survey.about = "vlp16"
    survey.preview_height = 6.0
    preview = beam_preview.preview_of(bpy.context)
    assert preview.model.key == "vlp16"
    assert preview.place.tolist() == [7.0, 8.0, 7.0]
    assert np.allclose(preview.lines().rings[..., 2], 1.0 + beam_preview.LIFT)
    assert 0 < preview.resolved_to() < preview.range_on_road()


def test_the_preview_is_of_the_active_sensor(survey):
    empty = bpy.data.objects.new("sensor", None)
    empty["seip_sensor"], empty["seip_height"] = "type3", 5.4
    empty.location = (1.0, 2.0, 5.6)
    bpy.context.scene.collection.objects.link(empty)
    bpy.context.view_layer.objects.active = empty
    bpy.context.view_layer.update()
    preview = beam_preview.preview_of(bpy.context)
    assert preview.model.key == "type3"
    assert np.allclose(preview.lines().rings[..., 2], 0.2 + beam_preview.LIFT)


def test_the_preview_of_an_unknown_type_is_none(survey):
    survey.types.add().name = survey.about = "lost"  # used, as it is new
    assert beam_preview.preview_of(bpy.context) is None


def test_the_cache_is_emptied_of_grids_alone(survey):
    folder = preferences.cache_folder()
    with pytest.raises(RuntimeError, match="The cache is empty"):
        bpy.ops.seip.empty_cache()
    folder.mkdir(parents=True)
    (folder / f"{'a' * 32}.npz").write_bytes(b"x" * 1000)
    pieces = folder / f"{'b' * 32}.pieces"
    pieces.mkdir()
    (pieces / "1.npz").write_bytes(b"x" * 500)
    (folder / "mine.txt").write_text("mine", encoding="utf-8")
    assert bpy.ops.seip.empty_cache() == {"FINISHED"}
    assert [entry.name for entry in folder.iterdir()] == ["mine.txt"]


def test_cores_are_those_that_the_user_allows(own):
    own.cores = 1
    assert preferences.cores() == 1
    own.cores = 1000
    assert preferences.cores() == MAX_THREADS


def test_tilts_are_degrees_in_the_panel_and_radians_inside(survey):
    assert survey.settings().candidates.tilts == (0.0,)
    survey.tilts = "-5 0:10:5"
    assert np.degrees(survey.settings().candidates.tilts) == pytest.approx([-5, 0, 5, 10])
    for text, sentence in (
        ("0 0", "given twice"),
        ("90", "less than 90°"),
        ("", "no tilt"),
        ("down", "neither a tilt"),
    ):
        survey.tilts = text
        with pytest.raises(SeipError, match=sentence):
            survey.settings()


def test_the_preview_of_a_tilted_sensor_says_what_lies_before_it(survey):
    model = session.sensor_types["type1"]
    place = np.array([0.0, 0.0, 5.4])
    upright, tilted = (beam_preview.Preview(model, place, orientation(0.5, tilt), 5.4, 1.0) for tilt in (0.0, 0.2))
    assert upright.tilt == 0.0
    assert tilted.tilt == pytest.approx(0.2)
    assert upright.resolved_to() == unresolved_from(model, 5.4, 1.0, upright.range_on_road())
    assert tilted.resolved_to() == pytest.approx(unresolved_from(model, 5.4, 1.0, upright.range_on_road(), 0.2))


def test_heights_and_tilts_are_checked_as_they_are_typed(survey):
    assert (survey.wrong_heights(), survey.wrong_tilts()) == ("", "")
    survey.heights, survey.tilts = "8 high", "95"
    assert "'high' is neither a height" in survey.wrong_heights()
    assert "less than 90°" in survey.wrong_tilts()
    survey.heights, survey.tilts = "", "0:10:5"
    assert "no mounting height is given" in survey.wrong_heights()
    assert survey.wrong_tilts() == ""
