"""Sight lines and shadows of one sensor."""

import numpy as np

from ..core.pictures.palette import INK, rgb
from ..core.visibility.sight_lines import SightLines
from ..overlay import Block, Colour, Entry, Layer, Overlay
from ..scene.write import LIFT

NAME = "sight lines"
LINE_COLOUR: Colour = (1.0, 0.85, 0.25, 0.30)
SHADOW_COLOUR: Colour = (*rgb(INK), 0.80)
ABOVE = LIFT + 0.02  # metres of the shadows over the road: on the coverage, not in it


def sight_overlay(sight: SightLines, label: str) -> Overlay:
    """Return the lines from a sensor to the targets that it sees, and squares on those that it does not."""
    ends = sight.ends + np.array((0.0, 0.0, ABOVE))
    lines = np.stack([np.broadcast_to(sight.eye, ends.shape), ends], axis=1).reshape(-1, 3)
    squares = sight.shadows + np.array((0.0, 0.0, ABOVE))
    faces = squares[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    layers = (
        Layer("TRIS", faces.astype(np.float32), SHADOW_COLOUR),
        Layer("LINES", lines.astype(np.float32), LINE_COLOUR),
    )
    drawn = "" if len(sight.ends) == sight.seen else f", {len(sight.ends):,} of them drawn"
    block = Block(
        f"{label}: {sight.in_range:,} targets in its range",
        (
            Entry(f"{sight.seen:,} seen{drawn}", ((*LINE_COLOUR[:3], 1.0),)),
            Entry(f"{sight.in_range - sight.seen:,} in its shadows", ((*SHADOW_COLOUR[:3], 1.0),)),
        ),
    )
    return Overlay(layers, lambda _scene: block, label)
