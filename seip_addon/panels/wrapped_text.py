"""Wrapped text for the sidebar."""

from __future__ import annotations

import textwrap

import bpy

PIXELS_PER_LETTER = 6.3
"""Of Blender's font at a scale of one, about, with its margins."""
MARGIN = 60.0
"""Pixels of a panel's frame, tabs and scroll bar."""
BESIDE_ICON = 36.0
"""Pixels of an icon, and of a box: most sentences in boxes have one."""
NARROWEST = 12
"""Letters of a line at least."""


def draw_sentence(layout: bpy.types.UILayout, text: str, *, icon: str = "NONE", alert: bool = False) -> None:
    """Draw a sentence, wrapped to the width of the sidebar."""
    context = bpy.context
    width = context.region.width / context.preferences.system.ui_scale if context.region is not None else 250.0
    room = width - MARGIN - (BESIDE_ICON if icon != "NONE" else 0.0)
    lines = textwrap.wrap(text, max(NARROWEST, int(room / PIXELS_PER_LETTER)))
    column = layout.column(align=True)
    column.alert = alert
    column.scale_y = 0.8
    for number, line in enumerate(lines):
        column.label(text=line, icon=icon if number == 0 else ("BLANK1" if icon != "NONE" else "NONE"))
