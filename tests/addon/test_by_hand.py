"""Sensors that hands have moved: nothing puts them back, and they are evaluated, kept and exported as what they are."""

import json
import math
from pathlib import Path

from headless import place

import bpy
import numpy as np
import pytest

from seip_addon.core.choosing.placement.objective import MOVED, MOVED_MESSAGE, Objective
from seip_addon.core.output.pictures.palette import unpacked_counts
from seip_addon.core.output.results.answer import status_text
from seip_addon.core.output.results.placement_record import comparable, load_placement, parsed_record
from seip_addon.panel import coverage, following, placement, results, scene_status, sensors
from seip_addon.panel.scene_status import sensor_edits
from seip_addon.panel.session import session
from seip_addon.scene import result_folder
from seip_addon.scene.blend_file import save_blend
from seip_addon.scene.result_folder import FILES
from seip_addon.scene.sensors import placed_sensors
from tests.builders.drawn_layout import DrawnLayout
from tests.oracles.json_schema import violations

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def placed(junction, tmp_path):
    scene = junction
    scene.seip.goal.count = 3
    scene.seip.result.folder, scene.seip.result.report = str(tmp_path / "out"), False
    bpy.ops.seip.solve_placement()
    return scene


def move(scene: bpy.types.Scene) -> None:
    """Lower and turn S1 in all ways, and delete S3."""
    sensors = placed_sensors(scene)
    sensors["S1"].location.z -= 3.0
    sensors["S1"].rotation_euler = (0.1, 0.2, 0.3)
    bpy.data.objects.remove(sensors["S3"])
    bpy.context.view_layer.update()


def record(scene: bpy.types.Scene) -> dict:
    return json.loads(scene.seip.result.record)


def full_scan(scene: bpy.types.Scene) -> np.ndarray:
    """Return which targets the sensors see as followed sensors do, which go another way through the code."""
    bpy.ops.seip.follow_sensors()
    seen = np.sum([row for _, row, _ in session.following.sensors.values()], axis=0)
    assert not sensor_edits(scene)
    following.stop()
    return seen


OPTIONS = ["--heights", "8", "--grid", "4", "--spacing", "12", "--count", "2", "--sensor", "type1", "--no-render"]


def test_a_file_of_a_command_opens_with_its_placement_and_settings(add_on, small_scene, tmp_path):
    more = [
        "--min-distance",
        "10",
        "--weather",
        "rain=2.5",
        "visibility=300",
        "--weighted",
        "3",
        "--require",
        "signal pole 1",
    ]
    place.main([str(small_scene), *OPTIONS, *more, "-o", str(tmp_path)])
    written = load_placement(tmp_path / "placement.json")
    for _ in range(2):  # as written, and saved by the add-on
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "placed.blend"))
        scene = bpy.context.scene
        assert parsed_record(scene.seip.result.record) == written
        assert scene.seip.goal.objective() == written.request.goal
        assert [one.name for one in scene.seip.result.sensors] == ["S1", "S2"]
        assert bpy.ops.seip.compare_scene() == {"FINISHED"}
        assert scene_status.stale_placement(scene) == ""
        assert not sensor_edits(scene)
        assert placement.status(scene).result[0] == status_text(written).split(" · ")[0]
        assert sensors.status(scene) == (False, ("2 × Type 1 (16 channels)", "at 8 m"))
        bpy.ops.wm.save_mainfile()
    place.main([str(tmp_path / "placed.blend"), *OPTIONS, "-o", str(tmp_path / "again")])
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "again" / "placed.blend"))
    assert parsed_record(bpy.context.scene.seip.result.record).request.goal == Objective(count=2)


def test_a_file_of_an_earlier_command_opens_with_its_sensors_which_are_evaluated_there(
    add_on, small_scene, tmp_path, monkeypatch
):
    monkeypatch.setattr(result_folder, "_save_placed", lambda path, *_: save_blend(path))
    place.main([str(small_scene), *OPTIONS, "-o", str(tmp_path)])
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "placed.blend"))
    scene = bpy.context.scene
    assert placement.status(scene).result == ("2 sensors", "not evaluated")
    assert scene_status.current_step(scene) == "placement"
    assert sensors.status(scene).result[0] == "Type 1 (16 channels)"
    bpy.context.window_manager.seip_sections.view = True
    monkeypatch.setattr(coverage, "shows_coverage", lambda _: True)  # there is no 3D view
    layout = DrawnLayout()
    results.draw(layout, bpy.context)
    assert "seip.colour_coverage" in dict(layout.operators)
    scene.seip.survey.heights, scene.seip.survey.grid, scene.seip.survey.spacing = "8", 4.0, 12.0
    assert bpy.ops.seip.evaluate_sensors() == {"FINISHED"}
    evaluated = parsed_record(scene.seip.result.record)
    assert evaluated.coverage == load_placement(tmp_path / "placement.json").coverage
    assert placement.status(scene).changed is False
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "evaluated.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "evaluated.blend"))
    assert placement.status(bpy.context.scene).changed is False


