"""Looking at a placement: comparison, and sensors that a hand moves."""

import bpy
import numpy as np
import pytest

from seip_addon.core.choosing.placement.returns_summary import returns_text
from seip_addon.core.output.pictures.colours import unpacked_counts
from seip_addon.core.output.results.placement_record import parsed_record
from seip_addon.panel import following
from seip_addon.panel import results as results_panel
from seip_addon.panel.coverage import legend_of_coverage
from seip_addon.panel.scene_status import sensor_edits
from seip_addon.panel.session import session
from seip_addon.scene.sensors import placed_sensors
from tests.builders.drawn_layout import DrawnLayout


@pytest.fixture
def placed(junction):
    scene = junction
    bpy.ops.seip.solve_placement()
    return scene


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
