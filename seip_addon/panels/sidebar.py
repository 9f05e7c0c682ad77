"""Mixins of the sidebar's panels and lists."""

from __future__ import annotations

import bpy

from ..viewport.overlays import TAB
from .wrapped_text import MARGIN, draw_sentence, sidebar_width, text_width

FIELD = 34.0
"""Width that the margins of a field and its button for files take, pixels at the interface's usual scale."""
NARROW = 250
"""Pixels at the interface's usual scale."""


class Sidebar:
    """A mixin: a panel in the tab SEIP of the 3D viewport's sidebar."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = TAB


class RowList:
    """A mixin: a list whose rows are drawn by `draw_row`."""

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: object,
        item: bpy.types.PropertyGroup,
        _icon: int,
        _active_data: object,
        _active_property: str,
    ) -> None:
        """Draw a row."""
        self.draw_row(layout, item)

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw a row."""
        raise NotImplementedError


def settings_column(layout: bpy.types.UILayout) -> bpy.types.UILayout:
    """Return a column of settings: names on the left, values on the right; in a narrow sidebar names within fields."""
    column = layout.column()
    column.use_property_split = not is_narrow(bpy.context)
    column.use_property_decorate = False
    return column


def draw_path(
    layout: bpy.types.UILayout,
    owner: bpy.types.PropertyGroup,
    name: str,
    placeholder: str = "",
    *,
    named: bool = True,
) -> None:
    """Draw a file or folder over the whole width, and below the field again if it has no room there."""
    column = layout.column(align=True)
    column.use_property_split = False
    if named:
        column.label(text=owner.bl_rna.properties[name].name)
    column.prop(owner, name, text="", placeholder=placeholder)
    path = getattr(owner, name)
    if text_width(path) > sidebar_width() - MARGIN - FIELD:
        draw_sentence(column, path)


def is_narrow(context: bpy.types.Context) -> bool:
    """Return whether the sidebar has no room for a row of figures."""
    region = context.region
    return region is not None and region.width < NARROW * context.preferences.system.ui_scale
