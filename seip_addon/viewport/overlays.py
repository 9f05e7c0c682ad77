"""Overlays of each scene: shown, hidden and found by name, and drawn in the scene's viewports.

Blender's draw handlers are registered only while there is an overlay. `tests/addon/test_view.py` shows its use.
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any

import bpy
import gpu
from mathutils import Matrix

from ..state.overlay import Block, Label, Overlay
from ..state.session import session
from .free_frame import Box, free_frame, navigation_boxes
from .labels import draw_labels
from .legend import draw_legend, placed_legend

TAB = "SEIP"
DRAWN = 0.5
"""Seconds after which a sidebar that was opened has been drawn."""
_handles: list[Any] = []


def show(scene: bpy.types.Scene, name: str, overlay: Overlay) -> None:
    """Show an overlay in a scene's viewports, replacing any of the same name."""
    session.overlays.setdefault(scene.session_uid, {})[name] = overlay
    _update_handlers()


def hide(scene: bpy.types.Scene, name: str) -> None:
    """Remove an overlay from a scene's viewports, if it is there."""
    session.overlays.get(scene.session_uid, {}).pop(name, None)
    _update_handlers()


def find(scene: bpy.types.Scene, name: str) -> Overlay | None:
    """Return a scene's overlay with a name, or None."""
    return session.overlays.get(scene.session_uid, {}).get(name)


def overlays_of(scene: bpy.types.Scene) -> list[Overlay]:
    """Return a scene's overlays, sorted by name."""
    own = session.overlays.get(scene.session_uid, {})
    return [own[name] for name in sorted(own)]


def draw_overlays(scene: bpy.types.Scene) -> None:
    """Draw a scene's overlays into the bound framebuffer, with depth test."""
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.blend_set("ALPHA")
    for overlay in overlays_of(scene):
        for layer in (*overlay.layers, *overlay.moving()):
            layer.draw(bpy.context.preferences.system.ui_scale)
    gpu.state.blend_set("NONE")
    gpu.state.depth_test_set("NONE")


def viewports(windows: Iterable[bpy.types.Window]) -> list[bpy.types.Area]:
    """Return the 3D viewports of windows."""
    areas = (area for window in windows for area in window.screen.areas)
    return [area for area in areas if area.type == "VIEW_3D"]


def redraw() -> None:
    """Redraw all viewports with their sidebars."""
    for area in viewports(bpy.context.window_manager.windows):
        area.tag_redraw()


def open_sidebar(window: bpy.types.Window) -> None:
    """Open the sidebar of a window's 3D views, with this add-on's tab in front."""
    for area in viewports([window]):
        area.spaces.active.show_region_ui = True
    if not bpy.app.background and not bpy.app.timers.is_registered(_bring_forward):
        bpy.app.timers.register(_bring_forward, first_interval=DRAWN)


def _bring_forward() -> None:
    """Put the tab in front: it is there once the sidebar has been drawn."""
    for region in (region for area in viewports(bpy.context.window_manager.windows) for region in area.regions):
        if region.type == "UI" and region.width > 1:
            with suppress(TypeError):  # the tab has not been drawn
                region.active_panel_category = TAB
                region.tag_redraw()


def _update_handlers() -> None:
    """Forget scenes without overlays and deleted ones, and register or remove the draw handlers as needed."""
    existing = {scene.session_uid for scene in bpy.data.scenes}
    for uid in [uid for uid, own in session.overlays.items() if not own or uid not in existing]:
        del session.overlays[uid]
    if session.overlays and not _handles:
        for draw, event in ((_draw_view, "POST_VIEW"), (_draw_pixels, "POST_PIXEL")):
            _handles.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", event))
    if not session.overlays:
        while _handles:
            bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")
    redraw()


def legend_blocks(scene: bpy.types.Scene) -> list[Block]:
    """Return the legend of all overlays of a scene."""
    return [block for overlay in overlays_of(scene) if (block := overlay.legend(scene)) is not None]


def labels_of(scene: bpy.types.Scene) -> list[Label]:
    """Return the labels of all overlays of a scene."""
    return [label for overlay in overlays_of(scene) for label in overlay.labels(scene)]


def _draw_view() -> None:
    draw_overlays(bpy.context.scene)


def _draw_pixels() -> None:
    context = bpy.context
    region, scale = context.region, context.preferences.system.ui_scale
    size = (region.width, region.height)
    frame = free_frame(context.area, region)
    gizmos = navigation_boxes(context.space_data, frame, scale)
    draw_words(context.scene, context.region_data.perspective_matrix, size, frame, scale, gizmos)


def draw_words(  # where words may be is of several kinds
    scene: bpy.types.Scene,
    to_view: Matrix,
    size: tuple[int, int],
    frame: Box,
    scale: float,
    gizmos: Sequence[Box] = (),
) -> None:
    """Draw the legend of a scene's overlays and the labels, which keep off it.

    Parameters
    ----------
    to_view : (4, 4) Matrix
        See `draw_labels`.
    size : (width, height), pixels
    frame : (left, bottom, right, top), pixels
        Part of the viewport that nothing covers.
    scale : float
        Scale of the interface.
    gizmos : sequence of Box
        Boxes that the legend keeps off, see `placed_legend`.
    """
    blocks, taken = legend_blocks(scene), []
    if blocks:
        box, legend_scale = placed_legend(blocks, frame, scale, gizmos)
        draw_legend(blocks, box, legend_scale)
        taken.append(box)
    draw_labels(labels_of(scene), to_view, size, frame, taken, scale)


def forget() -> None:
    """Remove the overlays of all scenes, and wait for no sidebar."""
    session.overlays.clear()
    _update_handlers()
    if bpy.app.timers.is_registered(_bring_forward):
        bpy.app.timers.unregister(_bring_forward)
