"""The panel of visibility."""

from __future__ import annotations

import bpy

from .. import scene_status
from ..core.sensing.visibility.estimate import Estimate
from ..operators.visibility import SEIP_OT_compute_visibility, SEIP_OT_estimate_visibility
from ..session import session
from .run_button import draw_run, in_words
from .sidebar import OfSite, Sidebar, settings_column
from .wrapped_text import draw_sentence


class SEIP_PT_visibility(Sidebar, bpy.types.Panel):
    """Panel: visibility grid."""

    bl_idname = "SEIP_PT_visibility"
    bl_label = "Visibility"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw settings, what they will take, and the button."""
        scene = context.scene
        if scene_status.has_nothing(scene):
            draw_sentence(self.layout, scene_status.NO_SITE, icon="INFO")
            return
        survey = scene.seip.survey
        layout = settings_column(self.layout)
        column = layout.column()
        for name in ("grid", "delta"):
            column.prop(survey, name)
        draw_run(layout, SEIP_OT_compute_visibility.bl_idname)
        draw_run(layout, SEIP_OT_estimate_visibility.bl_idname)
        _draw_state(layout, scene)  # below the buttons, which stay where they are when it grows


class SEIP_PT_visibility_details(OfSite, bpy.types.Panel):
    """How the site is laid out and looked at."""

    bl_idname = "SEIP_PT_visibility_details"
    bl_parent_id = "SEIP_PT_visibility"
    bl_label = "Candidates and Rays"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the settings that mostly stay as they are."""
        survey = context.scene.seip.survey
        layout = settings_column(self.layout)
        column = layout.column(heading="Positions")
        for name in ("spacing", "setback", "clearance", "bracket", "assumed_poles"):
            column.prop(survey, name)
        layout.column().prop(survey, "allow")
        column = layout.column(heading="Returns")
        for name in ("detection", "min_intensity", "rain", "wet_road", "fog"):
            column.prop(survey, name)
        if survey.fog:
            column.prop(survey, "visibility")
        layout.column().prop(survey, "engine")


def _draw_state(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Say what is missing, or what is known and whether it still holds."""
    obstacle = scene_status.obstacle(scene)
    if obstacle:
        draw_sentence(layout, obstacle, icon="ERROR")
        return
    known = session.state_of(scene)
    if known is None:
        return
    doubt = scene_status.stale_survey(scene)
    if doubt:
        draw_sentence(layout, doubt, icon="ERROR")
        return
    site = known.layout.site
    column = layout.column(align=True)
    draw_sentence(column, f"{len(site.targets):,} targets, {len(site.candidates.position):,} positions")
    if known.survey is not None:
        draw_sentence(column, f"Known from {len(site.candidates):,} poses", icon="CHECKMARK")
    elif known.estimate is not None:
        _draw_estimate(column, known.estimate)


def _draw_estimate(column: bpy.types.UILayout, estimate: Estimate) -> None:
    draw_sentence(column, f"{estimate.poses:,} poses, {estimate.triangles:,} triangles")
    draw_sentence(column, f"About {in_words(estimate.seconds)}, {estimate.memory / 1e9:.2g} GB", icon="TIME")


CLASSES = (SEIP_PT_visibility, SEIP_PT_visibility_details)
