"""Drawing of overlays: show and hide them by scene and name.

Everything belongs to a scene and shows in that one's views alone. Blender's
draw handlers are there while there is something to draw, and no longer.
"""

from __future__ import annotations

from typing import Any

import bpy

from ..overlay import Block, Overlay
from ..session import session
from .legend import draw_legend

_handles: list[Any] = []


def show(scene: bpy.types.Scene, name: str, overlay: Overlay) -> None:
    """Draw an overlay in a scene's views, in place of that of the same name."""
    session.overlays.setdefault(scene.session_uid, {})[name] = overlay
    _keep_handlers()


def hide(scene: bpy.types.Scene, name: str) -> None:
    """Draw an overlay no longer."""
    session.overlays.get(scene.session_uid, {}).pop(name, None)
    _keep_handlers()


def find(scene: bpy.types.Scene, name: str) -> Overlay | None:
    """Return an overlay of a scene, None where there is none of that name."""
    return session.overlays.get(scene.session_uid, {}).get(name)


def overlays(scene: bpy.types.Scene) -> list[Overlay]:
    """Return what is drawn in a scene's views, in the order of the names."""
    own = session.overlays.get(scene.session_uid, {})
    return [own[name] for name in sorted(own)]


def drawing() -> int:
    """Return how many draw handlers there are."""
    return len(_handles)


def draw_layers(scene: bpy.types.Scene) -> None:
    """Draw a scene's overlays into the framebuffer that is bound, behind what stands before them."""
    import gpu  # noqa: PLC0415  # is not there in the background

    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.blend_set("ALPHA")
    for overlay in overlays(scene):
        for layer in overlay.layers:
            layer.draw(bpy.context.preferences.system.ui_scale)
    gpu.state.blend_set("NONE")
    gpu.state.depth_test_set("NONE")


def redraw() -> None:
    """Have all viewports drawn anew, with their sidebars."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def _keep_handlers() -> None:
    """Have handlers while there is something to draw."""
    existing = {scene.session_uid for scene in bpy.data.scenes}
    for number in [number for number, own in session.overlays.items() if not own or number not in existing]:
        del session.overlays[number]
    if session.overlays and not _handles:
        for draw, moment in ((_draw_view, "POST_VIEW"), (_draw_pixels, "POST_PIXEL")):
            _handles.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", moment))
    if not session.overlays:
        while _handles:
            bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")
    redraw()


def legend_blocks(scene: bpy.types.Scene) -> list[Block]:
    """Return what explains all that is drawn in a scene's views."""
    return [block for overlay in overlays(scene) if (block := overlay.legend(scene)) is not None]


def _draw_view() -> None:
    draw_layers(bpy.context.scene)


def _draw_pixels() -> None:
    context = bpy.context
    draw_legend(legend_blocks(context.scene), context.region, context.area, context.preferences.system.ui_scale)


CLASSES: tuple[type, ...] = ()


def forget() -> None:
    """Draw nothing any more, in any scene."""
    session.overlays.clear()
    _keep_handlers()
