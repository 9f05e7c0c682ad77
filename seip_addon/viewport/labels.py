"""Labels of sensors in a viewport: light letters on dark paper, whatever the theme."""

import blf
import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..core.base.arrays import Float
from ..core.output.pictures.labels import stack_upwards
from ..scene import contract
from ..scene.sensors import placed_sensors
from ..state.overlay import Label
from ..state.session import session
from .free_frame import Box
from .legend import FONT, PAPER, TEXT_SIZE, fill, write

RISE, PAD, TALL, GAP = 16.0, 5.0, 18.0, 2.0
"""Pixels at the interface's usual scale: above the sensor, beside the letters, of the letters, between labels."""


def labels_of_sensors(scene: bpy.types.Scene) -> list[Label]:
    """Return the label and product of each sensor that the scene shows, at its optical centre."""
    return [
        (f"{label}  {_product(obj)}".strip(), tuple(obj.matrix_world.translation))
        for label, obj in placed_sensors(scene).items()
        if obj.name in scene.view_layers[0].objects and obj.visible_get(view_layer=scene.view_layers[0])
    ]


def _product(obj: bpy.types.Object) -> str:
    key = str(obj.get(contract.SENSOR, ""))
    model = session.sensor_types.get(key)
    return key if model is None else model.short_name


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
    bottom = bottom + stack_upwards(own, GAP * scale, others)
    boxes: Float = np.column_stack((left, bottom, left + widths, bottom + tall))
    return boxes
