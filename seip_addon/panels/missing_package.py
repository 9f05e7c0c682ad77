"""The panel that stands in for all others where a package is missing."""

from __future__ import annotations

import bpy

from .sidebar import Sidebar
from .wrapped_text import draw_sentence

MISSING = ""
"""Name of the package, set by `registration`."""


class SEIP_PT_incomplete(Sidebar, bpy.types.Panel):
    """Says what is missing."""

    bl_label = "SEIP Cannot Start"

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the one sentence and the cure."""
        sentence = f"The package {MISSING!r} is missing or broken. Install the extension's zip again: it carries all."
        draw_sentence(self.layout, sentence, icon="ERROR", alert=True)
