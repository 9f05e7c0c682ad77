"""Opening and saving .blend files, and saving glTF.

`tests/scene/test_blend_file.py` shows its use.
"""

from __future__ import annotations

import contextlib
import io
import logging
from collections.abc import Sequence
from pathlib import Path

import addon_utils
import bpy

from ..core.base.errors import SeipError
from ..core.storage.files import whole_file
from .interrupts import held_signals
from .views import set_up_view

GLTF_EXPORTER = "io_scene_gltf2"
LOG = logging.getLogger(__name__)


def new_file() -> bpy.types.Scene:
    """Make a new file, in place of the open one, and return its only scene, which is empty."""
    with held_signals():
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return bpy.context.scene


def open_blend(path: Path) -> None:
    """Open a .blend, without running scripts that it may carry.

    Raises
    ------
    SeipError
        There is no such file, it is not a .blend, or it is damaged.
    """
    if not path.is_file():
        raise SeipError(f"there is no file {path}; build one with seip build-scene or check the name")
    try:
        with held_signals():
            bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        raise SeipError(
            f"{path} is not a .blend that Blender {bpy.app.version_string} can open; build a scene from a map with "
            "seip build-scene"
        ) from error
    require_readable_names()


def require_readable_names() -> None:
    """Check that the names in the open file that are used can be read.

    Blender opens damaged files whose names are not UTF-8.

    Raises
    ------
    SeipError
        Some name cannot be read.
    """
    data = bpy.data
    for kind in ("scenes", "collections", "objects", "meshes", "materials"):
        try:
            for block in getattr(data, kind):
                _ = block.name
        except UnicodeDecodeError as error:
            raise SeipError(
                f"the .blend is damaged: among its {kind} is a name that is not UTF-8; take an earlier copy of the file"
            ) from error


def check_name(path: Path) -> None:
    """Raise SeipError where a name does not end in .blend."""
    if path.suffix != ".blend":
        raise SeipError(f"{path} does not end in .blend; choose a name that does")


def save_blend(path: Path) -> None:
    """Write the open scene to a .blend, compressed.

    Saved in the background, its 3D views look through the camera, in the materials' colours.

    Raises
    ------
    SeipError
        The name does not end in .blend, or the file cannot be written.
    """
    check_name(path)
    if bpy.app.background:  # else the views are those that somebody is looking through
        _set_up_views()
    with whole_file(path) as temporary:
        temporary.unlink()  # Blender would keep a file that is there as a backup of another name
        cure = "make room there or choose another folder"
        try:
            with held_signals():
                bpy.ops.wm.save_as_mainfile(
                    filepath=str(temporary.resolve()), copy=True, compress=True, check_existing=False
                )
        except RuntimeError as error:
            reason = str(error).strip().removeprefix("Error: ")
            raise SeipError(f"cannot write {path} ({reason}); {cure}") from error
        finally:
            Path(f"{temporary}@").unlink(missing_ok=True)  # Blender writes there first, and leaves it if it fails
        if not _is_whole(temporary):
            raise SeipError(f"cannot write {path} to its end; {cure}")


def _is_whole(path: Path) -> bool:
    """Return whether a .blend can be read: a full disk cuts one short without a word from Blender."""
    try:
        with bpy.data.libraries.load(str(path.resolve())) as (there, _):
            return len(there.scenes) > 0
    except OSError:
        return False


def _set_up_views() -> None:
    views = (area.spaces.active for screen in bpy.data.screens for area in screen.areas if area.type == "VIEW_3D")
    for view in views:
        set_up_view(view)
        if bpy.context.scene.camera is not None:
            view.region_3d.view_perspective = "CAMERA"


def save_glb(path: Path, attribution: Sequence[str]) -> None:
    """Write what renders of the open scene show as binary glTF; a Blender without exporter says so.

    Lengths are metres; glTF's y axis is up. Custom properties are kept as extras.

    Parameters
    ----------
    attribution : sequence of str
        Credits of the scene's sources: the asset's copyright.
    """
    try:
        if "gltf" not in dir(bpy.ops.export_scene):
            addon_utils.enable(GLTF_EXPORTER)
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
