"""Sections of a panel that open and close, each with a title and a status."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeVar

import bpy

from ..state.session import session
from .wrapped_text import MARGIN, text_width

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
_SIMULATION, _SCAN, _DATASET = ("simulate_traffic", "install_sumo"), ("scan_frame",), ("write_dataset",)
_DETECTION, _VERIFICATION = ("detect",), ("verify",)
WORK: Mapping[str, tuple[str, ...]] = {
    "site": (*_SITE, "load_example", "check_site", "install_sumo"),
    "change_site": (*_SITE, "install_sumo"),
    "placement": ("solve_placement", "judge_placement", "compare_scene", "evaluate_sensors"),
    "results": ("follow_sensors", "show_sight_lines"),
    "view": ("show_sight_lines",),
    "traffic": ("load_traffic", *_SIMULATION, *_SCAN, *_DATASET, *_DETECTION, *_VERIFICATION),
    "simulation": _SIMULATION,
    "scan": _SCAN,
    "dataset": _DATASET,
    "detection": _DETECTION,
    "verification": _VERIFICATION,
    "export": ("write_report", "export_result", "save_picture"),
}
"""Long operators whose progress is drawn in each section, which its header shows while the section is closed."""

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
    region, text = bpy.context.region, BETWEEN.join(urgent)
    if region is None:
        return BETWEEN.join((*urgent, *result))
    room = region.width / (bpy.context.preferences.system.ui_scale or 1.0) - MARGIN - ARROW - title - GAP * UNIT
    if text_width(text) > room:
        return None
    for part in result:
        longer = f"{text}{BETWEEN}{part}" if text else part
        if text_width(longer) <= room:
            text = longer
    return text
