"""Looking at a placement: comparison, and sensors that a hand moves."""

import bpy
import numpy as np
import pytest

from seip_addon import live_coverage, preferences
from seip_addon.core.errors import SeipError
from seip_addon.core.output.results.comparison import unpacked_counts
from seip_addon.core.output.results.placement_file import parsed_record
from seip_addon.panels import results as results_panel
from seip_addon.scene.sensors import placed_sensors
from seip_addon.session import scene_of, session
from seip_addon.viewport.coverage import legend_of_coverage
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


def test_a_click_selects_the_sensor(placed):
    placed.seip.result.active_sensor = 1
    assert [obj["seip_label"] for obj in bpy.context.selected_objects] == ["S2"]


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
    layout = drawn_comparison(placed)
    texts = [text for text, _ in layout.labels]
    start = texts.index("Share of the Road")
    assert texts[start + 1 : start + 9] == [
        "  Seen by both",
        f"{np.mean(before & after):.2%}",
        "  Seen only by the kept",
        f"{np.mean(before & ~after):.2%}",
        "  Seen only by the present",
        f"{np.mean(after & ~before):.2%}",
        "  Seen by neither",
        f"{np.mean(~before & ~after):.2%}",
    ]
    assert "seip.show_comparison" in dict(layout.operators)
    bpy.ops.seip.show_comparison(back=True)
    assert (shown(placed) > 0).sum() == after.sum()


def test_other_targets_are_not_compared(placed):
    bpy.ops.seip.keep_placement(name="coarse")
    placed.seip.survey.grid = 5.0
    bpy.ops.seip.solve_placement()
    with pytest.raises(RuntimeError, match="made on different targets"):
        bpy.ops.seip.show_comparison()
    layout = drawn_comparison(placed)
    assert "different targets" in layout.text
    assert "Share of the Road" not in layout.text
    assert "seip.show_comparison" not in dict(layout.operators)


def drawn_comparison(scene: bpy.types.Scene) -> DrawnLayout:
    scene.seip.sections.comparison = True
    layout = DrawnLayout()
    results_panel.draw(layout, bpy.context)
    return layout


def test_kept_placements_have_names_and_can_be_forgotten(placed):
    bpy.ops.seip.keep_placement()
    bpy.ops.seip.keep_placement()
    bpy.ops.seip.keep_placement(name="Placement 1")
    assert [one.name for one in placed.seip.kept] == ["Placement 1", "Placement 2"]
    bpy.ops.seip.drop_placement()
    assert [one.name for one in placed.seip.kept] == ["Placement 2"]


def test_moved_sensors_are_followed(placed):
    before = shown(placed)
    coverage = parsed_record(placed.seip.result.record).coverage.whole
    assert bpy.ops.seip.follow_sensors() == {"FINISHED"}
    assert session.following.coverage == pytest.approx(coverage, abs=1e-9)
    assert (shown(placed) == before).all()
    assert session.following.moved == ()

    first = placed_sensors(placed)["S1"]
    there = first.location.copy()
    first.location.z -= 4.0
    bpy.context.view_layer.update()
    assert bpy.app.timers.is_registered(live_coverage.update)
    live_coverage.update()
    assert session.following.moved == ("S1",)
    assert (shown(placed) != before).any()
    assert session.following.coverage == pytest.approx((shown(placed) > 0).mean())

    first.location = there
    live_coverage.update()
    assert session.following.moved == ()
    assert (shown(placed) == before).mean() > 0.99  # the place is in single precision

    first.rotation_euler.x = 0.4  # tilted: every ray is cast
    live_coverage.update()
    assert session.following.moved == ("S1",)
    bpy.data.objects.remove(first)
    live_coverage.update()
    assert (shown(placed) <= 1).all()


def test_a_level_turn_of_a_whole_step_sees_the_same(placed):
    bpy.ops.seip.follow_sensors()
    before = shown(placed)
    first = placed_sensors(placed)["S1"]
    first.rotation_euler.z += np.pi
    live_coverage.update()
    assert session.following.moved == ("S1",)
    assert (shown(placed) == before).mean() > 0.97


