"""Video of a series of pictures, encoded by Blender's sequencer."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
from PIL import Image

from seip_addon.core.storage.files import whole_file
from seip_addon.scene.interrupts import held_signals
from seip_addon.scene.render import silenced


def save_video(path: Path, pictures: Sequence[Path], rate: float) -> None:
    """Write pictures of one size as an MP4 video (H.264).

    Parameters
    ----------
    rate : float, hertz
        Pictures per second.
    """
    scene = bpy.data.scenes.new("video")
    try:
        with Image.open(pictures[0]) as first:
            render = scene.render
            render.resolution_x, render.resolution_y = first.size
        render.resolution_percentage = 100
        render.fps, render.fps_base = max(1, round(rate)), max(1, round(rate)) / rate
        scene.view_settings.view_transform = "Standard"  # pictures keep their colours
        sequencer = scene.sequence_editor_create()
        strips = sequencer.strips if hasattr(sequencer, "strips") else sequencer.sequences
        strip = strips.new_image("pictures", str(pictures[0]), channel=1, frame_start=1)
        for picture in pictures[1:]:
            strip.elements.append(picture.name)
        scene.frame_start, scene.frame_end = 1, len(pictures)
        if hasattr(render.image_settings, "media_type"):  # Blender 5
            render.image_settings.media_type = "VIDEO"
        render.image_settings.file_format = "FFMPEG"
        render.ffmpeg.format, render.ffmpeg.codec = "MPEG4", "H264"
        render.ffmpeg.constant_rate_factor = "HIGH"
        render.use_file_extension = False
        with whole_file(path) as temporary, silenced(), held_signals():
            render.filepath = str(temporary)
            bpy.ops.render.render(animation=True, scene=scene.name)
    finally:
        bpy.data.scenes.remove(scene)
