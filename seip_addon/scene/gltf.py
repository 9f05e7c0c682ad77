"""The scene with its sensors and coverage as binary glTF, through Blender's own exporter."""

from __future__ import annotations

import contextlib
import io
import logging
from collections.abc import Sequence
from pathlib import Path

import addon_utils
import bpy

from .interrupts import held_signals

EXPORTER = "io_scene_gltf2"
LOG = logging.getLogger(__name__)


def save_glb(path: Path, attribution: Sequence[str]) -> None:
    """Write what renders of the open scene show, its sensors and coverage among it; a Blender without exporter says so.

    Lengths are metres; glTF's y axis is up. Custom properties are kept as extras.

    Parameters
    ----------
    attribution : sequence of str
        Credits of the scene's sources: the asset's copyright.
    """
    try:
        if "gltf" not in dir(bpy.ops.export_scene):
            addon_utils.enable(EXPORTER)
        with held_signals(), contextlib.redirect_stdout(io.StringIO()):  # where it tells of every mesh
            bpy.ops.export_scene.gltf(
                filepath=str(path),
                export_format="GLB",
                use_active_scene=True,
                use_renderable=True,
                export_apply=True,
                export_extras=True,
                export_animations=False,
                export_cameras=False,
                export_lights=False,
                export_copyright="; ".join(attribution),
            )
    except (RuntimeError, AttributeError, TypeError) as error:  # it is missing, or of another version
        LOG.warning("%s is not written: Blender's glTF exporter failed (%s)", path.name, error)
        path.unlink(missing_ok=True)