def test_following_leaves_nothing_behind(placed):
    handlers = bpy.app.handlers.depsgraph_update_post
    count = len(handlers)
    bpy.ops.seip.follow_sensors()
    assert len(handlers) == count + 1
    bpy.ops.seip.follow_sensors()
    assert session.following is None
    assert len(handlers) == count
    bpy.ops.seip.follow_sensors()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert session.following is None


def test_following_stops_where_the_scene_has_changed(placed):
    bpy.ops.seip.follow_sensors()
    bpy.data.objects["building 1"].location.x += 1.0
    bpy.context.view_layer.update()
    live_coverage.update()
    assert "the scene has changed" in session.following.problem


def test_a_scene_that_is_deleted_during_the_work_has_its_sentence(placed):
    number = placed.session_uid
    bpy.ops.scene.new(type="NEW")
    bpy.data.scenes.remove(placed)
    with pytest.raises(SeipError, match="is gone: nothing was written"):
        scene_of(number)


def test_tilted_sensors_are_where_the_placement_put_them_until_a_hand_turns_them(placed):
    placed.seip.survey.tilts = "12"
    bpy.ops.seip.solve_placement()
    known = session.state_of(placed)
    assert {sensor.tilt for sensor in known.solution.deployment.sensors} == {np.radians(12)}
    bpy.ops.seip.show_sight_lines(sensor="S1")

    bpy.ops.seip.follow_sensors()
    assert session.following.moved == ()
    coverage = session.following.coverage
    first = placed_sensors(placed)["S1"]
    first.rotation_euler.y = 0.0
    live_coverage.update()
    assert session.following.moved == ("S1",)
    assert session.following.coverage != coverage
    with pytest.raises(RuntimeError, match="S1 is not at a candidate pose"):
        bpy.ops.seip.show_sight_lines(sensor="S1")


CORNER = """
[corner]
name = "Corner"
manufacturer = "Test"
source = "Test"
channels = 32
field_of_view_deg = [-30.0, 0.0]
horizontal_field_of_view_deg = 120.0
range_m = [0.5, 100.0]
points_per_second = 200_000
rotation_rate_hz = 10.0
price_usd = [2_000, 2_000]
"""


def test_sensors_that_look_one_way_are_where_the_placement_put_them_until_a_hand_turns_them(junction, tmp_path):
    (tmp_path / "mine.toml").write_text(CORNER, encoding="utf-8")
    entry = bpy.context.preferences.addons.new()
    entry.module = preferences.ADDON_ID
    try:
        bpy.ops.seip.add_catalogue(filepath=str(tmp_path / "mine.toml"))
        for one in junction.seip.survey.types:
            one.use = one.name == "corner"
        bpy.ops.seip.solve_placement()
        known = session.state_of(junction)
        sensors, poses = known.solution.deployment.sensors, known.layout.site.candidates
        assert len(set(poses.yaw[poses.position_of == 0])) in range(1, 9)
        assert [sensor.yaw for sensor in sensors] == [poses.yaw[sensor.pose] for sensor in sensors]
        bpy.ops.seip.show_sight_lines(sensor="S1")
        bpy.ops.seip.follow_sensors()
        assert session.following.moved == ()

        coverage = session.following.coverage
        placed_sensors(junction)["S1"].rotation_euler.z += 0.9 * np.pi
        live_coverage.update()
        assert session.following.moved == ("S1",)
        assert session.following.coverage < coverage
        bpy.ops.seip.evaluate_sensors()
        record = parsed_record(junction.seip.result.record)
        moved = next(sensor for sensor in record.sensors if sensor.pose is None)
        assert (moved.yaw_deg - np.degrees(sensors[0].yaw)) % 360 == pytest.approx(162.0, abs=1e-3)
    finally:
        bpy.context.preferences.addons.remove(entry)
