"""A held answer is never a stale one, and a scene that stays the same is not read again."""

from pathlib import Path

import bpy
import pytest

from seip_addon import state

SCENE = Path(__file__).resolve().parents[2] / "scenes" / "junction.blend"


@pytest.fixture
def known(add_on):
    bpy.ops.wm.open_mainfile(filepath=str(SCENE))
    scene = bpy.context.scene
    scene.seip.survey.heights = "8"
    scene.seip.survey.grid = 4.0
    scene.seip.survey.spacing = 12.0
    bpy.ops.seip.compute_visibility()
    return state.find(scene)


def read_again(known: state.Held) -> bool:
    bpy.ops.seip.compute_visibility()
    return state.find(bpy.context.scene).layout.geometry is not known.layout.geometry


def building() -> bpy.types.Object:
    return bpy.data.objects["Building 1"]


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


@pytest.mark.parametrize("change", [move, reshape, delete, add, modify, hide])
def test_a_change_is_noticed_at_once_and_read(known, change):
    assert state.doubt(bpy.context.scene) == ""
    change()
    bpy.context.view_layer.update()
    assert state.doubt(bpy.context.scene) == "The scene has changed since it was computed."
    assert read_again(known)
    assert state.doubt(bpy.context.scene) == ""


def test_a_property_is_noticed_at_the_next_click(known):
    forbid()
    assert read_again(known)


def test_a_change_that_is_undone_is_noticed(known):
    bpy.ops.ed.undo_push(message="before")
    reshape()
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.seip.compute_visibility()
    reshaped = state.find(bpy.context.scene)
    bpy.ops.ed.undo()
    assert read_again(reshaped)


def select() -> None:
    building().select_set(True)


def look_elsewhere() -> None:
    bpy.context.scene.camera.location.z += 5.0


def place_sensors() -> None:
    bpy.ops.seip.solve_placement()


@pytest.mark.parametrize("change", [select, look_elsewhere, place_sensors])
def test_what_does_not_matter_is_not_read_again(known, change):
    change()
    bpy.context.view_layer.update()
    assert state.doubt(bpy.context.scene) == ""
    assert not read_again(known)


def test_other_settings_lay_out_anew_from_the_same_reading(known):
    bpy.context.scene.seip.survey.grid = 5.0
    assert state.doubt(bpy.context.scene) == "The settings have changed since it was computed."
    assert not read_again(known)
    assert state.find(bpy.context.scene).layout.site.targets.spacing == 5.0


def test_a_slip_in_the_settings_is_said_by_the_panel(known):
    bpy.context.scene.seip.survey.heights = "x"
    assert "neither a height" in state.doubt(bpy.context.scene)
