"""Wrapped text for the sidebar.

`tests/addon/test_front_door.py` shows its use.
"""

from __future__ import annotations

import blf
import bpy

FONT = 0
"""Number of the font of the interface."""
MARGIN = 62.0
"""Width of a panel's frame, of the tabs, of the scroll bar and before a text, pixels at the usual scale."""
BOX = 22.0
"""Width of the frame of a box, pixels at the usual scale."""
ICON = 18.0
"""Width that an icon before a text takes from it, pixels at the usual scale."""
DEFAULT_WIDTH = 250.0
"""Width of the sidebar where there is no region, pixels at the usual scale."""


def draw_sentence(
    layout: bpy.types.UILayout,
    text: str,
    *,
    icon: str = "NONE",
    alert: bool = False,
    reserved: float = 0.0,
) -> None:
    """Draw a sentence, wrapped to the width of the sidebar.

    Parameters
    ----------
    reserved : float, pixels at the usual scale of the interface
        Width that a button in the same row takes.
    """
    draw_lines(layout, wrapped(text, MARGIN + reserved + (ICON if icon != "NONE" else 0.0)), icon, alert=alert)


def draw_lines(layout: bpy.types.UILayout, lines: list[str], icon: str = "NONE", *, alert: bool = False) -> None:
    """Draw the lines of a text, with an icon before the first."""
    column = layout.column(align=True)
    column.alert = alert
    column.scale_y = 0.8
    rest = "NONE" if icon == "NONE" else "BLANK1"
    for number, line in enumerate(lines):
        column.label(text=line, icon=icon if number == 0 else rest, translate=False)


def wrapped(text: str, taken: float, width: float | None = None) -> list[str]:
    """Return the lines of a text in the sidebar.

    Parameters
    ----------
    taken : float, pixels at the usual scale of the interface
        Width of the sidebar that the text cannot use.
    width : float, pixels at the usual scale of the interface, optional
        Width in place of that of the region.
    """
    room = (sidebar_width() if width is None else width) - taken
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(longer) <= room:
            lines[-1] = longer
        else:
            lines += _pieces(word, room)
    return lines


def _pieces(word: str, room: float) -> list[str]:
    """Return a word, such as a path, in pieces that have room in a line each, of one letter at least."""
    pieces = [word]
    while text_width(pieces[-1]) > room and len(pieces[-1]) > 1:
        rest = pieces.pop()
        most = max((n for n in range(1, len(rest)) if text_width(rest[:n]) <= room), default=1)
        at_separator = max(rest.rfind(separator, 0, most) for separator in "/\\") + 1
        cut = at_separator if at_separator > 1 else most
        pieces += [rest[:cut], rest[cut:]]
    return pieces


def sidebar_width() -> float:
    """Return the width of the region that is drawn, pixels at the usual scale of the interface."""
    region = bpy.context.region
    return DEFAULT_WIDTH if region is None else float(region.width) / _scale()


def text_width(text: str) -> float:
    """Return the width of a text in the interface, pixels at its usual scale."""
    scale = _scale()
    blf.size(FONT, bpy.context.preferences.ui_styles[0].widget.points * scale)
    return float(blf.dimensions(FONT, text)[0]) / scale


def _scale() -> float:
    """Return the scale of the interface; Blender without a window gives 0."""
    return float(bpy.context.preferences.system.ui_scale) or 1.0
