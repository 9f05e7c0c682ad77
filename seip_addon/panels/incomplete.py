"""The panel that stands in for all others where a package is missing."""

from __future__ import annotations

import bpy

from .sidebar import Sidebar

MISSING = ""
"""Name of the package, set by `registration`."""


class SEIP_PT_incomplete(Sidebar, bpy.types.Panel):
    """Says what is missing."""

    bl_idname = "SEIP_PT_incomplete"
    bl_label = "SEIP Cannot Start"

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the one sentence and the cure."""
        column = self.layout.column(align=True)
        column.alert = True
        column.label(text=f"The package {MISSING!r} is missing.", icon="ERROR")
        column.label(text="Install the extension's zip again:")
        column.label(text="it carries all that it needs.")


CLASSES = (SEIP_PT_incomplete,)
