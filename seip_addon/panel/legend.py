"""Words over a viewport: the legend in its lower right corner, and labels of what stands in the scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import blf
import bpy
import gpu
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader

from ..core.output.pictures.labels import stack_upwards

Colour = tuple[float, float, float, float]
Box = tuple[float, float, float, float]
"""Left, bottom, right and top, pixels."""
Label = tuple[str, tuple[float, ...]]
"""Words, and the place (3,) in metres above which they stand."""
TEXT_SIZE, LINE, SWATCH, GAP, MARGIN = 12.0, 20.0, 22.0, 8.0, 14.0  # pixels at the interface's usual scale
LEAST_SCALE = 0.6
"""Scale below which letters could not be read; a legend that has no room even so is cut."""
PAPER: Colour = (0.06, 0.08, 0.10, 0.82)
INK: Colour = (0.95, 0.96, 0.97, 1.0)
EDGE: Colour = (0.55, 0.58, 0.62, 1.0)
FONT = 0
RISE, PAD, TALL, LABEL_GAP = 16.0, 5.0, 18.0, 2.0
"""Pixels at the interface's usual scale: above the sensor, beside the letters, of the letters, between labels."""


@dataclass(frozen=True)
class Entry:
    """A line of a legend: words beside an opaque swatch of one colour, or of several that run into one another."""

    words: str
    colours: tuple[Sequence[float], ...]


@dataclass(frozen=True)
class Block:
    """A part of a legend."""

    title: str
    entries: tuple[Entry, ...]


def free_frame(area: bpy.types.Area, region: bpy.types.Region) -> Box:
    """Return the part of a viewport's window that no header, toolbar or sidebar covers, in pixels of that window."""
    left, bottom, right, top = 0, 0, region.width, region.height
    for one in area.regions:
        x, y = one.x - region.x, one.y - region.y
        is_over = -one.width < x < region.width and -one.height < y < region.height
        if one == region or min(one.width, one.height) <= 1 or not is_over:
            continue
        if one.alignment == "LEFT":
            left = max(left, x + one.width)
        elif one.alignment == "RIGHT":
            right = min(right, x)
        elif one.alignment == "TOP":
            top = min(top, y)
        elif one.alignment == "BOTTOM":
            bottom = max(bottom, y + one.height)
    return left, bottom, max(left, right), max(bottom, top)


def draw_legend(blocks: Sequence[Block], frame: Box, scale: float) -> Box:
    """Draw the legend in the lower right corner of a frame, smaller where it has no room there; return its box.

    Parameters
    ----------
    frame : (left, bottom, right, top), pixels
        Part of a viewport that nothing covers.
    scale : float
        Scale of the interface, and of the legend where there is room.
    """
    wide, tall = _size(blocks, scale)
    room = frame[2] - frame[0] - 2 * MARGIN * scale, frame[3] - frame[1] - 2 * MARGIN * scale
    share = min(1.0, room[0] / wide, room[1] / tall)
    if share < 1.0:
        scale = max(share * scale, LEAST_SCALE)
        wide, tall = _size(blocks, scale)
    right, bottom = frame[2] - MARGIN * scale, frame[1] + MARGIN * scale
    left, top = right - wide, bottom + tall
    fill(left, bottom, wide, tall, (PAPER, PAPER))
    x, y = left + GAP * scale, top - GAP * scale
    for block in blocks:
        y -= LINE * scale
        write(block.title, x, y, scale)
        for entry in block.entries:
            y -= LINE * scale
            _draw_entry(entry, x, y, scale)
        y -= GAP * scale
    return left, bottom, right, top


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
    ends: list[Colour] = [(red, green, blue, 1.0) for red, green, blue, *_ in entry.colours]
    ends = ends if len(ends) > 1 else ends * 2
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


def draw_labels(
    labels: Sequence[Label], context: bpy.types.Context, frame: Box, taken: Sequence[Box], scale: float
) -> None:
    """Draw labels above what they name, with a line to it, and no label over another.

    Parameters
    ----------
    context : bpy.types.Context
        Context of the viewport that is drawn.
    frame : (left, bottom, right, top), pixels
        Part of the viewport that nothing covers; labels of what is in it are in its width.
    taken : sequence of Box
        Boxes in the frame over which no label may be.
    scale : float
        Scale of the interface.
    """
    blf.size(FONT, TEXT_SIZE * scale)
    shown, own = [], []
    for words, place in labels:
        at = location_3d_to_region_2d(context.region, context.region_data, place)
        if at is None:
            continue  # behind the eye
        wide = blf.dimensions(FONT, words)[0] + 2 * PAD * scale
        left = at.x - wide / 2.0
        if frame[0] <= at.x <= frame[2]:
            left = max(min(left, frame[2] - wide), frame[0])
        shown.append((words, at))
        own.append((left, at.y + RISE * scale, wide, TALL * scale))
    others = np.array([(box[0], box[1], box[2] - box[0], box[3] - box[1]) for box in taken]).reshape(-1, 4)
    rises = stack_upwards(np.array(own).reshape(-1, 4), LABEL_GAP * scale, others).tolist()
    for (words, at), (left, bottom, wide, tall), rise in zip(shown, own, rises, strict=True):
        fill(at.x - scale / 2, at.y, scale, bottom + rise - at.y, (PAPER, PAPER))
        fill(left, bottom + rise, wide, tall, (PAPER, PAPER))
        write(words, left + PAD * scale, bottom + rise, scale)
