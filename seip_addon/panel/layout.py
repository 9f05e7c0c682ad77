"""Parts of the sidebar's layout: wrapped text, settings, paths, buttons that show progress, and sections that open.

`tests/addon/test_front_door.py` shows its use.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple, TypeVar

import blf
import bpy

from ..core.base.progress import progress_line
from ..core.workflows.traffic_runs import traffic_folder
from . import scene_status
from .overlays import TAB
from .session import session
from .work import Outcome, is_searching

FONT = 0
"""Number of the font of the interface."""
FIELD = 34.0
"""Width of the frame of a field and of its button, pixels at the usual scale."""
MARGIN = 62.0
"""Width of a panel's frame, of the tabs, of the scroll bar and before a text, pixels at the usual scale."""
BOX = 22.0
"""Width of the frame of a box, pixels at the usual scale."""
ICON = 18.0
"""Width that an icon before a text takes from it, pixels at the usual scale."""
DEFAULT_WIDTH = 250.0
"""Width of the sidebar where there is no region, pixels at the usual scale."""
NARROW = 250
"""Pixels at the interface's usual scale."""
UNIT = 20.0
"""Pixels of Blender's unit of width, at the usual scale of the interface."""
GAP = 1.5
"""Units of a label's margins."""
ARROW = 20.0
"""Pixels before a title, at the usual scale of the interface."""
BETWEEN = " · "
"""Between two parts of a status, the most important first."""
ICONS = {"changed": "ERROR", "working": "TIME"}
"""Icons of the parts that every header has room for: they take the place of the words where these have none."""
_SITE = ("choose_map", "download_map", "build_site")
_SIMULATION, _SCAN = ("simulate_traffic", "install_sumo"), ("scan_frame",)
_DETECTION = ("detect",)
WORK: Mapping[str, tuple[str, ...]] = {
    "site": (*_SITE, "load_example", "check_site", "install_sumo"),
    "change_site": (*_SITE, "install_sumo"),
    "placement": ("solve_placement", "judge_placement", "compare_scene", "evaluate_sensors"),
    "results": ("follow_sensors", "show_sight_lines"),
    "view": ("show_sight_lines",),
    "traffic": ("load_traffic", *_SIMULATION, *_SCAN, *_DETECTION),
    "simulation": _SIMULATION,
    "scan": _SCAN,
    "detection": _DETECTION,
    "export": ("export_result",),
}
"""Long operators whose progress is drawn in each section, which its header shows while the section is closed."""


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


def wrapped(text: str, taken: float) -> list[str]:
    """Return the lines of a text in the sidebar.

    Parameters
    ----------
    taken : float, pixels at the usual scale of the interface
        Width of the sidebar that the text cannot use.
    """
    room = sidebar_width() - taken
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


def draw_run(
    layout: bpy.types.UILayout,
    operator: str,
    icon: str = "NONE",
    text: str | None = None,
) -> None:
    """Draw an operator's button, or in its place the progress of its work; the button of the next step is emphasised.

    The progress is a row that takes the place of the button, with the time in its bar, and a sentence below.
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


def draw_list(
    layout: bpy.types.UILayout, kind: type[bpy.types.UIList], owner: bpy.types.PropertyGroup, items: str, active: str
) -> None:
    """Draw a list with all its rows: a list that scrolls would take the mouse wheel from the sidebar."""
    rows = max(1, len(getattr(owner, items)))
    layout.template_list(kind.__name__, "", owner, items, owner, active, rows=rows, maxrows=rows)


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


Subject = TypeVar("Subject")


class Status(NamedTuple):
    """Status of a section.

    Parameters
    ----------
    changed : bool
        Whether the result no longer belongs to the scene or its settings.
    result : tuple of str
        Parts of the result, the most important first; those without room are left out.
    """

    changed: bool = False
    result: tuple[str, ...] = ()


def draw_sections(
    layout: bpy.types.UILayout,
    sections: Mapping[str, Callable[[bpy.types.UILayout, Subject], None]],
    subject: Subject,
    status: Mapping[str, Status] | None = None,
) -> None:
    """Draw sections below each other: the header of each, and the content of those that are open.

    Parameters
    ----------
    sections : mapping of str to callable
        Function that draws the content of each section into a layout, by the property of `SEIP_PG_sections` that holds
        whether the section is open. The name of the property is the title.
    subject : object
        Second argument of these functions: the context, a scene or what else they draw.
    status : mapping of str to Status, optional
        Status by section, at the right of the title.
    """
    for name, draw_content in sections.items():
        header, content = layout.panel_prop(bpy.context.window_manager.seip_sections, name)
        _draw_header(header, name, (status or {}).get(name, Status()), is_open=content is not None)
        if content is not None:
            draw_content(content, subject)


def _draw_header(header: bpy.types.UILayout, name: str, status: Status, *, is_open: bool) -> None:
    title = bpy.context.window_manager.seip_sections.bl_rna.properties[name].name
    row = header.row()
    left = row.row()
    left.ui_units_x = text_width(title) / UNIT + GAP  # else the row gives title and status equal shares
    left.label(text=title)
    urgent = ["changed"] if status.changed else []
    if not is_open and session.running is not None and session.running.operator.partition(".")[2] in WORK.get(name, ()):
        urgent.append("working")
    text = fitting(urgent, status.result, text_width(title))
    right = row.row(align=True)
    right.alignment = "LEFT"
    right.active = bool(urgent)
    if text is None:
        for part in urgent:
            right.label(text="", icon=ICONS[part])
    elif text:
        right.label(text=text, translate=False)


def fitting(urgent: list[str], result: tuple[str, ...], title: float) -> str | None:
    """Return the urgent parts of a status and those of its result that have room beside a title of a width.

    Returns
    -------
    str or None
        None if the urgent parts have no room as words.
    """
    text, room = BETWEEN.join(urgent), sidebar_width() - MARGIN - ARROW - title - GAP * UNIT
    if text_width(text) > room:
        return None
    for part in result:
        longer = f"{text}{BETWEEN}{part}" if text else part
        if text_width(longer) <= room:
            text = longer
    return text


class SEIP_OT_remove_entry(bpy.types.Operator):
    """Remove the active entry of the list"""

    bl_idname = "seip.remove_entry"
    bl_label = "Remove"
    bl_options = {"REGISTER", "UNDO"}

    of: bpy.props.EnumProperty(
        name="List",
        description="List that the entry is removed from",
        items=(("RULES", "Rules", "Positions with a rule"), ("KEPT", "Placements", "Placements that were kept")),
    )

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Remove it, if there is one."""
        seip = context.scene.seip
        owner, entries, active = (seip.goal, seip.goal.rules, "active_rule")
        if self.of == "KEPT":
            owner, entries, active = (seip, seip.kept, "active_kept")
        number = getattr(owner, active)
        if number not in range(len(entries)):
            return {"CANCELLED"}
        entries.remove(number)
        setattr(owner, active, max(0, number - 1))
        return {"FINISHED"}
