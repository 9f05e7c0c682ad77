"""Pieces go with the building or sensor that is deleted, such as windows and posts: Blender would leave them behind."""

from __future__ import annotations

import bpy

from ..scene.pieces import copied_pieces, loose_pieces, tidy_pieces


def _on_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Note that something came loose: what is deleted from within a handler brings Blender down."""
    objects = [update.id.original for update in depsgraph.updates if isinstance(update.id, bpy.types.Object)]
    untidy = loose_pieces(objects) or copied_pieces(objects)
    if untidy and not bpy.app.timers.is_registered(remove):
        bpy.app.timers.register(remove, first_interval=0.0)


def remove() -> None:
    """Remove what has come loose in any scene."""
    for scene in bpy.data.scenes:
        if scene.library is None:
            tidy_pieces(scene)


HANDLERS = (("depsgraph_update_post", _on_update),)
TIMERS = (remove,)
