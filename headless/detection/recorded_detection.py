"""Detection area of a field recording, and the score of the detections that are shown."""

from __future__ import annotations

from seip_addon.core.sensing.recordings.recorded_frames import RecordedFrames

from .detection_area import DetectionArea
from .detector import Detector
from .pillars import grid_over
from .settings import BOTTOM, TOP

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


def area_of_recording(frames: RecordedFrames, detector: Detector, name: str) -> DetectionArea:
    """Return the detection area of a recording: its region, with heights above the estimated ground."""
    west, south, east, north = map(float, frames.region.bounds)
    grid = grid_over((west, south, east, north), (BOTTOM, TOP), detector.settings.pillar)
    return DetectionArea(grid, frames.ground, name)
