"""From a click to placed sensors: operators do what the batch command does, and what they find outlives the file."""

import json
import math
from collections.abc import Generator
from dataclasses import replace
from types import SimpleNamespace

from headless import place

import bpy
import numpy as np
import pytest

from seip_addon.core.base.progress import Progress, finish
from seip_addon.core.choosing.placement.scenarios import DEFAULT_COUNTS
from seip_addon.core.output.results.placement_record import comparable, load_placement, parsed_record
from seip_addon.core.sensing.visibility.grid import VisibilityGrid
from seip_addon.core.sensing.visibility.ray_casting import BvhRayCaster, EmbreeRayCaster
from seip_addon.panel import export as export_panel
from seip_addon.panel import overlays, scene_status, sensors
from seip_addon.panel import placement as placement_panel
from seip_addon.panel.placement import search_overlay
from seip_addon.panel.session import session
from seip_addon.scene.sensors import placed_sensors
from tests.builders.drawn_layout import DrawnLayout

OPTIONS = ["--heights", "8", "--grid", "4", "--spacing", "12", "--count", "2", "--sensor", "type1", "--no-render"]


def labels(scene: bpy.types.Scene) -> list[str]:
    return sorted(placed_sensors(scene))


def test_panel_and_batch_write_the_same_placement(junction, tmp_path, small_scene):
    assert bpy.ops.seip.solve_placement() == {"FINISHED"}
    junction.seip.result.folder = str(tmp_path / "panel")
    assert bpy.ops.seip.export_result() == {"FINISHED"}
    assert (tmp_path / "panel" / "report.pdf").is_file()
    assert "With fewer or more sensors under the same rules" in (tmp_path / "panel" / "report.html").read_text(
        encoding="utf-8"
    )
    key = session.of(junction).state.survey.grid.key
    written = tmp_path / "panel"
    assert offered() == [str(written)]
    junction.seip.goal.count = 1
    bpy.ops.seip.solve_placement()
    place.main([str(small_scene), *OPTIONS, "-o", str(tmp_path / "batch")])
    panel, batch = (load_placement(tmp_path / name / "placement.json") for name in ("panel", "batch"))
    assert comparable(panel) == comparable(batch)
    assert VisibilityGrid.load(tmp_path / "batch" / "visibility.npz").key == key
    for name in ("site.npz", "visibility.npz"):
        assert (tmp_path / "panel" / name).read_bytes() == (tmp_path / "batch" / name).read_bytes()


def offered() -> list[str]:
    """Return the files of the result that the panel offers to open."""
    layout = DrawnLayout()
    export_panel.draw(layout, bpy.context)
    return [button.filepath for name, _, button in layout.buttons if name == "wm.path_open"]


def choices(scene: bpy.types.Scene) -> tuple[DrawnLayout, list[tuple[int, bool, bool]]]:
    """Return the drawn step, and each number of sensors: whether it is the placement's, and whether it is the goal."""
    layout = DrawnLayout()
    placement_panel.draw(layout, bpy.context)
    chosen = [(options, button) for name, options, button in layout.buttons if name == "seip.choose_number"]
    return layout, [(button.count, options["icon"] == "CHECKMARK", options["depress"]) for options, button in chosen]


def test_a_click_on_a_number_of_sensors_makes_it_the_goal(junction):
    bpy.ops.seip.solve_placement()
    record = parsed_record(junction.seip.result.record)
    assert [point.count for point in record.front] == [1, 2, 3, 4]
    assert choices(junction)[1] == []  # closed
    bpy.context.window_manager.seip_sections.numbers = True
    layout, numbers = choices(junction)
    assert numbers == [(1, False, False), (2, True, True), (3, False, False), (4, False, False)]
    assert layout.bars == [(point.coverage, f"{point.coverage:.1%} · ${point.price:,.0f}") for point in record.front]
    junction.seip.goal.limit = "BUDGET"
    assert bpy.ops.seip.choose_number(count=3) == {"FINISHED"}
    assert placement_panel.button_text(junction).startswith("Place 3 Sensors")
    assert choices(junction)[1] == [(1, False, False), (2, True, False), (3, False, True), (4, False, False)]
    bpy.ops.seip.solve_placement()
    placed = parsed_record(junction.seip.result.record)
    assert len(placed.sensors) == 3
    assert placed.coverage.whole == record.front[2].coverage  # of a site of this size, both are proven optimal
    assert placed.price_usd == record.front[2].price


