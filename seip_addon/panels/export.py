"""The section "Export": report, files and picture of the placement."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..operators import results
from .sidebar import draw_path, draw_reason, draw_run


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the folder and the buttons."""
    scene = context.scene
    if draw_reason(layout, results.no_placement(scene)):
        return
    draw_path(layout, scene.seip.result, "folder")
    layout.prop(scene.seip.result, "render")
    draw_reason(layout, results.no_folder(scene) or results.not_evaluated(scene))
    draw_run(layout, "seip.write_report", icon="FILE_TEXT")
    draw_run(layout, "seip.export_result", icon="EXPORT", text="Export Files")
    _draw_files(layout, results.exported_files(scene))
    column = layout.column(align=True)
    draw_path(column, scene.seip.view, "picture")
    draw_run(column, "seip.save_picture", icon="IMAGE_DATA")


def _draw_files(layout: bpy.types.UILayout, files: dict[str, Path]) -> None:
    """Draw buttons that open the plan, the report and their folder, as far as they are there."""
    row = layout.row(align=True)
    for what, path in files.items():
        row.operator("wm.path_open", text=f"Open {what}", icon="FILE").filepath = str(path)
    for folder in {path.parent for path in files.values()}:
        row.operator("wm.path_open", text="", icon="FILE_FOLDER").filepath = str(folder)
