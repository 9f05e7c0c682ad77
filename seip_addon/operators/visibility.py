"""Operators that estimate and compute visibility."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import bpy

from .. import scene_survey
from ..core.counts import counted
from ..core.progress import Progress
from ..core.workflows.visibility_estimate import estimate
from ..session import SceneState, session
from .base import ForReadyScene, LongWork


class SEIP_OT_compute_visibility(ForReadyScene, LongWork[SceneState], bpy.types.Operator):
    """Find out which candidate pose sees which target on the road"""

    bl_idname = "seip.compute_visibility"
    bl_label = "Compute Visibility"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, SceneState]:
        """Read the scene where it has changed."""
        return _seen(scene_survey.survey(scene))

    def conclude(self, scene: bpy.types.Scene, result: SceneState) -> None:
        """Hold the grid."""
        session.keep_state(scene, result)
        site = result.layout.site
        targets, poses = counted(len(site.targets), "target"), counted(len(site.candidates), "pose")
        self.report({"INFO"}, f"visibility of {targets} from {poses} is known")


class SEIP_OT_estimate_visibility(ForReadyScene, LongWork[SceneState], bpy.types.Operator):
    """Estimate how long visibility will take and how much memory, by beginning with it for about a second"""

    bl_idname = "seip.estimate_visibility"
    bl_label = "Estimate"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, SceneState]:
        """Read the scene where it has changed."""
        return _estimated(scene_survey.survey(scene))

    def conclude(self, scene: bpy.types.Scene, result: SceneState) -> None:
        """Hold the estimate."""
        session.keep_state(scene, result)


class SEIP_OT_compare_scene(ForReadyScene, LongWork[SceneState], bpy.types.Operator):
    """Find out whether the placement is of the scene as it is now"""

    bl_idname = "seip.compare_scene"
    bl_label = "Compare with Scene"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, SceneState]:
        """Read the scene where it has changed."""
        return scene_survey.survey(scene)

    def conclude(self, scene: bpy.types.Scene, result: SceneState) -> None:
        """Hold what was read: the panel compares."""
        session.keep_state(scene, result)


def _seen(surveying: Generator[Progress, None, SceneState]) -> Generator[Progress, None, SceneState]:
    state = yield from surveying
    state, _ = yield from scene_survey.with_visibility(state)
    return state


def _estimated(surveying: Generator[Progress, None, SceneState]) -> Generator[Progress, None, SceneState]:
    state = yield from surveying
    found = yield from estimate(state.layout, state.resources.cores)
    return replace(state, estimate=found)


CLASSES = (SEIP_OT_compute_visibility, SEIP_OT_estimate_visibility, SEIP_OT_compare_scene)