def sentences(scene: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the sentences of the step as it is drawn."""
    said: list[str] = []
    monkeypatch.setattr(placement_panel, "draw_sentence", lambda _, text, **__: said.append(text))
    placement_panel.draw(DrawnLayout(), bpy.context)
    return said


def test_another_goal_makes_placing_the_next_step(junction, monkeypatch):
    bpy.ops.seip.solve_placement()
    goal = junction.seip.goal
    for name, value in (("count", 3), ("limit", "BUDGET"), ("weighting", "VALUE"), ("scenarios", "pose-errors")):
        before = getattr(goal, name)
        assert scene_status.next_step(junction) == scene_status.other_goal(junction) == ""
        setattr(goal, name, value)
        assert scene_status.next_step(junction) == "seip.solve_placement"
        assert placement_panel.status(junction).changed
        assert any("goal has changed" in text for text in sentences(junction, monkeypatch))
        setattr(goal, name, before)
    assert scene_status.next_step(junction) == scene_status.other_goal(junction) == ""


def test_a_placement_with_the_grid_at_hand_casts_no_ray(junction, monkeypatch):
    bpy.ops.seip.solve_placement()
    for caster in (BvhRayCaster, EmbreeRayCaster):
        monkeypatch.setattr(caster, "cast", None)
    assert bpy.ops.seip.solve_placement() == {"FINISHED"}


def work_of(operator: str, scene: bpy.types.Scene) -> Generator[Progress, None, object]:
    """Return the work of a button, which a thread would do."""
    return next(getattr(bpy.types, operator).job(SimpleNamespace(), scene))


def test_the_best_so_far_is_drawn_and_taken_away_again(junction):
    """What the search reports are the poses of the placement it ends with, and no object is written for them."""
    objects = set(bpy.data.objects)
    steps = []
    placed = finish(work_of("SEIP_OT_solve_placement", junction), steps.append)
    found = [step for step in steps if step.poses]
    assert found[-1].poses == tuple(sorted(placed.solution.placement.chosen.tolist()))
    assert found[0].what.startswith("visibility")  # the early answer
    posts, eyes = (overlay := search_overlay(placed.layout, found[-1])).layers
    placed_eyes = sorted(sensor.xyz.tolist() for sensor in placed.solution.deployment.sensors)
    np.testing.assert_allclose(sorted(eyes.positions.tolist()), placed_eyes, atol=1e-4)
    assert posts.positions[1::2].tolist() == eyes.positions.tolist()
    assert [words for words, _ in overlay.labels(junction)] == ["Type 1", "Type 1"]
    assert overlay.legend(junction).entries[0].words == f"best so far: {found[-1].best}"
    assert set(bpy.data.objects) == objects
    assert not overlays.overlays_of(junction)


def test_work_that_is_stopped_at_its_end_leaves_no_trace(junction):
    bpy.ops.seip.solve_placement()
    junction.seip.goal.count = 3
    junction.seip.survey.effort = 30.0
    before = session.of(junction).state
    seen = dict(vars(before))
    placed = finish(work_of("SEIP_OT_solve_placement", junction))
    assert len(placed.solution.deployment.sensors) == 3
    for name in ("follow_sensors", "show_sight_lines"):
        finish(work_of(f"SEIP_OT_{name}", junction))
        assert session.of(junction).state is before
        assert vars(before) == seen


def test_a_saved_placement_goes_on_without_computing(junction, tmp_path, monkeypatch):
    bpy.ops.seip.solve_placement()
    before = junction.seip.result.record
    path = tmp_path / "placed.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene = bpy.context.scene
    assert session.of(scene).state is None
    assert scene.seip.result.record == before
    for forbidden in ("sensing.visibility.grid.compute_visibility", "workflows.placing.optimise"):
        monkeypatch.setattr(f"seip_addon.core.{forbidden}", None)
    scene.seip.result.folder, scene.seip.result.report = "//out/", False
    assert bpy.ops.seip.export_result() == {"FINISHED"}
    assert comparable(load_placement(tmp_path / "out" / "placement.json")) == comparable(parsed_record(before))


def test_undo_brings_the_earlier_placement_back_and_redo_the_new(junction):
    bpy.ops.ed.undo_push(message="begin")
    bpy.ops.seip.solve_placement()
    bpy.ops.ed.undo_push(message="two")
    bpy.context.scene.seip.goal.count = 3
    bpy.ops.seip.solve_placement()
    bpy.ops.ed.undo_push(message="three")
    scene = bpy.context.scene
    assert labels(scene) == ["S1", "S2", "S3"]
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert labels(scene) == ["S1", "S2"]
    assert len(json.loads(scene.seip.result.record)["sensors"]) == 2
    bpy.ops.seip.follow_sensors()
    assert len(session.of(scene).state.solution.deployment.sensors) == 2
    bpy.ops.ed.redo()
    assert labels(bpy.context.scene) == ["S1", "S2", "S3"]


def test_rules_come_from_what_is_selected_and_hold(junction):
    bpy.ops.seip.solve_placement()
    first = placed_sensors(junction)["S1"]
    position = first["seip_position"]
    bpy.context.view_layer.objects.active = first
    assert bpy.ops.seip.add_rule(rule="FORBIDDEN") == {"FINISHED"}
    bpy.ops.seip.solve_placement()
    assert position not in {obj["seip_position"] for obj in placed_sensors(junction).values()}
    junction.seip.goal.position = position
    bpy.ops.seip.add_rule(rule="MANDATORY")
    assert [(one.name, one.rule) for one in junction.seip.goal.rules] == [(position, "MANDATORY")]
    bpy.ops.seip.solve_placement()
    assert position in {obj["seip_position"] for obj in placed_sensors(junction).values()}
    assert bpy.ops.seip.remove_entry(of="RULES") == {"FINISHED"}
    assert not junction.seip.goal.rules
    assert bpy.ops.seip.remove_entry(of="RULES") == {"CANCELLED"}


def test_a_file_of_a_newer_version_is_refused(junction, tmp_path):
    junction.seip.version = scene_status.FILE_VERSION + 1
    assert "newer version" in scene_status.obstacle(junction)
    with pytest.raises(RuntimeError, match="newer version of SEIP"):
        bpy.ops.seip.solve_placement()
    path = tmp_path / "newer.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert bpy.context.scene.seip.version == scene_status.FILE_VERSION + 1


@pytest.mark.slow
def test_panel_and_batch_place_alike_over_pose_errors(junction, tmp_path, small_scene, monkeypatch):
    monkeypatch.setitem(DEFAULT_COUNTS, "pose-errors", (6, 60))
    goal = junction.seip.goal
    goal.scenarios, goal.risk, goal.failures = "pose-errors", "worst-quarter", "mean"
    goal.position_error, goal.tilt_error = 0.5, math.radians(3)
    types = junction.seip.survey
    types.grid, types.spacing = 8.0, 25.0
    sensors.refresh()
    for one in types.types:
        one.use = one.name == "type1"
    assert bpy.ops.seip.solve_placement() == {"FINISHED"}
    panel = parsed_record(junction.seip.result.record)
    options = ["--heights", "8", "--grid", "8", "--spacing", "25", "--count", "2", "--no-render", "--sensor", "type1"]
    wrong = ["--pose-errors", "0.5", "3", "--failures", "mean", "--risk", "worst-quarter"]
    place.main([str(small_scene), *options, *wrong, "-o", str(tmp_path)])
    batch = load_placement(tmp_path / "placement.json")
    assert comparable(panel) == comparable(replace(batch, settings={**batch.settings, "render": False}))
    assert any("in nineteen of twenty" in note for note in panel.notes)
