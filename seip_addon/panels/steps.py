"""The panel: three steps to a placement, then results, traffic and export."""

from __future__ import annotations

import bpy

from . import export, placement, results, sensors, site, traffic
from .sections import draw_sections
from .sidebar import Sidebar


class SEIP_PT_steps(Sidebar, bpy.types.Panel):
    """Panel: the three steps to a placement, each with its status, and what follows; the current step is open."""

    bl_label = "Sensor Placement"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the sections."""
        steps = {"site": site, "sensors": sensors, "placement": placement}
        status = {name: step.status(context.scene) for name, step in steps.items()}
        draw_sections(self.layout, {name: step.draw for name, step in steps.items()}, context, status)
        self.layout.separator(type="LINE")
        after = {"results": results, "traffic": traffic, "export": export}
        status = {name: part.status(context.scene) for name, part in after.items() if part is not export}
        draw_sections(self.layout, {name: part.draw for name, part in after.items()}, context, status)
