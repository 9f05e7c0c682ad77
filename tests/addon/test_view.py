"""What the viewport shows: colours of the coverage, sight lines, and overlays that are always removed."""

import bpy
import numpy as np
import pytest

import seip_addon
from seip_addon.core.choosing.placement.returns_summary import returns_text
from seip_addon.core.output.pictures.palette import unpacked_counts
from seip_addon.core.output.results.placement_record import parsed_record
from seip_addon.panel import following, overlays
from seip_addon.panel import results as results_panel
from seip_addon.panel.coverage import SIGHT_LINES as SIGHT
from seip_addon.panel.coverage import legend_of_coverage
from seip_addon.panel.scene_status import sensor_edits
from seip_addon.panel.session import session
from seip_addon.scene.sensors import placed_sensors
from tests.builders.drawn_layout import DrawnLayout


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


def shown(scene: bpy.types.Scene) -> np.ndarray:
    mesh = bpy.data.objects["Coverage"].data
    counts = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.attributes["seip_seen"].data.foreach_get("value", counts)
    return counts


def test_two_placements_are_compared_target_by_target(placed):
    bpy.ops.seip.keep_placement(name="two")
    before = unpacked_counts(placed.seip.result.seen) > 0
    placed.seip.goal.count = 1
    bpy.ops.seip.solve_placement()
    after = unpacked_counts(placed.seip.result.seen) > 0
    assert bpy.ops.seip.show_comparison() == {"FINISHED"}
    mesh = bpy.data.objects["Coverage"].data
    words = np.array([material.name.removeprefix("SEIP ") for material in mesh.materials])
    index = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("material_index", index)
    assert (words[index] == "seen only by the kept").sum() == (before & ~after).sum() > 0
    assert (words[index] == "seen only by the present").sum() == (after & ~before).sum()
    legend = legend_of_coverage(placed)
    assert [entry.words for entry in legend.entries[:4]] == [
        f"seen by neither  {np.mean(~before & ~after):.1%}",
        f"seen by both  {np.mean(before & after):.1%}",
        f"seen only by the present  {np.mean(after & ~before):.1%}",
        f"seen only by the kept  {np.mean(before & ~after):.1%}",
    ]
    assert (shown(placed) > 0).sum() == after.sum()


def test_moved_sensors_are_followed(placed):
    before = shown(placed)
    coverage = parsed_record(placed.seip.result.record).coverage.whole
    assert bpy.ops.seip.follow_sensors() == {"FINISHED"}
    assert session.following.coverage == pytest.approx(coverage, abs=1e-9)
    assert (shown(placed) == before).all()
    assert sensor_edits(placed) == ""

    first = placed_sensors(placed)["S1"]
    there = first.location.copy()
    first.location.z -= 4.0
    bpy.context.view_layer.update()
    assert bpy.app.timers.is_registered(following.update)
    following.update()
    assert sensor_edits(placed) == "By hand: S1 moved."
    assert (shown(placed) != before).any()
    assert session.following.coverage == pytest.approx((shown(placed) > 0).mean())

    first.location = there
    following.update()
    assert sensor_edits(placed) == ""
    assert (shown(placed) == before).mean() > 0.99  # the place is in single precision

    first.rotation_euler.x = 0.4  # tilted: every ray is cast
    following.update()
    assert sensor_edits(placed) == "By hand: S1 moved."
    bpy.data.objects.remove(first)
    following.update()
    assert (shown(placed) <= 1).all()


def test_a_placement_for_returns_is_followed_and_compared_by_returns(junction):
    scene = junction
    scene.seip.goal.criterion = "returns"
    bpy.ops.seip.solve_placement()
    before = parsed_record(scene.seip.result.record).returns.typical
    assert bpy.ops.seip.follow_sensors() == {"FINISHED"}
    assert session.following.summary.typical == pytest.approx(before, rel=1e-3)
    layout = DrawnLayout()
    results_panel.draw(layout, bpy.context)
    assert f"{returns_text(before)} returns" in layout.text
    bpy.ops.seip.keep_placement(name="all")
    placed_sensors(scene)["S1"].location.z += 500.0
    following.update()
    now = session.following.summary.typical
    assert now < before
    layout = DrawnLayout()
    results_panel.draw(layout, bpy.context)
    assert f"{returns_text(before)} → {returns_text(now)} returns" in layout.text
    returns = np.empty(len(bpy.data.objects["Coverage"].data.polygons), dtype=np.float32)
    bpy.data.objects["Coverage"].data.attributes["seip_returns"].data.foreach_get("value", returns)
    one = session.following.returns.near_targets([row for _, _, row in session.following.sensors.values()])
    assert returns == pytest.approx(one, rel=1e-5)
    bpy.ops.seip.evaluate_sensors()
    record = parsed_record(scene.seip.result.record)
    assert record.returns.typical == pytest.approx(now, rel=1e-3)
    assert "returns instead of" in scene.seip.result.change
    bpy.context.window_manager.seip_sections.comparison = True
    layout = DrawnLayout()
    results_panel.draw(layout, bpy.context)
    assert f"Returns {returns_text(before)} {returns_text(now)}" in layout.text
