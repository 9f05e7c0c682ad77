"""The legend in the lower right corner of a viewport: what is drawn there, and in which colours."""

from collections.abc import Sequence
from itertools import pairwise

import blf
import bpy
import gpu
from gpu_extras.batch import batch_for_shader

from ..overlay import Block, Colour, Entry

TEXT_SIZE, LINE, SWATCH, GAP, MARGIN = 12.0, 20.0, 22.0, 8.0, 14.0  # pixels at the interface's usual scale
PAPER: Colour = (0.06, 0.08, 0.10, 0.82)
INK: Colour = (0.95, 0.96, 0.97, 1.0)
EDGE: Colour = (0.55, 0.58, 0.62, 1.0)
FONT = 0


def draw_legend(blocks: Sequence[Block], region: bpy.types.Region, area: bpy.types.Area, scale: float) -> None:
    """Draw the legend into a viewport, beside its sidebar.

    Parameters
    ----------
    region : bpy.types.Region
        The viewport's window.
    scale : float
        Scale of the interface.
    """
    overlaps = bpy.context.preferences.system.use_region_overlap
    beside = next((other.width for other in area.regions if other.type == "UI" and overlaps and other.width > 1), 0)
    draw_legend_at(blocks, region.width - beside - MARGIN * scale, MARGIN * scale, scale)


def draw_legend_at(blocks: Sequence[Block], right: float, bottom: float, scale: float) -> None:
    """Draw the legend with its lower right corner at a place in pixels."""
    if not blocks:
        return
    blf.size(FONT, TEXT_SIZE * scale)
    wide = max(_width(block) for block in blocks) + 2 * GAP * scale + (SWATCH + GAP) * scale
    lines = sum(1 + len(block.entries) for block in blocks)
    tall = (lines * LINE + (len(blocks) + 1) * GAP) * scale
    fill(right - wide, bottom, wide, tall, (PAPER, PAPER))
    x, y = right - wide + GAP * scale, bottom + tall - GAP * scale
    for block in blocks:
        y -= LINE * scale
        write(block.title, x, y, scale)
        for entry in block.entries:
            y -= LINE * scale
            _draw_entry(entry, x, y, scale)
        y -= GAP * scale


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
