"""The section "Export": report, files and picture of the placement."""

from __future__ import annotations

import bpy

from ..operators import results
from ..operators.view import SEIP_OT_save_picture
from .run_button import draw_run
from .wrapped_text import draw_sentence


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the folder and the buttons."""
    scene = context.scene
    sentence = results.no_placement(scene)
    if sentence:
        draw_sentence(layout, sentence, icon="INFO")
        return
    layout.prop(scene.seip.result, "folder", text="")
    layout.prop(scene.seip.result, "render")
    sentence = results.no_folder(scene) or results.not_evaluated(scene)
    if sentence:
        draw_sentence(layout, sentence, icon="INFO")
    draw_run(layout, results.SEIP_OT_write_report.bl_idname, icon="FILE_TEXT")
    draw_run(layout, results.SEIP_OT_export_result.bl_idname, icon="EXPORT", text="Export Files")
    view = scene.seip.view
    column = layout.column(align=True)
    column.label(text="Picture")
    column.row(align=True).prop(view, "picture_of", expand=True)
    column.prop(view, "picture", text="")
    draw_run(column, SEIP_OT_save_picture.bl_idname, icon="IMAGE_DATA")
