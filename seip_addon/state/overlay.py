"""Overlays: points, lines and faces drawn over a viewport, with the legend that explains them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from numpy.typing import NDArray

Colour = tuple[float, float, float, float]

Label = tuple[str, tuple[float, ...]]
"""Words, and the place (3,) in metres above which they stand."""

Kind = Literal["POINTS", "LINES", "TRIS"]


@dataclass(frozen=True)
class Entry:
    """A line of a legend: words beside a swatch of one colour, or of several that run into one another."""

    words: str
    colours: tuple[Colour, ...]


@dataclass(frozen=True)
class Block:
    """A part of a legend."""

    title: str
    entries: tuple[Entry, ...]


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
        Of points, and the width of lines.
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
