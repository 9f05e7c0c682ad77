"""Labels of sensors in a viewport: light letters on dark paper, whatever the theme."""

import blf
import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..core.output.pictures.callouts import stack_upwards
from ..overlay import Label
from ..scene import contract
from ..scene.sensors import placed_sensors
from .legend import FONT, PAPER, TEXT_SIZE, fill, write

RISE, PAD, TALL, GAP = 16.0, 5.0, 18.0, 2.0
"""Pixels at the interface's usual scale: above the sensor, beside the letters, of the letters, between labels."""


def labels_of_sensors(scene: bpy.types.Scene) -> list[Label]:
    """Return the label and type of each sensor that the scene shows, at its optical centre."""
    return [
        (f"{label}  {obj.get(contract.SENSOR, '')}".strip(), tuple(obj.matrix_world.translation))
        for label, obj in placed_sensors(scene).items()
        if obj.name in scene.view_layers[0].objects and obj.visible_get(view_layer=scene.view_layers[0])
    ]


def draw_labels(labels: list[Label], to_view: Matrix, size: tuple[int, int], scale: float) -> None:
    """Draw labels above what they name, with a line to it, and no label over another.

    Parameters
    ----------
    to_view : (4, 4) Matrix
        From the scene's axes to the view's: -1 to 1 after division.
    size : (width, height) pixels
    scale : float
        Scale of the interface.
    """
    blf.size(FONT, TEXT_SIZE * scale)
    shown, boxes = [], []
    for words, place in labels:
        seen = to_view @ Vector((*place, 1.0))
        if seen.w <= 0.0:
            continue  # behind the eye
        x, y = ((1.0 + seen[axis] / seen.w) / 2.0 * size[axis] for axis in (0, 1))
        wide = blf.dimensions(FONT, words)[0] + 2 * PAD * scale
        shown.append((words, x, y))
        boxes.append((x - wide / 2, y + RISE * scale, wide, TALL * scale))
    for (words, x, y), (left, low, wide, tall), rise in zip(shown, boxes, _rises(boxes, scale), strict=True):
        bottom = low + rise
        fill(x - scale / 2, y, scale, bottom - y, (PAPER, PAPER))
        fill(left, bottom, wide, tall, (PAPER, PAPER))
        write(words, left + PAD * scale, bottom, scale)


def _rises(boxes: list[tuple[float, float, float, float]], scale: float) -> list[float]:
    rises: list[float] = stack_upwards(np.array(boxes).reshape(-1, 4), GAP * scale).tolist()
    return rises
