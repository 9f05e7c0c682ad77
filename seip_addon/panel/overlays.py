"""Overlays of each scene: points and lines that are shown, hidden and found by name, with a legend, over its viewports.

Blender's draw handlers are registered only while there is an overlay. `tests/addon/test_view.py` shows its use.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Literal

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from numpy.typing import NDArray

from .legend import Block, Colour, Label, draw_labels, draw_legend, free_frame

TAB = "SEIP"
DRAWN = 0.5
"""Seconds after which a sidebar that was opened has been drawn."""


Kind = Literal["POINTS", "LINES", "TRIS"]


@dataclass
class Layer:
    """Primitives of one kind.

    Parameters
    ----------
    kind : {"POINTS", "LINES", "TRIS"}
    positions : (n, 3) float32, metres
        One, two or three for each.
    colours : (n, 4) float32, or one colour for all
        sRGB and opacity; lines have one.
    size : float, pixels at the interface's usual scale
        Size of points, and width of lines.
    """

    kind: Kind
    positions: NDArray[np.float32]
    colours: NDArray[np.float32] | Colour
    size: float = 1.0
    _batch: Any = field(default=None, repr=False)

    def draw(self, scale: float) -> None:
        """Draw it into the framebuffer that is bound."""
        single = isinstance(self.colours, tuple)
        prefix = {"POINTS": "POINT_", "LINES": "POLYLINE_", "TRIS": ""}[self.kind]
        shader = gpu.shader.from_builtin(f"{prefix}{'UNIFORM' if single else 'FLAT'}_COLOR")
        if self._batch is None:
            content = {"pos": self.positions} if single else {"pos": self.positions, "color": self.colours}
            self._batch = batch_for_shader(shader, self.kind, content)
        shader.bind()
        if single:
            shader.uniform_float("color", self.colours)
        if self.kind == "POINTS":
            shader.uniform_float("size", self.size * scale)
        elif self.kind == "LINES":
            shader.uniform_float("lineWidth", self.size * scale)
            shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
        self._batch.draw(shader)


@dataclass(frozen=True)
class Overlay:
    """Layers that mean something together.

    Parameters
    ----------
    legend : callable
        From the scene to the block that explains the layers; called as the view is drawn, so it only reads.
    labels : callable
        From the scene to the labels that belong to it; called as the view is drawn.
    moving : callable
        To layers that follow the scene; called as the view is drawn.
    """

    layers: Sequence[Layer]
    legend: Callable[[bpy.types.Scene], Block | None]
    labels: Callable[[bpy.types.Scene], Sequence[Label]] = lambda _scene: ()
    moving: Callable[[], Sequence[Layer]] = tuple


_handles: list[Any] = []
_shown: dict[int, dict[str, Overlay]] = {}
"""Overlays by name, of each scene by its session number."""


def show(scene: bpy.types.Scene, name: str, overlay: Overlay) -> None:
    """Show an overlay in a scene's viewports, replacing any of the same name."""
    _shown.setdefault(scene.session_uid, {})[name] = overlay
    _update_handlers()


def hide(scene: bpy.types.Scene, name: str) -> None:
    """Remove an overlay from a scene's viewports, if it is there."""
    _shown.get(scene.session_uid, {}).pop(name, None)
    _update_handlers()


def find(scene: bpy.types.Scene, name: str) -> Overlay | None:
    """Return a scene's overlay with a name, or None."""
    return _shown.get(scene.session_uid, {}).get(name)


def overlays_of(scene: bpy.types.Scene) -> list[Overlay]:
    """Return a scene's overlays, sorted by name."""
    own = _shown.get(scene.session_uid, {})
    return [own[name] for name in sorted(own)]


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
    for uid in [uid for uid, own in _shown.items() if not own or uid not in existing]:
        del _shown[uid]
    if _shown and not _handles:
        for draw, event in ((_draw_layers, "POST_VIEW"), (_draw_words, "POST_PIXEL")):
            _handles.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", event))
    if not _shown:
        while _handles:
            bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")
    redraw()


def legend_blocks(scene: bpy.types.Scene) -> list[Block]:
    """Return the legend of all overlays of a scene."""
    return [block for overlay in overlays_of(scene) if (block := overlay.legend(scene)) is not None]


def labels_of(scene: bpy.types.Scene) -> list[Label]:
    """Return the labels of all overlays of a scene."""
    return [label for overlay in overlays_of(scene) for label in overlay.labels(scene)]


def _draw_layers() -> None:
    """Draw the overlays of the scene, with depth test."""
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.blend_set("ALPHA")
    for overlay in overlays_of(bpy.context.scene):
        for layer in (*overlay.layers, *overlay.moving()):
            layer.draw(bpy.context.preferences.system.ui_scale)
    gpu.state.blend_set("NONE")
    gpu.state.depth_test_set("NONE")


def _draw_words() -> None:
    """Draw the legend of the scene's overlays and the labels, which keep off it."""
    context, scale = bpy.context, bpy.context.preferences.system.ui_scale
    frame, blocks = free_frame(context.area, context.region), legend_blocks(context.scene)
    taken = [draw_legend(blocks, frame, scale)] if blocks else []
    draw_labels(labels_of(context.scene), context, frame, taken, scale)


def forget() -> None:
    """Remove the overlays of all scenes, and wait for no sidebar."""
    _shown.clear()
    _update_handlers()
    if bpy.app.timers.is_registered(_bring_forward):
        bpy.app.timers.unregister(_bring_forward)
