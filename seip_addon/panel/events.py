"""Handlers: work that follows when a file is opened or saved, an edit is undone, or an object is deleted."""

from __future__ import annotations

from contextlib import suppress

import bpy

from ..core.base.errors import SeipError
from ..core.output.results.placement_record import parsed_record
from ..scene import changes, contract
from ..scene.pieces import copied_pieces, loose_pieces, tidy_pieces
from ..scene.sensors import labelled_sensors
from . import coverage, overlays, scene_status, sensors
from .session import session

LOAD_DELAY = 0.2
"""Seconds from the opening of a file to the work on it."""


def _after_load(*_: object) -> None:
    """List sensor types, take over placements of commands, show what was shown, and soon compare placements."""
    sensors.refresh()
    for scene in bpy.data.scenes:
        if scene.library is None:
            _take_over_placement(scene)
            _use_types_of_sensors(scene)
        coverage.update(scene)
    for window in bpy.context.window_manager.windows[:1]:
        bpy.context.window_manager.seip_sections.follow_steps(window.scene)
    if not bpy.app.background and not bpy.app.timers.is_registered(_compare):  # Blender is not ready for work yet
        bpy.app.timers.register(_compare, first_interval=LOAD_DELAY)


def _take_over_placement(scene: bpy.types.Scene) -> None:
    """Take over the placement that a command has stored in the scene, and its settings, if there is one."""
    stored = scene.get(contract.PLACEMENT)
    if stored is None:
        return
    try:
        request = parsed_record(stored["record"]).request
    except SeipError:  # of a newer version: the sensors can still be evaluated
        return
    scene.seip.result.keep(*(stored[name] for name in ("record", "targets", "seen")))
    scene.seip.survey.take_over(request)
    scene.seip.goal.take_over(request.goal)
    del scene[contract.PLACEMENT]


def _use_types_of_sensors(scene: bpy.types.Scene) -> None:
    """Choose the types of a scene's sensors where these have no placement and no chosen type."""
    if scene_status.has_unevaluated(scene):
        there = {obj.get(contract.SENSOR) for obj in labelled_sensors(scene, hidden=True).values()}
        if not there & set(scene.seip.survey.used_types()):
            for one in scene.seip.survey.types:
                one.use = one.name in there


def _compare() -> None:
    """Compare each window's scene with its placement, one: there is one piece of work at a time."""
    for window in bpy.context.window_manager.windows:
        scene = window.scene
        unknown = session.of(scene).state is None and scene.seip.result.record
        if session.running is None and unknown and not scene_status.obstacle(scene):
            with bpy.context.temp_override(window=window), suppress(RuntimeError):  # the panel says what is unknown
                bpy.ops.seip.compare_scene("INVOKE_DEFAULT")
            return


def _before_save(*_: object) -> None:
    """Store the version of the properties' layout in the file: Blender saves no defaults."""
    for scene in bpy.data.scenes:
        if scene.library is None and not scene_status.is_newer(scene) and scene.is_property_set("seip"):
            scene.seip.version = scene_status.FILE_VERSION


def _after_undo(*_: object) -> None:
    """Look soon whether scenes are as they were when they were read: Blender is not ready for work yet."""
    if not bpy.app.timers.is_registered(look_again):
        bpy.app.timers.register(look_again, first_interval=0.0)


def look_again() -> None:
    """Look whether scenes are as they were when they were read, and draw that in the panel."""
    for scene in bpy.data.scenes:
        changes.look_again(scene)
    overlays.redraw()


def _on_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Note that pieces of a deleted building or sensor, such as windows and posts, came loose.

    What is deleted from within a handler brings Blender down.
    """
    objects = [update.id.original for update in depsgraph.updates if isinstance(update.id, bpy.types.Object)]
    untidy = loose_pieces(objects) or copied_pieces(objects)
    if untidy and not bpy.app.timers.is_registered(remove_loose_pieces):
        bpy.app.timers.register(remove_loose_pieces, first_interval=0.0)


def remove_loose_pieces() -> None:
    """Remove pieces that have come loose in any scene."""
    for scene in bpy.data.scenes:
        if scene.library is None:
            tidy_pieces(scene)


HANDLERS = (
    ("load_post", _after_load),
    ("save_pre", _before_save),
    ("depsgraph_update_post", changes.on_update),
    ("depsgraph_update_post", _on_update),
    ("undo_post", _after_undo),
    ("redo_post", _after_undo),
)
AT_START = (_after_load,)
TIMERS = (_compare, look_again, remove_loose_pieces)
