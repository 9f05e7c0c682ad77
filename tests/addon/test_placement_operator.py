"""From a click to placed sensors: operators do what the batch command does, and what they find outlives the file."""

import csv
import json
import math
from collections.abc import Generator
from dataclasses import replace
from types import SimpleNamespace

from headless import place

import bpy
import pytest

from seip_addon import scene_status
from seip_addon import session as session_data
from seip_addon.core.choosing.placement.returns_summary import ReturnsPoint, ReturnsSummary
from seip_addon.core.output.results.placement_file import comparable, load_placement, parsed_record
from seip_addon.core.progress import Progress, finish
from seip_addon.core.sensing.visibility.grid import VisibilityGrid
from seip_addon.core.sensing.visibility.ray_casting import BvhRayCaster, EmbreeRayCaster
from seip_addon.core.storage.json_dataclass import as_json
from seip_addon.operators import results
from seip_addon.panels import export as export_panel
from seip_addon.panels import placement as placement_panel
from seip_addon.scene.contract import WRITTEN
from seip_addon.scene.sensors import placed_sensors
from seip_addon.session import session
from tests.builders.drawn_layout import DrawnLayout

OPTIONS = ["--heights", "8", "--grid", "4", "--spacing", "12", "--count", "2", "--sensor", "type1", "--no-render"]


def labels(scene: bpy.types.Scene) -> list[str]:
    return sorted(placed_sensors(scene))


def test_panel_and_batch_write_the_same_placement(junction, tmp_path, small_scene):
    assert bpy.ops.seip.solve_placement() == {"FINISHED"}
    junction.seip.result.folder = str(tmp_path / "panel")
    assert bpy.ops.seip.write_report() == {"FINISHED"}  # exports what it needs
    exported = (tmp_path / "panel" / "placed.blend").stat().st_mtime_ns
    assert bpy.ops.seip.write_report() == {"FINISHED"}
    assert (tmp_path / "panel" / "placed.blend").stat().st_mtime_ns == exported
    assert (tmp_path / "panel" / "report.pdf").is_file()
    assert "With fewer or more sensors under the same rules" in (tmp_path / "panel" / "report.html").read_text(
        encoding="utf-8"
    )
    key = session.state_of(junction).survey.grid.key
    place.main([str(small_scene), *OPTIONS, "-o", str(tmp_path / "batch")])
    panel, batch = (load_placement(tmp_path / name / "placement.json") for name in ("panel", "batch"))
    assert comparable(panel) == comparable(batch)
    assert VisibilityGrid.load(tmp_path / "batch" / "visibility.npz").key == key
    for name in ("candidates.csv", "carla_spawn.json", "site.npz", "visibility.npz"):
        assert (tmp_path / "panel" / name).read_bytes() == (tmp_path / "batch" / name).read_bytes()


def test_files_of_an_export_can_be_opened_while_they_are_of_the_placement(junction, tmp_path):
    def opened():
        layout = DrawnLayout()
        export_panel.draw(layout, bpy.context)
        paths = [getattr(button, "filepath", None) for name, _, button in layout.buttons if name == "wm.path_open"]
        return "seip.show_plan" in dict(layout.operators), paths

    bpy.ops.seip.solve_placement()
    folder = tmp_path / "result"
    junction.seip.result.folder = str(folder)
    assert opened() == (False, [])
    bpy.ops.seip.export_result()
    assert opened() == (True, [str(folder)])
    bpy.ops.seip.write_report()
    assert opened() == (True, [str(folder / "report.html"), str(folder)])
    bpy.ops.seip.export_result()  # the report is older than this
    assert opened() == (True, [str(folder)])
    junction.seip.goal.count = 1
    bpy.ops.seip.solve_placement()
    assert opened() == (False, [])
    with pytest.raises(RuntimeError, match="no plan of this placement in the folder of the result"):
        bpy.ops.seip.show_plan()


def test_files_of_another_objective_are_not_opened_as_those_of_the_placement(junction, tmp_path):
    """A batch run with other shares of the road users may choose the same sensors, of another value."""
    bpy.ops.seip.solve_placement()
    junction.seip.result.folder = str(tmp_path)
    bpy.ops.seip.export_result()
    assert results.exported_files(junction)
    path = tmp_path / "placement.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    assert content["settings"]["goal"]["shares"] == [1.0, 1.0, 1.0]
    content["settings"]["goal"]["shares"] = [1.0, 2.0, 2.0]
    path.write_text(json.dumps(content), encoding="utf-8")
    assert not results.exported_files(junction)


