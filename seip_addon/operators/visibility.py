"""Operators that estimate and compute visibility."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import bpy

from .. import state
from ..core.progress import Progress
from ..core.workflows.survey import estimate
from .work import ForReadyScene, LongWork


class SEIP_OT_compute_visibility(ForReadyScene, LongWork[state.Held], bpy.types.Operator):
    """Find out which candidate pose sees which target on the road"""

    bl_idname = "seip.compute_visibility"
    bl_label = "Compute Visibility"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, state.Held]:
        """Read the scene where it has changed."""
        return _seen(state.survey(scene))

    def conclude(self, scene: bpy.types.Scene, result: state.Held) -> None:
        """Hold the grid."""
        state.hold(scene, result)
        site = result.layout.site
        self.report(
            {"INFO"}, f"visibility of {len(site.targets):,} targets from {len(site.candidates):,} poses is known"
        )


class SEIP_OT_estimate_visibility(ForReadyScene, LongWork[state.Held], bpy.types.Operator):
    """Estimate how long visibility will take and how much memory, by beginning with it for about a second"""

    bl_idname = "seip.estimate_visibility"
    bl_label = "Estimate"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, state.Held]:
        """Read the scene where it has changed."""
        return _estimated(state.survey(scene))

    def conclude(self, scene: bpy.types.Scene, result: state.Held) -> None:
        """Hold the estimate."""
        state.hold(scene, result)


class SEIP_OT_compare_scene(ForReadyScene, LongWork[state.Held], bpy.types.Operator):
    """Find out whether the placement is of the scene as it is now"""

    bl_idname = "seip.compare_scene"
    bl_label = "Compare with Scene"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, state.Held]:
        """Read the scene where it has changed."""
        return state.survey(scene)

    def conclude(self, scene: bpy.types.Scene, result: state.Held) -> None:
        """Hold what was read: the panel compares."""
        state.hold(scene, result)


def _seen(surveying: Generator[Progress, None, state.Held]) -> Generator[Progress, None, state.Held]:
    known = yield from surveying
    known, _ = yield from state.seen(known)
    return known


def _estimated(surveying: Generator[Progress, None, state.Held]) -> Generator[Progress, None, state.Held]:
    known = yield from surveying
    found = yield from estimate(known.layout, known.means.cores)
    return replace(known, estimate=found)


CLASSES = (SEIP_OT_compute_visibility, SEIP_OT_estimate_visibility, SEIP_OT_compare_scene)
