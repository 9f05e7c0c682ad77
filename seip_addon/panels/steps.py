"""The panel: three steps to a placement, then results, traffic and export."""

from __future__ import annotations

import bpy

from . import export, placement, results, sensors, site, traffic
from .sections import section
from .sidebar import Sidebar


class SEIP_PT_steps(Sidebar, bpy.types.Panel):
    """Panel: the three steps to a placement, each with its status, and what follows; the current step is open."""

    bl_idname = "SEIP_PT_steps"
    bl_label = "SEIP"
    bl_options = {"HIDE_HEADER"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the sections."""
        for name, step in (("site", site), ("sensors", sensors), ("placement", placement)):
            body = section(self.layout, name, step.status(context.scene))
            if body is not None:
                step.draw(body, context)
        self.layout.separator(type="LINE")
        for name, part in (("results", results), ("traffic", traffic), ("export", export)):
            body = section(self.layout, name)
            if body is not None:
                part.draw(body, context)


CLASSES = (SEIP_PT_steps,)
