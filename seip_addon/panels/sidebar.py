"""Parts of the sidebar: mixins of panels and lists, columns, paths, and buttons that show progress."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.base.progress import progress_line
from ..core.workflows.traffic_runs import traffic_folder
from ..operators.base import is_searching
from ..state import scene_status
from ..state.session import session
from ..viewport.overlays import TAB
from .wrapped_text import MARGIN, draw_sentence, sidebar_width, text_width

FIELD = 34.0
"""Width that the margins of a field and its button for files take, pixels at the interface's usual scale."""
NARROW = 250
"""Pixels at the interface's usual scale."""


def draw_run(
    layout: bpy.types.UILayout,
    operator: str,
    icon: str = "NONE",
    text: str | None = None,
    *,
    in_one_row: bool = False,
) -> None:
    """Draw an operator's button, or in its place the progress of its work; the button of the next step is emphasised.

    The progress is a row that takes the place of the button, with the time in its bar, and a sentence below unless
    there is only one row.
    """
    running = session.running
    row = layout.row(align=True)
    if running is None or running.operator != operator:
        row.active_default = scene_status.next_step(bpy.context.scene) == operator
        row.operator(operator, icon=icon, text=text)
        return
    progress, duration = running.shown
    row.progress(factor=progress.done / progress.total if progress.total else 0.0, text=duration)
    if is_searching():
        row.operator("seip.accept", text="", icon="CHECKMARK")
    row.operator("seip.stop", text="", icon="X")
    if in_one_row:
        return
    line = progress_line(progress)
    draw_sentence(layout, f"{line[:1].upper()}{line[1:]}")


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


def draw_reason(layout: bpy.types.UILayout, reason: str) -> bool:
    """Draw the reason why a section has nothing to show, and return whether there is one."""
    if reason:
        draw_sentence(layout, reason, icon="INFO")
    return bool(reason)


def draw_settings(layout: bpy.types.UILayout, owner: bpy.types.PropertyGroup, *names: str) -> bpy.types.UILayout:
    """Draw properties in a column of settings, and return the column."""
    column = settings_column(layout)
    for name in names:
        column.prop(owner, name)
    return column


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


def draw_runs(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the folder with runs of traffic."""
    draw_path(layout, scene.seip.traffic, "runs", placeholder=traffic_folder(Path(bpy.data.filepath)).name)


def is_narrow(context: bpy.types.Context) -> bool:
    """Return whether the sidebar has no room for a row of figures."""
    region = context.region
    return region is not None and region.width < NARROW * context.preferences.system.ui_scale
