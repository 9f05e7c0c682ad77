"""KITTI's object detection format, with a camera that stands in the origin and looks along +x.

Labels are in the camera's axes (x right, y down, z forward): the middle of the underside, height, width, length, and
the rotation about y, which is −heading − π/2 [1]_. The calibration turns axes and nothing else, so that what comes
back in LiDAR axes is exact. Evaluators leave out objects less than 25 or 40 pixels high: each box in the picture is
100 × 100. Its readers want a picture and, of a frame without labels, a line ``DontCare``, as KITTI itself has.

.. [1] A. Geiger, P. Lenz, R. Urtasun, "Are we ready for Autonomous Driving? The KITTI Vision Benchmark Suite", CVPR
   2012; readme of the object development kit.
"""

import io
from collections.abc import Callable
from functools import partial

import numpy as np
from PIL import Image

from ...arrays import Float
from .format_interface import Format
from .label_files import image_sets
from .sample import Sample, cloud, shortest

CLASSES = {
    "car": "Car",
    "van": "Van",
    "truck": "Truck",
    "bus": "Truck",
    "motorcycle": "Cyclist",
    "bicycle": "Cyclist",
    "pedestrian": "Pedestrian",
}
"""KITTI has neither buses nor motorcycles; readers ignore or refuse a name that it does not have."""

NO_LABEL = "DontCare -1 -1 -10 0 0 0 0 -1 -1 -1 -1000 -1000 -1000 -10\n"  # the label of a frame without any
PIXELS = 100  # width and height of the empty picture and of each box in it

_IDENTITY = "1 0 0 0 0 1 0 0 0 0 1 0"
CALIBRATION = "".join(
    f"{name}: {numbers}\n"
    for name, numbers in {
        **dict.fromkeys(("P0", "P1", "P2", "P3"), _IDENTITY),
        "R0_rect": "1 0 0 0 1 0 0 0 1",
        "Tr_velo_to_cam": "0 -1 0 0 0 0 -1 0 1 0 0 0",
        "Tr_imu_to_velo": _IDENTITY,
    }.items()
)

FULLY_VISIBLE, PARTLY_VISIBLE = 0.8, 0.4
"""Visibility from which an object counts as fully visible (0) and as partly occluded (1) and not largely (2)."""


def sample_files(sample: Sample) -> dict[str, Callable[[], bytes]]:
    """Return ``velodyne``, ``label_2``, ``calib`` and ``image_2`` of a sample."""
    part = "testing" if sample.run.split == "test" else "training"
    return {
        f"{part}/velodyne/{sample.name}.bin": lambda: cloud(sample.frame).tobytes(),
        f"{part}/label_2/{sample.name}.txt": partial(_label_file, sample),
        f"{part}/calib/{sample.name}.txt": CALIBRATION.encode,
        f"{part}/image_2/{sample.name}.png": _empty_picture,
    }


def _label_file(sample: Sample) -> bytes:
    boxes = sample.boxes
    numbers, alpha = camera_boxes(boxes.centre, boxes.size, boxes.yaw)
    occluded = np.where(boxes.visibility >= FULLY_VISIBLE, 0, np.where(boxes.visibility >= PARTLY_VISIBLE, 1, 2))
    lines = "".join(
        f"{name} 0 {hidden} {shortest(angle)} 0 0 {PIXELS} {PIXELS} {' '.join(shortest(number) for number in row)}\n"
        for name, hidden, angle, row in zip(sample.classes, occluded, alpha, numbers, strict=True)
    )
    return (lines or NO_LABEL).encode()


def camera_boxes(centre: Float, size: Float, yaw: Float) -> tuple[Float, Float]:
    """Return boxes in the camera's axes.

    Parameters
    ----------
    centre, size : (k, 3) float64, metres
        Middle, and length, width, height.
    yaw : (k,) float64, radians

    Returns
    -------
    numbers : (k, 7) float64
        Height, width, length, the middle of the underside, and the rotation about y.
    alpha : (k,) float64, radians
        The angle at which the camera sees each.
    """
    length, width, height = size.T
    x, y, z = centre.T
    camera = np.column_stack([-y, height / 2 - z, x])
    rotation = _wrapped(-yaw - np.pi / 2)
    # rounded: numpy's versions differ in the last digit of an arctangent
    alpha = np.round(_wrapped(rotation - np.arctan2(camera[:, 0], camera[:, 2])), 6)
    return np.column_stack([height, width, length, camera, rotation]), alpha


def _wrapped(angle: Float) -> Float:
    """Return angles in [-π, π)."""
    wrapped: Float = np.mod(angle + np.pi, 2 * np.pi) - np.pi
    return wrapped


def _empty_picture() -> bytes:
    buffer = io.BytesIO()
    Image.new("RGB", (PIXELS, PIXELS)).save(buffer, "PNG")
    return buffer.getvalue()


FORMAT = Format(
    "kitti", "KITTI's object detection format", CLASSES, sample_files, lambda _folder, splits: image_sets(splits)
)
