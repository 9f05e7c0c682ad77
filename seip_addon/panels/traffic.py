"""The panel of traffic and scans."""

from __future__ import annotations

import bpy

from ..operators.traffic import (
    SEIP_OT_clear_traffic,
    SEIP_OT_load_traffic,
    SEIP_OT_scan_frame,
    SEIP_OT_try_in_traffic,
    SEIP_OT_write_dataset,
    why_no_load,
    why_no_scan,
    why_no_trial,
)
from ..session import session
from .run_button import draw_run
from .sidebar import Sidebar, settings_column
from .wrapped_text import draw_sentence


class SEIP_PT_traffic(Sidebar, bpy.types.Panel):
    """Traffic in the scene."""

    bl_idname = "SEIP_PT_traffic"
    bl_label = "Traffic and Detection"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw where traffic comes from."""
        traffic = context.scene.seip.traffic
        layout = self.layout
        column = layout.column(align=True)
        column.prop(traffic, "file", text="", placeholder="Traffic (.npz, .xml)")
        if traffic.file and not traffic.file.lower().endswith(".npz"):
            column.prop(traffic, "routes", text="", placeholder="Routes (vehicle types)")
            column.prop(traffic, "net", text="", placeholder="Network (.net.xml)")
        reason = why_no_load(context.scene)
        if reason and traffic.file:  # an empty field says so itself
            draw_sentence(layout, reason, icon="INFO")
        row = layout.row(align=True)
        draw_run(row, SEIP_OT_load_traffic.bl_idname)
        row.operator(SEIP_OT_clear_traffic.bl_idname, text="", icon="TRASH")
        row.operator("screen.animation_play", text="", icon="PLAY")
        for line in traffic.loaded.splitlines():
            draw_sentence(layout, line)
        if not why_no_trial(context.scene):
            draw_run(layout, SEIP_OT_try_in_traffic.bl_idname)


class SEIP_PT_scan(Sidebar, bpy.types.Panel):
    """One frame."""

    bl_idname = "SEIP_PT_scan"
    bl_label = "Scan"
    bl_parent_id = SEIP_PT_traffic.bl_idname
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw how scans are made, and the last."""
        traffic = context.scene.seip.traffic
        layout = self.layout
        why_not = why_no_scan(context.scene)
        if why_not:
            draw_sentence(layout, why_not, icon="INFO")
            return
        column = settings_column(layout)
        column.prop(traffic, "noise")
        column.prop(traffic, "seed")
        column.prop(traffic, "rolling_shutter")
        column.prop(traffic, "follow")
        draw_run(layout, SEIP_OT_scan_frame.bl_idname)
        scan = session.scan_of(context.scene)
        for line in scan.facts if scan is not None else ():
            draw_sentence(layout, line)


class SEIP_PT_dataset(Sidebar, bpy.types.Panel):
    """Many frames."""

    bl_idname = "SEIP_PT_dataset"
    bl_label = "Dataset"
    bl_parent_id = SEIP_PT_traffic.bl_idname
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw what is written where."""
        traffic = context.scene.seip.traffic
        layout = self.layout
        why_not = why_no_scan(context.scene)
        if why_not:
            draw_sentence(layout, why_not, icon="INFO")
            return
        column = settings_column(layout)
        column.prop(traffic, "folder")
        column.prop(traffic, "whole")
        if not traffic.whole:
            column.prop(traffic, "start")
            column.prop(traffic, "duration")
        column.prop(traffic, "rate")
        column.prop(traffic, "split")
        layout.label(text="Formats")
        layout.column(align=True).prop(traffic, "formats")
        draw_run(layout, SEIP_OT_write_dataset.bl_idname)


CLASSES = (SEIP_PT_traffic, SEIP_PT_scan, SEIP_PT_dataset)
