"""A held answer is never a stale one, and a scene that stays the same is not read again."""

from pathlib import Path

import bpy
import pytest

from seip_addon.panel import events, following, scene_status, site_check
from seip_addon.panel.session import SceneState, session


@pytest.fixture
def known(junction):
    bpy.ops.seip.solve_placement()
    return session.of(junction).state


def read_again(known: SceneState) -> bool:
    bpy.ops.seip.solve_placement()
    return session.of(bpy.context.scene).state.layout.geometry is not known.layout.geometry


def building() -> bpy.types.Object:
    return bpy.data.objects["building 1"]


def move() -> None:
    building().location.x += 1.0


def reshape() -> None:
    building().data.vertices[0].co.z += 1.0


def delete() -> None:
    bpy.data.objects.remove(building())


def add() -> None:
    bpy.data.collections["SEIP Occluders"].objects.link(bpy.data.objects.new("Copy", building().data))


def modify() -> None:
    building().modifiers.new("Array", "ARRAY")


def hide() -> None:
    building().hide_viewport = True


def forbid() -> None:
    bpy.data.collections["SEIP Poles"].objects[0]["seip_forbidden"] = True


def test_a_scene_that_no_longer_counts_in_metres_is_refused_although_it_was_read_before(known):
    scene = bpy.context.scene
    scene.unit_settings.system, scene.unit_settings.scale_length = "METRIC", 0.01
    record = scene.seip.result.record
    scene.seip.goal.count = 1
    with pytest.raises(RuntimeError, match=r"is 0\.01 m, but is read as one metre: set Unit Scale to 1"):
        bpy.ops.seip.solve_placement()
    assert scene.seip.result.record == record
    scene.unit_settings.scale_length = 1.0
    assert bpy.ops.seip.solve_placement() == {"FINISHED"}


def test_a_change_is_noticed_at_once_and_read(known):
    for change in (move, reshape, add, modify, hide, delete):
        assert scene_status.stale_survey(bpy.context.scene) == ""
        known = session.of(bpy.context.scene).state
        change()
        bpy.context.view_layer.update()
        assert scene_status.stale_survey(bpy.context.scene) == "The scene has changed since it was computed."
        assert read_again(known)
    assert scene_status.stale_survey(bpy.context.scene) == ""


def test_a_change_that_is_undone_is_noticed(known):
    bpy.ops.ed.undo_push(message="before")
    reshape()
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.seip.solve_placement()
    reshaped = session.of(bpy.context.scene).state
    bpy.ops.ed.undo()
    assert read_again(reshaped)


@pytest.mark.parametrize("change", [move, reshape, modify, hide])
def test_undo_of_a_change_leaves_no_trace(known, change):
    sections = bpy.context.window_manager.seip_sections
    bpy.ops.seip.solve_placement()
    bpy.ops.seip.follow_sensors()
    assert bpy.ops.seip.check_site() == {"FINISHED"}
    scene = bpy.context.scene
    states = scene_status.stale_placement, scene_status.stale_check
    bpy.ops.ed.undo_push(message="before")
    change()
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="after")
    assert all(state(scene) for state in states)
    following.update()
    assert session.following.problem
    sections.details = True
    sections.site = False
    bpy.ops.ed.undo()
    for again in (events.look_again, following.update):
        assert bpy.app.timers.is_registered(again)
        again()
    assert [state(bpy.context.scene) for state in states] == ["", ""]
    assert session.following.problem == ""
    assert (sections.details, sections.site) == (True, False)


def test_following_ends_without_an_error_where_undo_brings_back_another_placement(known):
    bpy.ops.seip.solve_placement()
    bpy.ops.ed.undo_push(message="two sensors")
    bpy.context.scene.seip.goal.count = 1
    bpy.ops.seip.solve_placement()
    bpy.ops.ed.undo_push(message="one sensor")
    bpy.ops.seip.follow_sensors()
    bpy.ops.ed.undo()
    following.update()
    assert session.following is None


def select() -> None:
    building().select_set(True)


def look_elsewhere() -> None:
    bpy.context.scene.cursor.location.z += 5.0


def place_sensors() -> None:
    bpy.ops.seip.solve_placement()


def test_what_does_not_matter_is_not_read_again(known):
    for change in (select, look_elsewhere, place_sensors):
        change()
        bpy.context.view_layer.update()
        assert scene_status.stale_survey(bpy.context.scene) == ""
    assert not read_again(known)


def reopened(tmp_path: Path) -> bpy.types.Scene:
    path = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return bpy.context.scene


def doubt_once_compared(scene: bpy.types.Scene) -> str:
    assert scene_status.stale_placement(scene) == scene_status.NOT_COMPARED
    assert bpy.ops.seip.compare_scene() == {"FINISHED"}
    return scene_status.stale_placement(scene)


@pytest.mark.parametrize("change", [reshape, forbid])
def test_a_change_before_saving_shows_once_the_file_is_open_again(known, change, tmp_path):
    bpy.ops.seip.solve_placement()
    change()
    assert doubt_once_compared(reopened(tmp_path)) == scene_status.ANOTHER_SITE


def test_a_check_holds_until_scene_or_settings_change(known, tmp_path):
    scene = bpy.context.scene
    bpy.ops.seip.check_site()
    assert scene_status.stale_check(scene) == ""
    scene.seip.survey.effort = 30.0  # nothing that a check looks at
    assert scene_status.stale_check(scene) == ""
    scene.seip.survey.heights = "5 8"
    assert scene_status.stale_check(scene) == scene_status.OTHER_SENSORS
    assert not site_check.status(scene).changed
    scene.seip.survey.spacing = 7.0
    assert scene_status.stale_check(scene) == "The settings have changed since the check."
    assert site_check.status(scene).changed
    bpy.ops.seip.check_site()
    move()
    bpy.context.view_layer.update()
    assert scene_status.stale_check(scene) == "The scene has changed since the check."
    bpy.ops.seip.check_site()
    assert site_check.status(reopened(tmp_path)).result[0] == "not checked"
