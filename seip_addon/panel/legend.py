"""Words over a viewport: the legend in its lower right corner, and labels of what stands in the scene."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix, Vector

from ..core.base.arrays import Float
from ..core.output.pictures.labels import stack_upwards

TEXT_SIZE, LINE, SWATCH, GAP, MARGIN = 12.0, 20.0, 22.0, 8.0, 14.0  # pixels at the interface's usual scale
LEAST_SCALE = 0.6
"""Scale below which letters could not be read; a legend that has no room even so is cut."""
PAPER: Colour = (0.06, 0.08, 0.10, 0.82)
INK: Colour = (0.95, 0.96, 0.97, 1.0)
EDGE: Colour = (0.55, 0.58, 0.62, 1.0)
FONT = 0
RISE, PAD, TALL, LABEL_GAP = 16.0, 5.0, 18.0, 2.0
"""Pixels at the interface's usual scale: above the sensor, beside the letters, of the letters, between labels."""


Colour = tuple[float, float, float, float]


Label = tuple[str, tuple[float, ...]]
"""Words, and the place (3,) in metres above which they stand."""


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


Box = tuple[float, float, float, float]
"""Left, bottom, right and top, pixels."""


def free_frame(area: bpy.types.Area, region: bpy.types.Region) -> Box:
    """Return the free part of a viewport's window, in pixels of that window."""
    others = [(one.alignment, _box(one)) for one in area.regions if one != region and min(one.width, one.height) > 1]
    left, bottom, right, top = uncovered(_box(region), others)
    return left - region.x, bottom - region.y, right - region.x, top - region.y


def uncovered(window: Box, others: Iterable[tuple[str, Box]]) -> Box:
    """Return what is left of a window beside boxes that lie over its edges.

    Parameters
    ----------
    others : iterable of (str, Box)
        Edge at which each box lies (``LEFT``, ``RIGHT``, ``TOP``, ``BOTTOM``), and the box.
    """
    left, bottom, right, top = window
    for edge, box in others:
        if box[0] >= window[2] or box[2] <= window[0] or box[1] >= window[3] or box[3] <= window[1]:
            continue
        if edge == "LEFT":
            left = max(left, box[2])
        elif edge == "RIGHT":
            right = min(right, box[0])
        elif edge == "TOP":
            top = min(top, box[1])
        elif edge == "BOTTOM":
            bottom = max(bottom, box[3])
    return left, bottom, max(left, right), max(bottom, top)


def _box(region: bpy.types.Region) -> Box:
    return region.x, region.y, region.x + region.width, region.y + region.height


def placed_legend(blocks: Sequence[Block], frame: Box, scale: float) -> tuple[Box, float]:
    """Return the box of the legend in the lower right corner of a frame, and the scale at which it fits there.

    Parameters
    ----------
    frame : (left, bottom, right, top), pixels
        Part of a viewport that nothing covers.
    scale : float
        Scale of the interface, and of the legend where there is room.
    """
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


def draw_labels(  # what a label must keep off is of several kinds
    labels: list[Label], to_view: Matrix, size: tuple[int, int], frame: Box, taken: list[Box], scale: float
) -> None:
    """Draw labels above what they name, with a line to it, and no label over another.

    Parameters
    ----------
    to_view : (4, 4) Matrix
        From the scene's axes to the view's: -1 to 1 after division.
    size : (width, height) pixels
    frame : (left, bottom, right, top), pixels
        Part of the viewport that nothing covers.
    taken : list of Box
        Boxes in the frame over which no label may be.
    scale : float
        Scale of the interface.
    """
    blf.size(FONT, TEXT_SIZE * scale)
    shown, widths, anchors = [], [], []
    for words, place in labels:
        seen = to_view @ Vector((*place, 1.0))
        if seen.w <= 0.0:
            continue  # behind the eye
        shown.append(words)
        widths.append(blf.dimensions(FONT, words)[0] + 2 * PAD * scale)
        anchors.append([(1.0 + seen[axis] / seen.w) / 2.0 * size[axis] for axis in (0, 1)])
    boxes = label_boxes(np.array(anchors).reshape(-1, 2), np.array(widths), frame, taken, scale)
    for words, (x, y), (left, bottom, right, top) in zip(shown, anchors, boxes.tolist(), strict=True):
        fill(x - scale / 2, y, scale, bottom - y, (PAPER, PAPER))
        fill(left, bottom, right - left, top - bottom, (PAPER, PAPER))
        write(words, left + PAD * scale, bottom, scale)


def label_boxes(anchors: Float, widths: Float, frame: Box, taken: list[Box], scale: float) -> Float:
    """Return the box of each label, (k, 4): left, bottom, right, top, pixels.

    Labels of what is in the frame are in its width, above what they name, and above taken boxes and other labels.

    Parameters
    ----------
    anchors : (k, 2) float64, pixels
        What the labels name.
    widths : (k,) float64, pixels
    """
    left = anchors[:, 0] - widths / 2.0
    inside = (anchors[:, 0] >= frame[0]) & (anchors[:, 0] <= frame[2])
    left = np.where(inside, np.maximum(np.minimum(left, frame[2] - widths), frame[0]), left)
    bottom, tall = anchors[:, 1] + RISE * scale, TALL * scale
    own = np.column_stack((left, bottom, widths, np.full(len(left), tall)))
    others = np.array([(box[0], box[1], box[2] - box[0], box[3] - box[1]) for box in taken]).reshape(-1, 4)
    bottom = bottom + stack_upwards(own, LABEL_GAP * scale, others)
    boxes: Float = np.column_stack((left, bottom, left + widths, bottom + tall))
    return boxes
