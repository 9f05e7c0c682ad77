"""The panel of the three steps to a placement: site, sensors, placement."""

from __future__ import annotations

import bpy

from . import placement, sensors, site
from .sections import section
from .sidebar import Sidebar


class SEIP_PT_steps(Sidebar, bpy.types.Panel):
    """Panel: the three steps to a placement, each with its status; the current one is open."""

    bl_idname = "SEIP_PT_steps"
    bl_label = "SEIP"
    bl_options = {"HIDE_HEADER"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the steps."""
        for name, step in (("site", site), ("sensors", sensors), ("placement", placement)):
            body = section(self.layout, name, step.status(context.scene))
            if body is not None:
                step.draw(body, context)


CLASSES = (SEIP_PT_steps,)
