"""Detection in one cloud."""

import numpy as np
import torch
from numpy.typing import NDArray

from .detector import Detector
from .frame_results import Detections
from .pillars import fill_pillars
from .rotated_boxes import in_plan, suppress

MIN_SCORE = 0.05  # boxes below it are not kept: average precision hardly sees them, and time is spent on each
MAX_OVERLAP = 0.1  # intersection over union in plan beyond which two boxes are one road user


@torch.inference_mode()
def detect(
    detector: Detector, points: NDArray[np.float32], intensity: NDArray[np.float32], *, least_score: float = MIN_SCORE
) -> Detections:
    """Return the road users in a cloud.

    Parameters
    ----------
    points : (n, 3) float32, metres
        Merged cloud of all sensors, local site axes. What lies outside the detector's grid is left out.
    intensity : (n,) float32, 0 to 1
    least_score : float
        What scores less is not returned.

    Returns
    -------
    Detections
        Best first.
    """
    detector.eval()
    grid = detector.grid
    pillars = fill_pillars(np.column_stack((points, intensity)), grid, detector.settings.most_points)
    output = detector(pillars, (1, grid.rows, grid.columns))
    (found,) = detector.found_by.candidates(output, grid, least_score)
    stays = suppress(in_plan(found.boxes), found.score, MAX_OVERLAP)
    return Detections(
        boxes=found.boxes[stays].double().cpu().numpy(),
        score=found.score[stays].double().cpu().numpy(),
        category=found.category[stays].cpu().numpy(),
    )
