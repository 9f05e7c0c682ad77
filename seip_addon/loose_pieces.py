"""Pieces of buildings, such as windows, go with the building that is deleted: Blender would leave them in the air."""

from __future__ import annotations

import bpy

from .scene.build import loose_pieces


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _on_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Note that something came loose: what is deleted from within a handler brings Blender down."""
    objects = [update.id.original for update in depsgraph.updates if isinstance(update.id, bpy.types.Object)]
    if loose_pieces(objects) and not bpy.app.timers.is_registered(remove):
        bpy.app.timers.register(remove, first_interval=0.0)


def remove() -> None:
    """Remove what has come loose in any scene."""
    for scene in bpy.data.scenes:
        if scene.library is None:
            bpy.data.batch_remove(loose_pieces(scene.objects))


def attach() -> None:
    """Watch for buildings that are deleted."""
    bpy.app.handlers.depsgraph_update_post.append(_on_update)


def detach() -> None:
    """Watch no longer."""
    bpy.app.handlers.depsgraph_update_post.remove(_on_update)
    if bpy.app.timers.is_registered(remove):
        bpy.app.timers.unregister(remove)
