"""Sentences in a sidebar, over as many lines as they take."""

from __future__ import annotations

import textwrap

import bpy

CHARACTER = 7.0
"""Pixels that a character takes at the interface's usual scale, on average and somewhat more."""
BORDER = 60.0
"""Pixels of a sidebar beside its labels: tabs, margins, an icon."""
FEWEST = 16
"""Characters in a line, however narrow the sidebar."""


def draw_sentence(layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE") -> None:
    """Draw a text, each of its lines wrapped to the width of the region."""
    scale = context.preferences.system.ui_scale
    width = context.region.width if context.region else 250
    fits = max(int((width - BORDER * scale) / (CHARACTER * scale)), FEWEST)
    column = layout.column(align=True)
    column.scale_y = 0.8
    lines = [part for line in text.splitlines() for part in textwrap.wrap(line, fits)]
    for number, line in enumerate(lines):
        column.label(text=line, icon=icon if number == 0 else "BLANK1" if icon != "NONE" else "NONE")
