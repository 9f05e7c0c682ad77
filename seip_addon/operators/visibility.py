"""Operators that compute visibility and compare a placement with its scene."""

from __future__ import annotations

from collections.abc import Generator

import bpy

from .. import scene_survey
from ..core.counts import counted
from ..core.progress import Progress
from ..core.workflows.survey import Survey
from ..session import SceneState, session
from .base import ForReadyScene, LongWork


class SEIP_OT_compute_visibility(ForReadyScene, LongWork[tuple[SceneState, Survey]], bpy.types.Operator):
    """Compute which targets on the road are visible from each candidate pose"""

    bl_idname = "seip.compute_visibility"
    bl_label = "Compute Visibility"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, tuple[SceneState, Survey]]:
        """Read the scene where it has changed."""
        return scene_survey.with_visibility_of(scene_survey.survey(scene))

    def conclude(self, scene: bpy.types.Scene, result: tuple[SceneState, Survey]) -> None:
        """Hold the grid."""
        state, survey = result
        session.keep_state(scene, state)
        site = survey.site
        targets, poses = counted(len(site.targets), "target"), counted(len(site.candidates), "pose")
        self.report({"INFO"}, f"visibility of {targets} from {poses} is known")


class SEIP_OT_compare_scene(ForReadyScene, LongWork[SceneState], bpy.types.Operator):
    """Check whether the placement still matches the scene"""

    bl_idname = "seip.compare_scene"
    bl_label = "Compare with Scene"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, SceneState]:
        """Read the scene where it has changed."""
        return scene_survey.survey(scene)

    def conclude(self, scene: bpy.types.Scene, result: SceneState) -> None:
        """Hold what was read: the panel compares."""
        session.keep_state(scene, result)


CLASSES = (SEIP_OT_compute_visibility, SEIP_OT_compare_scene)
