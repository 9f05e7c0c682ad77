"""Detection in the frames of a field recording."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from seip_addon.core.progress import Progress
from seip_addon.core.sensing.recordings.box_labels import BoxLabels
from seip_addon.core.sensing.recordings.recorded_frames import RecordedFrames
from seip_addon.core.sensing.scans.frame import Frame

from .detection_area import DetectionArea
from .detector import Detector
from .frame_results import Detections, FrameResult, frame_result
from .inference import detect
from .pillars import grid_over
from .settings import BOTTOM, TOP
from .training import deterministic

RECOMMENDED_SCORE = 0.5
"""Score from which detections in recordings are drawn and listed.

Measured with the shipped detector on recordings simulated at the shipped junction and corridor (two OS1-128 each, 40
sweeps in 40 s, background and ground estimated). Moving vehicles with 10 returns or more count as found if a box is
within 2 m; vehicles near no road user are false. Recall is that within 50 and 80 m of a sensor.

===== ================================== ================================
score false vehicles per frame (80 m)    recall (50 m, 80 m)
      junction, corridor                 junction; corridor
===== ================================== ================================
0.4   2.8, 2.4                           99.6 %, 88 %; 97 %, 96 %
0.5   0.5, 0.5                           99.6 %, 87 %; 95 %, 90 %
0.6   0.0, 0.0                           99.1 %, 85 %; 87 %, 80 %
===== ================================== ================================
"""

_BLOCKS = 8  # parts of a recording that intervals treat as independent
_LEAST_PER_BLOCK = 2  # frames


@dataclass(frozen=True, eq=False)
class DetectedFrame:
    """A frame with its detections.

    Parameters
    ----------
    number : int
    frame : Frame
    detections : Detections
        In site axes, best first.
    result : FrameResult
        Ground truth and detections, if the frame has labels; otherwise without ground truth.
    """

    number: int
    frame: Frame
    detections: Detections
    result: FrameResult


def area_of_recording(frames: RecordedFrames, detector: Detector, name: str) -> DetectionArea:
    """Return the detection area of a recording: its region, with heights above the estimated ground."""
    west, south, east, north = map(float, frames.region.bounds)
    grid = grid_over((west, south, east, north), (BOTTOM, TOP), detector.settings.pillar)
    return DetectionArea(grid, frames.ground, name)


def detect_in_recording(
    frames: RecordedFrames,
    detector: Detector,
    area: DetectionArea,
    *,
    labels: Sequence[BoxLabels] | None,
    known: Callable[[int], Detections | None],
    threads: int,
) -> Generator[Progress | DetectedFrame, None, None]:
    """Yield each frame with its detections, and the progress before it.

    Parameters
    ----------
    labels : sequence of BoxLabels, optional
        Labels of each frame, in site axes.
    known : callable
        From the number of a frame to its detections, if an interrupted run has found them; otherwise None.
    threads : int
        CPU threads of torch.
    """
    total = len(frames)
    blocks = _BLOCKS if total >= _BLOCKS * _LEAST_PER_BLOCK else 1
    places = np.array([sensor.mounted.xyz for sensor in frames.sensors])
    for number in range(total):
        yield Progress(number, total, "detecting")
        frame = frames.frame(number, None if labels is None else labels[number])
        detections = known(number)
        if detections is None:
            with deterministic(threads):
                detections = _inside(detect(detector, area, frame), frames)
        result = frame_result(
            frame,
            detections,
            region=frames.region,
            sensors=places,
            run=f"part {number * blocks // total + 1}" if blocks > 1 else "recording",
        )
        yield DetectedFrame(number, frame, detections, result)
    yield Progress(total, total, "detecting")


def _inside(found: Detections, frames: RecordedFrames) -> Detections:
    """Return the detections in the region."""
    inside = shapely.contains_xy(frames.region, found.boxes[:, 0], found.boxes[:, 1])
    return Detections(found.boxes[inside], found.score[inside], found.category[inside])
