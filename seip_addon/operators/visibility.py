"""Visibility of the scene: who sees what."""

from __future__ import annotations

import time
from collections.abc import Generator

import bpy

from .. import preferences, state
from ..core.progress import Progress
from ..core.survey import grid_key, see
from ..core.visibility.grid import VisibilityGrid
from .work import LongWork


class SEIP_OT_compute_visibility(LongWork[VisibilityGrid], bpy.types.Operator):
    """Find out which candidate pose sees which target on the road"""

    bl_idname = "seip.compute_visibility"
    bl_label = "Compute Visibility"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, VisibilityGrid]:
        """Lay out the scene."""
        self._held = state.read(scene)
        return seen(self._held)

    def conclude(self, scene: bpy.types.Scene, result: VisibilityGrid) -> None:
        """Hold the grid."""
        state.held[scene.session_uid] = self._held
        self.report({"INFO"}, f"{result.shape[0]:,} poses, {result.shape[1]:,} targets")


def seen(held: state.Held) -> Generator[Progress, None, VisibilityGrid]:
    """Find who sees what in a scene that was read, or take it from the cache, and hold it."""
    began = time.perf_counter()
    held.grid = yield from see(held.layout, preferences.cache_folder() / f"{grid_key(held.layout)[:32]}.npz")
    held.durations["visibility"] = time.perf_counter() - began
    return held.grid


CLASSES = (SEIP_OT_compute_visibility,)
