"""Sections of a panel that open and close, each with a title and a status."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

import bpy

from .wrapped_text import MARGIN, text_width

UNIT = 20.0
"""Pixels of Blender's unit of width, at the usual scale of the interface."""
GAP = 1.5
"""Units of a label's margins."""
ARROW = 20.0
"""Pixels before a title, at the usual scale of the interface."""
BETWEEN = " · "
"""Between two parts of a status, the most important first."""

Subject = TypeVar("Subject")


def draw_sections(
    layout: bpy.types.UILayout,
    sections: Mapping[str, Callable[[bpy.types.UILayout, Subject], None]],
    subject: Subject,
    status: Mapping[str, str] | None = None,
) -> None:
    """Draw sections below each other: the header of each, and the content of those that are open.

    Parameters
    ----------
    sections : mapping of str to callable
        Function that draws the content of each section into a layout, by the property of `SEIP_PG_sections` that holds
        whether the section is open. The name of the property is the title.
    subject : object
        Second argument of these functions: the context, a scene or what else they draw.
    status : mapping of str to str, optional
        Text at the right of the title, by section.
    """
    for name, draw_content in sections.items():
        header, content = layout.panel_prop(bpy.context.scene.seip.sections, name)
        _draw_header(header, name, (status or {}).get(name, ""))
        if content is not None:
            draw_content(content, subject)


def _draw_header(header: bpy.types.UILayout, name: str, status: str) -> None:
    title = bpy.context.scene.seip.sections.bl_rna.properties[name].name
    if not status:
        header.label(text=title)
        return
    row = header.row()
    left = row.row()
    left.ui_units_x = text_width(title) / UNIT + GAP  # else the row gives title and status equal shares
    left.label(text=title)
    right = row.row()
    right.active = False
    right.label(text=fitting(status, text_width(title)), translate=False)


def fitting(status: str, title: float) -> str:
    """Return the parts of a status that have room beside a title of a width, from the first."""
    region = bpy.context.region
    if region is None:
        return status
    room = region.width / (bpy.context.preferences.system.ui_scale or 1.0) - MARGIN - ARROW - title - GAP * UNIT
    parts = status.split(BETWEEN)
    while len(parts) > 1 and text_width(BETWEEN.join(parts)) > room:
        parts.pop()
    return BETWEEN.join(parts)
