"""The panel of visibility."""

from __future__ import annotations

import bpy

from ..operators.visibility import SEIP_OT_compute_visibility
from .run_button import draw_run
from .sidebar import Sidebar


class SEIP_PT_visibility(Sidebar, bpy.types.Panel):
    """Who sees what."""

    bl_idname = "SEIP_PT_visibility"
    bl_label = "Visibility"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw settings and the button."""
        survey = context.scene.seip.survey
        layout = self.layout
        layout.use_property_split = True
        layout.prop(survey, "grid")
        layout.prop(survey, "delta")
        draw_run(layout, SEIP_OT_compute_visibility.bl_idname)


CLASSES = (SEIP_PT_visibility,)
