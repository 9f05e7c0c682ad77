"""The panel of the placement."""

from __future__ import annotations

import bpy

from ..operators.placement import SEIP_OT_solve_placement
from .run_button import draw_run
from .sidebar import Sidebar


class SEIP_PT_placement(Sidebar, bpy.types.Panel):
    """Which sensors where."""

    bl_idname = "SEIP_PT_placement"
    bl_label = "Placement"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the goal and the button."""
        goal = context.scene.seip.goal
        layout = self.layout
        layout.use_property_split = True
        layout.prop(goal, "limit", expand=True)
        layout.prop(goal, goal.limit.lower())
        draw_run(layout, SEIP_OT_solve_placement.bl_idname)


CLASSES = (SEIP_PT_placement,)