@pytest.mark.slow
def test_pose_errors_are_only_evaluated_where_that_is_the_risk_measure(junction, tmp_path, small_scene):
    junction.seip.goal.scenarios, junction.seip.goal.risk = "pose-errors", "none"
    assert bpy.ops.seip.solve_placement() == {"FINISHED"}
    panel = parsed_record(junction.seip.result.record)
    assert any("in one of twenty cases" in note for note in panel.notes)
    place.main([str(small_scene), *OPTIONS, "--pose-errors", "--risk", "none", "-o", str(tmp_path)])
    assert comparable(panel) == comparable(load_placement(tmp_path / "placement.json"))


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
    junction.seip.sections.numbers = True
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


@pytest.mark.parametrize(
    "change",
    [
        {"count": 3},
        {"limit": "BUDGET"},
        {"min_distance": 7.3},
        {"weighting": "VALUE"},
        {"scenarios": "pose-errors"},
    ],
)
def test_another_goal_makes_placing_the_next_step(junction, monkeypatch, change):
    bpy.ops.seip.solve_placement()
    goal = junction.seip.goal
    before = {name: getattr(goal, name) for name in change}
    assert scene_status.next_step(junction) == scene_status.other_goal(junction) == ""
    for name, value in change.items():
        setattr(goal, name, value)
    assert scene_status.next_step(junction) == "seip.solve_placement"
    assert placement_panel.status(junction).endswith("changed")
    assert any("goal has changed" in text for text in sentences(junction, monkeypatch))
    for name, value in before.items():
        setattr(goal, name, value)
    assert scene_status.next_step(junction) == scene_status.other_goal(junction) == ""


def test_a_placement_of_any_goal_is_of_that_goal(junction):
    goal = junction.seip.goal
    goal.limit, goal.budget, goal.min_distance = "BUDGET", 12_345.67, 3.3
    goal.weighting, goal.central_weight = "VALUE", 2.7
    bpy.ops.seip.solve_placement()
    assert scene_status.other_goal(junction) == ""
    goal.limit, goal.coverage = "COVERAGE", 12.3
    bpy.ops.seip.solve_placement()
    assert scene_status.other_goal(junction) == ""


def test_numbers_of_sensors_placed_by_returns_show_returns(junction):
    front = (ReturnsPoint(1, 4.0, 1000.0, 0.0), ReturnsPoint(2, 16.0, 2000.0, 0.0))
    bpy.ops.seip.solve_placement()
    record = parsed_record(junction.seip.result.record)
    by_returns = replace(record, front=(), returns=ReturnsSummary(16.0, {"car": 16.0}, (), front))
    assert placement_panel.numbers(by_returns) == [(1, 0.25, "4 · $1,000"), (2, 1.0, "16 · $2,000")]
    text = "Returns per revolution and price of the best placement found for each number. "
    assert placement_panel.front_text(by_returns) == f"{text}No other has more."
    for gap, limit in ((0.031, "Others have at most 3.1% more."), (None, "Not every number is proven.")):
        open_ended = replace(by_returns.returns, front=(front[0], replace(front[1], gap=gap)))
        assert placement_panel.front_text(replace(by_returns, returns=open_ended)) == f"{text}{limit}"
    stored = json.loads(junction.seip.result.record) | {"front": [], "returns": as_json(by_returns.returns)}
    junction.seip.result.record = json.dumps(stored)
    junction.seip.sections.numbers = True
    layout, numbers = choices(junction)
    assert [number[0] for number in numbers] == [1, 2]
    assert [bar[1] for bar in layout.bars] == ["4 · $1,000", "16 · $2,000"]


def test_numbers_of_sensors_are_not_offered_where_the_record_has_none(junction):
    bpy.ops.seip.solve_placement()
    junction.seip.sections.numbers = True
    record = json.loads(junction.seip.result.record)
    junction.seip.result.record = json.dumps({**record, "front": []})
    layout, numbers = choices(junction)
    assert numbers == layout.bars == []


