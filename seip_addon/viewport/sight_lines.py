"""Sight lines of one sensor, and the road in its range that it does not see."""

import numpy as np
from numpy.typing import NDArray

from ..core.base.arrays import Float
from ..core.output.pictures.palette import HIDDEN_COLOUR, MISSED_COLOUR, SIGHT_LINE, rgb
from ..core.sensing.visibility.sight_lines import SightLines
from ..scene.write import LIFT
from ..state.overlay import Block, Colour, Entry, Layer, Overlay

NAME = "sight lines"
LINES: Colour = (*rgb(SIGHT_LINE), 0.30)
HIDDEN: Colour = (*rgb(HIDDEN_COLOUR), 0.80)
MISSED: Colour = (*rgb(MISSED_COLOUR), 0.80)
ABOVE = LIFT + 0.02  # metres of the squares over the road: on the coverage, not in it


def sight_overlay(sight: SightLines, label: str) -> Overlay:
    """Return the lines from a sensor to the targets that it sees, and squares on those that it does not."""
    ends = sight.ends + np.array((0.0, 0.0, ABOVE))
    lines = np.stack([np.broadcast_to(sight.eye, ends.shape), ends], axis=1).reshape(-1, 3)
    layers = (
        Layer("TRIS", _faces(sight.hidden), HIDDEN),
        Layer("TRIS", _faces(sight.missed), MISSED),
        Layer("LINES", lines.astype(np.float32), LINES),
    )
    drawn = "" if len(sight.ends) == sight.seen else f", {len(sight.ends):,} of them drawn"
    block = Block(
        f"{label}: {sight.in_range:,} targets in its range",
        (
            Entry(f"{sight.seen:,} seen{drawn}", (_opaque(LINES),)),
            Entry(f"{len(sight.hidden):,} hidden by something", (_opaque(HIDDEN),)),
            Entry(f"{len(sight.missed):,} in view, but between beams or too faint", (_opaque(MISSED),)),
        ),
    )
    return Overlay(layers, lambda _scene: block)


def _faces(squares: Float) -> NDArray[np.float32]:
    """Return the two triangles of each square, (6 m, 3), above the road."""
    corners = (squares + np.array((0.0, 0.0, ABOVE))).astype(np.float32)
    faces: NDArray[np.float32] = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return faces


def _opaque(colour: Colour) -> Colour:
    return (*colour[:3], 1.0)
