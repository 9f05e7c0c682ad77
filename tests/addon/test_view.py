"""What the viewport shows: colours of the coverage, sight lines, and overlays that are always removed."""

import bpy
import numpy as np
import pytest

import seip_addon
from seip_addon.panel import overlays
from seip_addon.panel.coverage import SIGHT_LINES as SIGHT
from seip_addon.panel.coverage import legend_of_coverage
from seip_addon.panel.session import session
from seip_addon.scene.sensors import placed_sensors


@pytest.fixture
def placed(junction):
    bpy.ops.seip.solve_placement()
    return junction


def handler_count():
    return len(overlays._handles)  # noqa: SLF001  # nobody else asks


def test_coverage_is_coloured_with_a_legend(placed):
    for aspect in ("seen", "times", "weights"):
        assert bpy.ops.seip.colour_coverage(aspect=aspect) == {"FINISHED"}
        block = legend_of_coverage(placed)
        words = [entry.words for entry in block.entries]
        shares = [float(one.split()[-1].rstrip("%")) for one in words if one.endswith("%")]
        assert sum(shares) == pytest.approx(100.0, abs=0.3)
        assert words[len(shares) :] == ["weighted region", "no sensor allowed"]
        assert handler_count() == 2


def test_sight_lines_are_the_row_of_the_grid(placed):
    held = session.of(placed).state
    sensor = held.solution.deployment.sensors[1]
    placed.seip.result.active_sensor = 1
    assert bpy.ops.seip.show_sight_lines() == {"FINISHED"}
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
    assert title.startswith(sensor.label)
    assert title.endswith(f"{row.sum() + unseen // 6:,} targets in its range")
    assert words[1:] == [
        f"{len(hidden.positions) // 6:,} hidden by something",
        f"{len(missed.positions) // 6:,} in view, but between beams or too faint",
    ]


@pytest.mark.parametrize("ending", ["another file", "unregister"])
def test_draw_handlers_are_always_removed(placed, ending):
    bpy.ops.seip.colour_coverage(aspect="times")
    bpy.ops.seip.show_sight_lines()
    assert handler_count() == 2
    if ending == "another file":
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    else:
        seip_addon.unregister()
    assert handler_count() == 0
    if ending == "unregister":
        seip_addon.register()


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
    scene.seip.view.legend = False
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert handler_count() == 0


def test_labels_are_of_sensors_that_are_shown_where_they_are(placed):
    sensors = placed_sensors(placed)
    sensors["S1"].hide_set(True)
    sensors["S2"].location.x += 5.0
    bpy.context.view_layer.update()
    ((words, place),) = overlays.labels_of(placed)
    assert words == "S2  Type 1"
    assert place == pytest.approx(tuple(sensors["S2"].location))
