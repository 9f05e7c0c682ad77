"""Wrapped text for the sidebar."""

from __future__ import annotations

import blf
import bpy

FONT = 0
"""Number of the font of the interface."""
MARGIN = 46.0
"""Width of a panel's frame, of the tabs and of the scroll bar, pixels at the usual scale of the interface."""
ICON = 22.0
"""Width of an icon before a text, pixels at the usual scale."""
DEFAULT_WIDTH = 250.0
"""Width of the sidebar where there is no region, pixels at the usual scale."""


def draw_sentence(
    layout: bpy.types.UILayout, text: str, *, icon: str = "NONE", alert: bool = False, reserved: float = 0.0
) -> None:
    """Draw a sentence, wrapped to the width of the sidebar.

    Parameters
    ----------
    reserved : float, pixels at the usual scale of the interface
        Width that a button in the same row takes.
    """
    column = layout.column(align=True)
    column.alert = alert
    column.scale_y = 0.8
    rest = "NONE" if icon == "NONE" else "BLANK1"
    for number, line in enumerate(wrapped(text, MARGIN + reserved + (ICON if icon != "NONE" else 0.0))):
        column.label(text=line, icon=icon if number == 0 else rest, translate=False)


def wrapped(text: str, taken: float) -> list[str]:
    """Return the lines of a text in the sidebar.

    Parameters
    ----------
    taken : float, pixels at the usual scale of the interface
        Width of the sidebar that the text cannot use.
    """
    context = bpy.context
    scale = context.preferences.system.ui_scale
    width = (context.region.width if context.region is not None else DEFAULT_WIDTH * scale) - taken * scale
    blf.size(FONT, context.preferences.ui_styles[0].widget.points * scale)
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and blf.dimensions(FONT, longer)[0] <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines
