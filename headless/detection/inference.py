"""Detection in one cloud."""

import numpy as np
import torch
from numpy.typing import NDArray

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.scans.frame import Frame

from .detection_area import DetectionArea
from .detector import Detector
from .frame_results import Detections
from .pillars import PillarGrid, fill_pillars
from .rotated_boxes import in_plan, suppress
from .sparse_inference import sparse_output

MIN_SCORE = 0.05  # boxes below it are not kept: average precision hardly sees them, and time is spent on each
MAX_OVERLAP = 0.1  # intersection over union in plan beyond which two boxes are one road user


def detect(detector: Detector, area: DetectionArea, frame: Frame, *, least_score: float = MIN_SCORE) -> Detections:
    """Return the road users in a frame, in local site axes, best first.

    Parameters
    ----------
    area : DetectionArea
        Detection area of the site; returns outside are ignored.
    least_score : float
        Lowest score of a returned detection.

    Raises
    ------
    SeipError
        The detector was trained with pillars of another size.
    """
    found = detect_on_level(detector, area.grid, area.cloud(frame), least_score=least_score)
    return Detections(area.raised(found.boxes), found.score, found.category)


@torch.inference_mode()
def detect_on_level(
    detector: Detector, grid: PillarGrid, cloud: NDArray[np.float32], *, least_score: float = MIN_SCORE
) -> Detections:
    """Return the road users in foreground returns, best first.

    Parameters
    ----------
    cloud : (n, 4) float32
        x, y, height above the road (metres), intensity, 0 to 1.

    Returns
    -------
    Detections
        With heights above the road.
    """
    if grid.pillar != detector.settings.pillar:
        raise SeipError(
            f"a detector trained with pillars of {detector.settings.pillar:g} m does not work with pillars of "
            f"{grid.pillar:g} m: lay the grid with its own"
        )
    detector.eval()
    pillars = fill_pillars(cloud, grid, detector.settings.most_points)
    output = sparse_output(detector, pillars, grid.rows, grid.columns, grid.pillar)
    (found,) = detector.head.candidates(output, grid, least_score)
    stays = suppress(in_plan(found.boxes), found.score, MAX_OVERLAP)
    return Detections(
        boxes=found.boxes[stays].double().cpu().numpy(),
        score=found.score[stays].double().cpu().numpy(),
        category=found.category[stays].cpu().numpy(),
    )