def test_the_text_on_numbers_of_sensors_states_how_much_better_they_could_be(junction):
    bpy.ops.seip.solve_placement()
    record = parsed_record(junction.seip.result.record)
    front = tuple(replace(point, missed=0.0) for point in record.front)
    text = "Coverage and price of the best placement found for each number. "
    assert placement_panel.front_text(replace(record, front=front)) == f"{text}No other sees more."
    open_ended = replace(record, front=(*front[:-1], replace(front[-1], missed=0.0123)))
    assert placement_panel.front_text(open_ended) == f"{text}Others see at most 1.2% of the road more."


def test_a_placement_with_the_grid_at_hand_casts_no_ray(junction, monkeypatch):
    bpy.ops.seip.compute_visibility()
    for caster in (BvhRayCaster, EmbreeRayCaster):
        monkeypatch.setattr(caster, "cast", None)
    assert bpy.ops.seip.solve_placement() == {"FINISHED"}


def work_of(operator: str, scene: bpy.types.Scene) -> Generator[Progress, None, object]:
    """Return the work of a button, which a thread would do."""
    return getattr(bpy.types, operator).prepare(SimpleNamespace(), scene)


def test_work_that_is_stopped_at_its_end_leaves_no_trace(junction):
    bpy.ops.seip.solve_placement()
    junction.seip.goal.count = 3
    junction.seip.survey.effort = 30.0
    before = session.state_of(junction)
    seen = dict(vars(before))
    placed = finish(work_of("SEIP_OT_solve_placement", junction))
    assert len(placed.solution.deployment.sensors) == 3
    for name in ("compute_visibility", "follow_sensors", "save_picture"):
        finish(work_of(f"SEIP_OT_{name}", junction))
        assert session.state_of(junction) is before
        assert vars(before) == seen


def test_a_stopped_placement_does_not_reach_the_export(junction, tmp_path):
    bpy.ops.seip.solve_placement()
    junction.seip.goal.count = 3
    finish(work_of("SEIP_OT_solve_placement", junction))  # and stopped
    junction.seip.result.folder = str(tmp_path)
    bpy.ops.seip.export_result()
    record = load_placement(tmp_path / "placement.json")
    rows = list(csv.DictReader((tmp_path / "candidates.csv").read_text(encoding="utf-8").splitlines()))
    assert {int(row["pose"]) for row in rows if row["chosen"]} == {sensor.pose for sensor in record.sensors}
    assert len(json.loads((tmp_path / "carla_spawn.json").read_text(encoding="utf-8"))) == 2


def test_a_mistake_is_one_sentence(junction):
    junction.seip.survey.heights = "high"
    with pytest.raises(RuntimeError, match="'high' is neither a height in metres"):
        bpy.ops.seip.solve_placement()


def test_a_saved_placement_goes_on_without_computing(junction, tmp_path, monkeypatch):
    bpy.ops.seip.solve_placement()
    before = junction.seip.result.record
    path = tmp_path / "placed.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene = bpy.context.scene
    assert session.state_of(scene) is None
    assert scene.seip.result.record == before
    for forbidden in ("compute_visibility", "optimise"):
        monkeypatch.setattr(f"seip_addon.core.sensing.visibility.store.{forbidden}", None, raising=False)
        monkeypatch.setattr(f"seip_addon.core.workflows.survey.{forbidden}", None, raising=False)
    scene.seip.result.folder = "//out/"
    assert bpy.ops.seip.export_result() == {"FINISHED"}
    assert comparable(load_placement(tmp_path / "out" / "placement.json")) == comparable(parsed_record(before))


def test_an_emptied_cache_is_said(junction, tmp_path):
    bpy.ops.seip.solve_placement()
    session_data.forget()
    for file in (tmp_path / "cache").glob("*.npz"):
        file.unlink()
    with pytest.raises(RuntimeError, match="no longer holds the visibility of this placement: place again"):
        bpy.ops.seip.follow_sensors()
    bpy.ops.seip.compute_visibility()
    assert bpy.ops.seip.follow_sensors() == {"FINISHED"}


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
    assert len(session.state_of(scene).solution.deployment.sensors) == 2
    bpy.ops.ed.redo()
    assert labels(bpy.context.scene) == ["S1", "S2", "S3"]


def test_each_scene_keeps_its_own(junction):
    bpy.ops.seip.solve_placement()
    bpy.ops.scene.new(type="FULL_COPY")
    other = bpy.context.scene
    other.seip.goal.count = 1
    assert other != junction
    bpy.ops.seip.solve_placement()
    assert len(json.loads(other.seip.result.record)["sensors"]) == 1
    assert len(json.loads(junction.seip.result.record)["sensors"]) == 2
    assert labels(junction) == ["S1", "S2"]


