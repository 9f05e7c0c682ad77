"""Files of detections as detectors write them: KITTI's results, and boxes as OpenPCDet has them."""

from collections.abc import Sequence

import numpy as np

from ...arrays import Float
from .kitti import CLASSES as KITTI_CLASSES
from .kitti import PIXELS, camera_boxes
from .label_files import CLASSES
from .sample import shortest


def kitti_results(boxes: Float, categories: Sequence[str], score: Float) -> str:
    """Return a line of KITTI's results for each detection: a label, and the score.

    Parameters
    ----------
    boxes : (k, 7) float64
        x, y, z of the middle, length, width, height (metres), yaw (radians), local site axes.
    categories : sequence of str
        Category of each box.
    score : (k,) float64, 0 to 1
    """
    numbers, alpha = camera_boxes(boxes[:, :3], boxes[:, 3:6], boxes[:, 6])
    return "".join(
        f"{KITTI_CLASSES[category]} -1 -1 {shortest(angle)} 0 0 {PIXELS} {PIXELS} "
        f"{' '.join(shortest(value) for value in row)} {shortest(points)}\n"
        for category, angle, row, points in zip(categories, alpha, numbers, score, strict=True)
    )


def openpcdet_results(boxes: Float, categories: Sequence[str], score: Float) -> str:
    """Return a line ``x y z dx dy dz heading class score`` for each detection; see `kitti_results`."""
    return "".join(
        f"{' '.join(shortest(value) for value in row)} {CLASSES[category]} {shortest(points)}\n"
        for row, category, points in zip(boxes, categories, np.asarray(score), strict=True)
    )
