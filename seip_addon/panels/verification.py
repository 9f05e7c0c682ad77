"""The section "Verification": installed sensors compared with their plan, by a recording."""

from __future__ import annotations

import bpy

from ..operators.verification import (
    NO_RECORDING,
    SEIP_OT_correct_scene,
    SEIP_OT_verify,
    picture_of,
    sentences_of,
    why_no_correction,
    why_no_verification,
)
from .run_button import draw_run
from .sidebar import draw_path
from .wrapped_text import BOX, draw_sentence


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the recording, the button, and what the last verification found."""
    scene = context.scene
    draw_path(layout, scene.seip.verification, "recording", "Recording (folder, .pcap)", named=False)
    reason = why_no_verification(scene)
    if reason and reason != NO_RECORDING:  # an empty field says so itself
        draw_sentence(layout, reason, icon="INFO")
    draw_run(layout, SEIP_OT_verify.bl_idname)
    sentences = sentences_of(scene)
    if not sentences:
        return
    box = layout.box()
    for sentence in sentences:
        draw_sentence(box, sentence, reserved=BOX)
    changed = why_no_correction(scene)
    if changed:
        draw_sentence(box, changed, icon="INFO", reserved=BOX)
    row = box.row(align=True)
    row.operator(SEIP_OT_correct_scene.bl_idname, icon="ADD")
    row.operator("wm.path_open", text="Show Picture", icon="IMAGE_DATA").filepath = str(picture_of(scene))
