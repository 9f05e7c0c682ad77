"""What the viewport shows: colours of the coverage, sight lines, and overlays that are always removed."""

from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest
from PIL import Image

import seip_addon
from seip_addon.core.output.pictures.plan_view import DPI, MAP_WIDTH, MARGIN
from seip_addon.core.output.pictures.sheet import GAP
from seip_addon.operators import view
from seip_addon.panels import view as view_section
from seip_addon.scene.sensors import placed_sensors
from seip_addon.scene.write import ASPECT, coverage_of
from seip_addon.session import session
from seip_addon.viewport import overlays, picture
from seip_addon.viewport.coverage import legend_of_coverage, shows_coverage
from seip_addon.viewport.sight_lines import NAME as SIGHT


@pytest.fixture
def placed(junction):
    bpy.ops.seip.solve_placement()
    return junction


def handler_count():
    return len(overlays._handles)  # noqa: SLF001  # nobody else asks


def test_nothing_can_be_shown_before_a_placement(junction):
    with pytest.raises(RuntimeError, match="There is no coverage to show: place sensors first"):
        bpy.ops.seip.colour_coverage()
    with pytest.raises(RuntimeError, match="There is no placement yet: place sensors first"):
        bpy.ops.seip.show_sight_lines()
    assert handler_count() == 0


@pytest.mark.parametrize("aspect", ["seen", "times", "weights"])
def test_coverage_is_coloured_with_a_legend(placed, aspect):
    assert bpy.ops.seip.colour_coverage(aspect=aspect) == {"FINISHED"}
    block = legend_of_coverage(placed)
    words = [entry.words for entry in block.entries]
    shares = [float(one.split()[-1].rstrip("%")) for one in words if one.endswith("%")]
    assert sum(shares) == pytest.approx(100.0, abs=0.3)
    assert words[len(shares) :] == ["weighted region", "no sensor allowed"]
    assert handler_count() == 2


def test_one_of_the_buttons_of_colours_is_always_pressed(placed):
    def pressed():
        layout = MagicMock()
        context = SimpleNamespace(scene=placed, space_data=SimpleNamespace(shading=SimpleNamespace(type="MATERIAL")))
        view_section._draw_coverage(layout, context)  # noqa: SLF001  # the part with the buttons
        calls = layout.column().row().operator.call_args_list
        return [call.kwargs["text"] for call in calls if call.kwargs.get("depress") and call.kwargs["text"]]

    assert pressed() == ["Sensors"]
    for aspect, words in (("seen", "Seen"), ("weights", "Weights"), ("times", "Sensors")):
        bpy.ops.seip.colour_coverage(aspect=aspect)
        assert pressed() == [words]


def test_sight_lines_are_the_row_of_the_grid(placed):
    held = session.state_of(placed)
    sensor = held.solution.deployment.sensors[1]
    assert bpy.ops.seip.show_sight_lines(sensor=sensor.label) == {"FINISHED"}
    overlay = overlays.find(placed, SIGHT)
    hidden, missed, lines = overlay.layers
    row = held.survey.grid.visible[sensor.pose]
    assert len(lines.positions) == 2 * row.sum()
    assert np.allclose(lines.positions[::2], sensor.xyz, atol=1e-3)
    assert np.allclose(lines.positions[1::2, :2], held.survey.site.targets.xyz[row, :2], atol=1e-3)
    distance = np.linalg.norm(held.survey.site.targets.xyz - sensor.xyz, axis=1)
    unseen = len(hidden.positions) + len(missed.positions)
    assert unseen == 6 * (~row & (distance <= sensor.model.max_range)).sum()
    title, *words = overlay.legend(placed).title, *(entry.words for entry in overlay.legend(placed).entries)
    assert title.endswith(f"{row.sum() + unseen // 6:,} targets in its range")
    assert words[1:] == [
        f"{len(hidden.positions) // 6:,} hidden by something",
        f"{len(missed.positions) // 6:,} in view, but between beams or too faint",
    ]
    assert overlay.about == sensor.label


def test_a_sensor_that_was_moved_has_no_sight_lines(placed):
    obj = next(obj for obj in bpy.data.collections["SEIP Sensors"].objects if obj.get("seip_label") == "S1")
    obj.location.x += 0.5
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="S1 is not at a candidate pose"):
        bpy.ops.seip.show_sight_lines(sensor="S1")


def test_undo_takes_colours_and_legend_back(placed):
    bpy.ops.ed.undo_push(message="placed")
    bpy.ops.seip.colour_coverage(aspect="seen")
    bpy.ops.ed.undo_push(message="coloured")
    bpy.ops.ed.undo()
    assert legend_of_coverage(bpy.context.scene).entries[2].words.startswith("seen by two or more")


