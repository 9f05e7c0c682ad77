"""The legend in the lower right corner of a viewport: what is drawn there, and in which colours."""

from collections.abc import Sequence
from itertools import pairwise

import blf
import gpu
from gpu_extras.batch import batch_for_shader

from ..state.overlay import Block, Colour, Entry
from .free_frame import Box

TEXT_SIZE, LINE, SWATCH, GAP, MARGIN = 12.0, 20.0, 22.0, 8.0, 14.0  # pixels at the interface's usual scale
LEAST_SCALE = 0.6
"""Scale below which letters could not be read; a legend that has no room even so is cut."""
PAPER: Colour = (0.06, 0.08, 0.10, 0.82)
INK: Colour = (0.95, 0.96, 0.97, 1.0)
EDGE: Colour = (0.55, 0.58, 0.62, 1.0)
FONT = 0


def placed_legend(blocks: Sequence[Block], frame: Box, scale: float, gizmos: Sequence[Box] = ()) -> tuple[Box, float]:
    """Return the box of the legend in the lower right corner of a frame, and the scale at which it fits there.

    It is below the gizmos where it has room, otherwise beside as many of them as leaves it largest.

    Parameters
    ----------
    frame : (left, bottom, right, top), pixels
        Part of a viewport that nothing covers.
    scale : float
        Scale of the interface, and of the legend where there is room.
    gizmos : sequence of Box
        Boxes in the upper right corner that the legend keeps off, the widest first and each lower than the one before.
    """
    left, bottom, right, top = frame
    rights = [right, *(box[0] for box in reversed(gizmos))]
    tops = [*(box[1] for box in reversed(gizmos)), top]
    frames = [(left, bottom, max(left, x), max(bottom, y)) for x, y in zip(rights, tops, strict=True)]
    return max((_placed(blocks, one, scale) for one in frames), key=lambda placed: placed[1])


def _placed(blocks: Sequence[Block], frame: Box, scale: float) -> tuple[Box, float]:
    """Return the box of the legend in the lower right corner of a frame, and the scale at which it fits there."""
    left, bottom, right, top = frame
    wide, tall = _size(blocks, scale)
    room = max(right - left - 2 * MARGIN * scale, 1.0), max(top - bottom - 2 * MARGIN * scale, 1.0)
    share = min(1.0, room[0] / wide, room[1] / tall)
    if share < 1.0:
        scale *= max(share, LEAST_SCALE / scale)
        wide, tall = _size(blocks, scale)
    x, y = right - MARGIN * scale, bottom + MARGIN * scale
    return (x - wide, y, x, y + tall), scale


def draw_legend(blocks: Sequence[Block], box: Box, scale: float) -> None:
    """Draw the legend into its box, see `placed_legend`."""
    left, bottom, right, top = box
    blf.size(FONT, TEXT_SIZE * scale)
    fill(left, bottom, right - left, top - bottom, (PAPER, PAPER))
    x, y = left + GAP * scale, top - GAP * scale
    for block in blocks:
        y -= LINE * scale
        write(block.title, x, y, scale)
        for entry in block.entries:
            y -= LINE * scale
            _draw_entry(entry, x, y, scale)
        y -= GAP * scale


def _size(blocks: Sequence[Block], scale: float) -> tuple[float, float]:
    """Return width and height of the legend, pixels."""
    blf.size(FONT, TEXT_SIZE * scale)
    wide = max(_width(block) for block in blocks) + 2 * GAP * scale + (SWATCH + GAP) * scale
    lines = sum(1 + len(block.entries) for block in blocks)
    return wide, (lines * LINE + (len(blocks) + 1) * GAP) * scale


def _width(block: Block) -> float:
    return float(max(blf.dimensions(FONT, words)[0] for words in (block.title, *(e.words for e in block.entries))))


def _draw_entry(entry: Entry, x: float, y: float, scale: float) -> None:
    fill(x - scale, y + scale, (SWATCH + 2) * scale, 13 * scale, (EDGE, EDGE))
    ends = entry.colours if len(entry.colours) > 1 else entry.colours * 2
    part = SWATCH * scale / (len(ends) - 1)
    for number, pair in enumerate(pairwise(ends)):
        fill(x + number * part, y + 2 * scale, part, 11 * scale, pair)
    write(entry.words, x + (SWATCH + GAP) * scale, y, scale)


def write(words: str, x: float, y: float, scale: float) -> None:
    """Write words from their lower left corner."""
    blf.position(FONT, x, y + 3 * scale, 0)
    blf.color(FONT, *INK)
    blf.draw(FONT, words)


def fill(x: float, y: float, width: float, height: float, colours: tuple[Colour, ...]) -> None:
    """Fill a rectangle with a colour on the left that runs into one on the right."""
    left, right = colours
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    corners = [(x, y, 0), (x + width, y, 0), (x, y + height, 0), (x + width, y + height, 0)]
    batch = batch_for_shader(shader, "TRI_STRIP", {"pos": corners, "color": [left, right, left, right]})
    gpu.state.blend_set("ALPHA")
    batch.draw(shader)
    gpu.state.blend_set("NONE")
