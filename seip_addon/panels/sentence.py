"""Sentences that are longer than a sidebar is wide."""

from __future__ import annotations

import textwrap

import bpy

PIXELS_PER_LETTER = 6.3
"""Of Blender's font at a scale of one, about, with its margins."""
MARGIN = 50.0
"""Pixels of a panel's frame, scroll bar and icon."""
NARROWEST = 16
"""Letters of a line at least."""


def draw_sentence(layout: bpy.types.UILayout, text: str, *, icon: str = "NONE", alert: bool = False) -> None:
    """Draw a sentence on as many lines as the sidebar's width asks for."""
    context = bpy.context
    width = context.region.width / context.preferences.system.ui_scale if context.region is not None else 250.0
    lines = textwrap.wrap(text, max(NARROWEST, int((width - MARGIN) / PIXELS_PER_LETTER)))
    column = layout.column(align=True)
    column.alert = alert
    column.scale_y = 0.8
    for number, line in enumerate(lines):
        column.label(text=line, icon=icon if number == 0 else ("BLANK1" if icon != "NONE" else "NONE"))