@pytest.mark.parametrize("ending", ["toggle", "another file", "unregister", "delete the scene"])
def test_draw_handlers_are_always_removed(placed, ending):
    bpy.ops.seip.colour_coverage(aspect="times")
    bpy.ops.seip.show_sight_lines(sensor="S1")
    assert handler_count() == 2
    if ending == "toggle":
        bpy.ops.seip.toggle_legend()
        assert handler_count() == 2
        bpy.ops.seip.hide_sight_lines()
    elif ending == "another file":
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    elif ending == "unregister":
        seip_addon.unregister()
    else:
        other = bpy.data.scenes.new("other")
        bpy.data.scenes.remove(placed)
        overlays.hide(other, SIGHT)
    assert handler_count() == 0
    if ending == "unregister":
        seip_addon.register()


def test_a_picture_has_the_view_and_the_plan(placed, tmp_path, monkeypatch):
    monkeypatch.setattr(picture, "view_pixels", lambda *_: np.zeros((540, 960, 3), dtype=np.uint8))
    for _ in range(2):
        path = view._free(view._named(str(tmp_path / "report.png")))  # noqa: SLF001  # as the operator names it
        view.save_viewport_sheet(path, placed, None, session.state_of(placed))
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["report-2.png", "report.png"]
    with Image.open(tmp_path / "report.png") as sheet:
        plan = round(DPI * (MAP_WIDTH + 2 * MARGIN))
        assert sheet.width == 2 * plan + 3 * GAP
        assert sheet.width > sheet.height


def test_a_picture_of_a_viewport_needs_one(placed, tmp_path):
    placed.seip.view.picture = str(tmp_path / "report.png")
    with pytest.raises(RuntimeError, match="there is no viewport here to take a picture of"):
        bpy.ops.seip.save_picture()


def test_another_scene_shows_nothing_of_this_one(placed):
    bpy.ops.seip.colour_coverage(aspect="times")
    other = bpy.data.scenes.new("other")
    assert overlays.overlays_of(other) == []
    assert len(overlays.overlays_of(placed)) == 1


def test_a_view_that_hides_the_colours_is_set_in_one_click(placed):
    screen = bpy.context.window_manager.windows[0].screen
    area = next(area for area in screen.areas if area.type == "VIEW_3D")
    space = area.spaces.active
    space.shading.type, space.shading.color_type = "SOLID", "OBJECT"
    assert not shows_coverage(space)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area):
        bpy.ops.seip.show_coverage_colours()
    assert shows_coverage(space)


def test_a_placement_shows_its_coverage_with_legend_and_labels_and_so_does_the_file_when_it_is_opened(placed, tmp_path):
    blocks, labels = overlays.legend_blocks(placed), overlays.labels_of(placed)
    assert [block.title for block in blocks] == ["Road surface"]
    assert [words for words, _ in labels] == ["S1  Type 1", "S2  Type 1"]
    path = tmp_path / "placed.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene = bpy.context.scene
    assert overlays.legend_blocks(scene) == blocks
    assert overlays.labels_of(scene) == labels
    bpy.ops.seip.toggle_legend()
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert handler_count() == 0


def test_the_legend_names_the_areas_that_are_shown(placed):
    regions = bpy.data.collections["SEIP Weighted Regions"].objects
    for obj in regions:
        obj.hide_set(True)
    assert [entry.words for entry in legend_of_coverage(placed).entries][3:] == ["no sensor allowed"]
    for obj in bpy.data.collections["SEIP Forbidden Areas"].objects:
        obj.hide_set(True)
    assert len(legend_of_coverage(placed).entries) == 3


def test_the_aspect_that_was_chosen_is_shown_after_placing_again(placed):
    bpy.ops.seip.colour_coverage(aspect="weights")
    placed.seip.goal.count = 1
    bpy.ops.seip.solve_placement()
    assert coverage_of(placed)[ASPECT] == "weights"
    assert legend_of_coverage(placed).title == "Weight"


def test_labels_are_of_sensors_that_are_shown_where_they_are(placed):
    sensors = placed_sensors(placed)
    sensors["S1"].hide_set(True)
    sensors["S2"].location.x += 5.0
    bpy.context.view_layer.update()
    ((words, place),) = overlays.labels_of(placed)
    assert words == "S2  Type 1"
    assert place == pytest.approx(tuple(sensors["S2"].location))
