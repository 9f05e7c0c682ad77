"""Overlay layers of points, lines and faces, with cached geometry.

Everything belongs to a scene and shows in that one's views alone. Blender's
draw handlers are there while there is something to draw, and no longer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import bpy
import numpy as np
from numpy.typing import NDArray

from .legend import Block, Colour, draw_legend

Kind = Literal["POINTS", "LINES", "TRIS"]

POINT_SIZE = 2.0
"""Pixels, at the interface's usual scale."""


@dataclass
class Layer:
    """Primitives of one kind.

    Parameters
    ----------
    kind : {"POINTS", "LINES", "TRIS"}
    positions : (n, 3) float32, metres
        One, two or three for each.
    colours : (n, 4) float32, or one colour for all
        sRGB and opacity.
    """

    kind: Kind
    positions: NDArray[np.float32]
    colours: NDArray[np.float32] | Colour
    _batch: Any = field(default=None, repr=False)

    def draw(self, scale: float) -> None:
        """Draw it into the framebuffer that is bound."""
        import gpu  # noqa: PLC0415  # is not there in the background
        from gpu_extras.batch import batch_for_shader  # noqa: PLC0415  # as above

        single = isinstance(self.colours, tuple)
        prefix = "POINT_" if self.kind == "POINTS" else ""
        shader = gpu.shader.from_builtin(f"{prefix}{'UNIFORM' if single else 'FLAT'}_COLOR")
        if self._batch is None:
            content = {"pos": self.positions} if single else {"pos": self.positions, "color": self.colours}
            self._batch = batch_for_shader(shader, self.kind, content)
        shader.bind()
        if single:
            shader.uniform_float("color", self.colours)
        if self.kind == "POINTS":
            shader.uniform_float("size", POINT_SIZE * scale)
        self._batch.draw(shader)


@dataclass(frozen=True)
class Overlay:
    """Layers that mean something together.

    Parameters
    ----------
    legend : callable
        From the scene to the block that explains the layers; called as the view is drawn, so it only reads.
    about : str
        What the panel calls it: a sensor's label.
    """

    layers: Sequence[Layer]
    legend: Callable[[bpy.types.Scene], Block | None]
    about: str = ""


_shown: dict[int, dict[str, Overlay]] = {}
"""By the scene's session number, and by what they are called."""

_handles: list[Any] = []


def show(scene: bpy.types.Scene, name: str, overlay: Overlay) -> None:
    """Draw an overlay in a scene's views, in place of that of the same name."""
    _shown.setdefault(scene.session_uid, {})[name] = overlay
    _keep_handlers()


def hide(scene: bpy.types.Scene, name: str) -> None:
    """Draw an overlay no longer."""
    _shown.get(scene.session_uid, {}).pop(name, None)
    _keep_handlers()


def find(scene: bpy.types.Scene, name: str) -> Overlay | None:
    """Return an overlay of a scene, None where there is none of that name."""
    return _shown.get(scene.session_uid, {}).get(name)


def clear() -> None:
    """Draw nothing any more, in any scene."""
    _shown.clear()
    _keep_handlers()


def overlays(scene: bpy.types.Scene) -> list[Overlay]:
    """Return what is drawn in a scene's views, in the order of the names."""
    own = _shown.get(scene.session_uid, {})
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
    for number in [number for number, own in _shown.items() if not own or number not in existing]:
        del _shown[number]
    if _shown and not _handles:
        for draw, moment in ((_draw_view, "POST_VIEW"), (_draw_pixels, "POST_PIXEL")):
            _handles.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", moment))
    if not _shown:
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


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _before_load(*_: object) -> None:
    clear()


CLASSES: tuple[type, ...] = ()


def attach() -> None:
    """Let go of everything whenever another file is opened."""
    bpy.app.handlers.load_pre.append(_before_load)


def detach() -> None:
    """Let go of everything."""
    bpy.app.handlers.load_pre.remove(_before_load)
    clear()