def test_nothing_of_the_users_is_changed(junction):
    def users() -> dict[str, object]:
        return {obj.name: obj.matrix_world.copy() for obj in bpy.data.objects if WRITTEN not in obj}

    before = users()
    bpy.ops.seip.solve_placement()
    assert users() == before


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
    assert bpy.ops.seip.remove_rule() == {"FINISHED"}
    assert not bpy.ops.seip.remove_rule.poll()


def test_a_file_of_a_newer_version_is_refused(junction, tmp_path):
    junction.seip.version = scene_status.FILE_VERSION + 1
    assert "newer version" in scene_status.obstacle(junction)
    with pytest.raises(RuntimeError, match="newer version of SEIP"):
        bpy.ops.seip.solve_placement()
    path = tmp_path / "newer.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert bpy.context.scene.seip.version == scene_status.FILE_VERSION + 1


def test_the_version_is_in_the_file(junction, tmp_path, monkeypatch):
    path = tmp_path / "own.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert bpy.context.scene.seip.is_property_set("version")


def test_a_scene_without_region_has_its_sentence(junction):
    region = bpy.data.collections["SEIP Region"]
    for obj in list(region.objects):
        region.objects.unlink(obj)
    with pytest.raises(RuntimeError, match="There is no region"):
        bpy.ops.seip.solve_placement()


def test_a_region_without_targets_has_its_sentence(junction):
    for obj in bpy.data.collections["SEIP Region"].objects:
        obj.location.x += 5000.0
    with pytest.raises(RuntimeError, match=r"Error: .*target"):
        bpy.ops.seip.solve_placement()


def test_an_unsaved_file_says_where_it_would_write(junction, monkeypatch):
    bpy.ops.seip.solve_placement()
    junction.seip.result.folder = "//seip-result/"
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    from seip_addon.operators.results import no_folder  # noqa: PLC0415  # registered with the add-on

    assert no_folder(scene) == "Save the file, or choose another folder: seip-result/ is beside the file."


def test_a_folder_that_cannot_be_written_has_its_sentence(junction, tmp_path):
    bpy.ops.seip.solve_placement()
    (tmp_path / "file").write_text("")
    junction.seip.result.folder = str(tmp_path / "file" / "out")
    with pytest.raises(RuntimeError, match="choose a folder that you may write to"):
        bpy.ops.seip.export_result()


@pytest.mark.parametrize(
    "risk",
    [
        pytest.param("mean", marks=pytest.mark.long),
        pytest.param("worst-quarter", marks=pytest.mark.slow),
        pytest.param("worst", marks=pytest.mark.long),
    ],
)
def test_panel_and_batch_place_alike_over_pose_errors(junction, tmp_path, risk, small_scene):
    goal = junction.seip.goal
    goal.scenarios, goal.risk, goal.failures = "pose-errors", risk, "mean"
    goal.position_error, goal.tilt_error = 0.5, math.radians(3)
    types = junction.seip.survey
    types.grid, types.spacing = 8.0, 25.0
    bpy.ops.seip.list_sensor_types()
    for one in types.types:
        one.use = one.name == "type1"
    assert bpy.ops.seip.solve_placement() == {"FINISHED"}
    panel = parsed_record(junction.seip.result.record)
    options = ["--heights", "8", "--grid", "8", "--spacing", "25", "--count", "2", "--no-render", "--sensor", "type1"]
    wrong = ["--pose-errors", "0.5", "3", "--failures", "mean", "--risk", risk]
    place.main([str(small_scene), *options, *wrong, "-o", str(tmp_path)])
    batch = load_placement(tmp_path / "placement.json")
    assert comparable(panel) == comparable(replace(batch, settings={**batch.settings, "render": False}))
    assert any("in nineteen of twenty" in note for note in panel.notes)


def test_a_coverage_to_reach_is_not_optimised_over_scenarios(junction):
    junction.seip.goal.limit, junction.seip.goal.scenarios = "COVERAGE", "pose-errors"
    with pytest.raises(RuntimeError, match="needs a number of sensors or a budget"):
        bpy.ops.seip.solve_placement()
