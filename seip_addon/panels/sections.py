"""Sections of a panel that open and close, each with a title and a status."""

from __future__ import annotations

import bpy

from .wrapped_text import text_width

UNIT = 20.0
"""Pixels of Blender's unit of width, at the usual scale of the interface."""
GAP = 1.5
"""Units of a label's margins."""


def section(layout: bpy.types.UILayout, name: str, status: str = "") -> bpy.types.UILayout | None:
    """Draw a section's header, and return the layout of its content, or None while it is closed.

    Parameters
    ----------
    name : str
        Property of `SEIP_PG_sections` that holds whether the section is open; its name is the title.
    status : str
        Text at the right of the title.
    """
    sections = bpy.context.scene.seip.sections
    header, body = layout.panel_prop(sections, name)
    title = sections.bl_rna.properties[name].name
    if not status:
        header.label(text=title)
        return body
    row = header.row()
    left = row.row()
    left.ui_units_x = text_width(title) / UNIT + GAP  # else the row gives title and status equal shares
    left.label(text=title)
    right = row.row()
    right.active = False
    right.label(text=status, translate=False)
    return body
