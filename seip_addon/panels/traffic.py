"""The section "Traffic and Detection": traffic, scans, datasets, detection."""

from __future__ import annotations

import bpy

from ..operators.traffic import (
    SEIP_OT_clear_traffic,
    SEIP_OT_load_traffic,
    SEIP_OT_scan_frame,
    SEIP_OT_write_dataset,
    why_no_load,
    why_no_scan,
)
from ..session import session
from . import detection, simulation, verification
from .run_button import draw_run
from .sections import Status, draw_sections
from .sidebar import draw_path, settings_column
from .wrapped_text import draw_sentence


def _each_status(scene: bpy.types.Scene) -> dict[str, Status]:
    """Return the status of each section that has one."""
    return {"simulation": simulation.status(scene), "detection": detection.status(scene)}


def status(scene: bpy.types.Scene) -> Status:
    """Return whether some result below is out of date."""
    return Status(any(one.changed for one in _each_status(scene).values()))


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw where traffic comes from."""
    traffic = context.scene.seip.traffic
    column = layout.column(align=True)
    draw_path(column, traffic, "file", "Traffic (.npz, .xml)", named=False)
    files = traffic.files()
    if files is not None and not files.trajectories:
        draw_path(column, traffic, "routes", "Routes (vehicle types)", named=False)
        draw_path(column, traffic, "net", "Network (.net.xml)", named=False)
    reason = why_no_load(context.scene)
    if reason and traffic.file:  # an empty field says so itself
        draw_sentence(layout, reason, icon="INFO")
    row = layout.row(align=True)
    draw_run(row, SEIP_OT_load_traffic.bl_idname)
    row.operator(SEIP_OT_clear_traffic.bl_idname, text="", icon="TRASH")
    row.operator("screen.animation_play", text="", icon="PLAY")
    for line in traffic.loaded.splitlines():
        draw_sentence(layout, line)
    draw_sections(
        layout,
        {
            "simulation": simulation.draw,
            "scan": _draw_scan,
            "dataset": _draw_dataset,
            "detection": detection.draw,
            "verification": verification.draw,
        },
        context,
        _each_status(context.scene),
    )


def _draw_scan(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw how scans are made, and the last."""
    traffic = context.scene.seip.traffic
    why_not = why_no_scan(context.scene)
    if why_not:
        draw_sentence(layout, why_not, icon="INFO")
        return
    column = settings_column(layout)
    column.prop(traffic, "noise")
    column.prop(traffic, "seed")
    column.prop(traffic, "rolling_shutter")
    draw_run(layout, SEIP_OT_scan_frame.bl_idname)
    scan = session.scan_of(context.scene)
    for line in scan.facts if scan is not None else ():
        draw_sentence(layout, line)


def _draw_dataset(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw what is written where."""
    traffic = context.scene.seip.traffic
    why_not = why_no_scan(context.scene)
    if why_not:
        draw_sentence(layout, why_not, icon="INFO")
        return
    draw_path(layout, traffic, "folder")
    column = settings_column(layout)
    column.prop(traffic, "whole")
    if not traffic.whole:
        column.prop(traffic, "start")
        column.prop(traffic, "duration")
    column.prop(traffic, "rate")
    column.prop(traffic, "split")
    layout.label(text="Formats")
    layout.column(align=True).prop(traffic, "formats")
    draw_run(layout, SEIP_OT_write_dataset.bl_idname)