def test_moved_sensors_are_neither_exported_nor_kept_as_what_they_were(placed):
    move(placed)
    for operator in (bpy.ops.seip.export_result, bpy.ops.seip.keep_placement):
        with pytest.raises(RuntimeError, match=r"By hand: S1 moved; S3 deleted\. Press Evaluate Sensors"):
            operator()


def test_moved_sensors_are_evaluated_where_they_are_mounted(placed):
    before = record(placed)
    move(placed)
    pose = placed_sensors(placed)["S1"].matrix_world.copy()
    assert bpy.ops.seip.evaluate_sensors() == {"FINISHED"}
    assert placed_sensors(placed)["S1"].matrix_world == pose
    assert not sensor_edits(placed)
    now = record(placed)
    assert [line["id"] for line in now["sensors"]] == ["S1", "S2"]
    first, second = now["sensors"]
    assert first["pose"] is None
    assert first["position"] == f"by hand, from {before['sensors'][0]['position']}"
    assert first["local_m"] == pytest.approx(list(pose.translation), abs=1e-5)
    assert [first[f"{name}_deg"] for name in ("roll", "tilt", "yaw")] == pytest.approx(
        [math.degrees(angle) for angle in (0.1, 0.2, 0.3)], abs=1e-4
    )
    assert first["height_m"] == pytest.approx(5.0, abs=0.2)
    assert {**second, **dict.fromkeys(("coverage_added", "coverage_marginal"))} == {
        **before["sensors"][1],
        **dict.fromkeys(("coverage_added", "coverage_marginal")),
    }
    objective = now["objective"]
    assert (objective["status"], objective["bound"], objective["gap"]) == (MOVED, None, None)
    assert now["price_usd"] == sum(line["price_usd"] for line in now["sensors"])
    seen = unpacked_counts(placed.seip.result.seen)
    assert (full_scan(placed) == seen).all()
    assert now["coverage"]["whole"] == pytest.approx((seen > 0).mean(), abs=1e-9)
    assert now["coverage"]["whole"] != before["coverage"]["whole"]
    assert bpy.data.objects["Coverage"]["seip_coverage"] == pytest.approx(now["coverage"]["whole"])
    schema = json.loads((ROOT / "docs" / "placement.schema.json").read_text(encoding="utf-8"))
    assert violations(now, schema) == []


@pytest.mark.slow
def test_an_evaluated_deployment_is_kept_compared_and_exported(placed, tmp_path):
    bpy.ops.seip.keep_placement(name="placed")
    move(placed)
    bpy.ops.seip.evaluate_sensors()
    bpy.ops.seip.keep_placement(name="by hand")
    assert [json.loads(one.record)["objective"]["status"] for one in placed.seip.kept] == ["optimal", MOVED]
    placed.seip.active_kept = 0
    assert bpy.ops.seip.show_comparison() == {"FINISHED"}
    there = {name: obj.matrix_world.copy() for name, obj in placed_sensors(placed).items()}
    assert bpy.ops.seip.export_result() == {"FINISHED"}
    assert {name: obj.matrix_world for name, obj in placed_sensors(placed).items()} == there
    out = tmp_path / "out"
    written = load_placement(out / "placement.json")
    assert comparable(written) == comparable(parsed_record(placed.seip.result.record))
    moved = next(one for one in written.sensors if one.id == "S1")
    assert moved.pose is None
    assert moved.local_m[2] == pytest.approx(there["S1"].translation.z, abs=1e-3)
    assert (moved.tilt_deg, moved.roll_deg) == pytest.approx((math.degrees(0.2), math.degrees(0.1)), abs=1e-4)
    bpy.ops.wm.open_mainfile(filepath=str(out / "placed.blend"))
    scene = bpy.context.scene
    assert {name: obj.matrix_world for name, obj in placed_sensors(scene).items()} == there
    assert not sensor_edits(scene)
    assert bpy.ops.seip.export_result() == {"FINISHED"}  # found again from the file and the cache
    assert comparable(load_placement(out / "placement.json")) == comparable(written)
    assert session.of(scene).state.solution.certificate == MOVED_MESSAGE


def test_an_export_that_fails_or_is_stopped_leaves_the_earlier_one_whole(placed, tmp_path, monkeypatch):
    bpy.ops.seip.export_result()
    out = tmp_path / "out"
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    assert before.keys() == {*FILES, "visibility.npz"} - {"view.png"}
    placed.seip.goal.count = 1
    bpy.ops.seip.solve_placement()
    work = next(bpy.types.SEIP_OT_export_result.job(None, placed))
    for _ in range(2):
        next(work)
    work.close()  # as Stop does
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before

    def full(*_: object, **_named: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(result_folder, "draw_plan", full)
    with pytest.raises(RuntimeError, match="No space left on device"):
        bpy.ops.seip.export_result()
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    monkeypatch.undo()
    monkeypatch.setattr("seip_addon.panel.preferences.cache_folder", lambda: tmp_path / "cache")
    bpy.ops.seip.export_result()
    assert (out / "placement.json").read_bytes() != before["placement.json"]
