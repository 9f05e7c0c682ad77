"""Ground truth and detections of one frame, with the attributes by which errors are broken down.

`tests/detection/test_frame_results.py` shows its use.
"""

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from seip_addon.core.base.arrays import Boolean, Float, Integer, Text
from seip_addon.core.sensing.recordings.recorded_frames import within_box
from seip_addon.core.sensing.scans.frame import Frame

from .settings import CLASS_CATEGORIES

DENSITY_RADIUS = 3.0  # radius in metres of the circle around a box in which the density of returns is taken
_ROUNDING = 1e-3  # metres: points are sought so much farther than they can count, as coordinates are rounded


@dataclass(frozen=True, eq=False)
class Detections:
    """Boxes that a detector outputs for one cloud; k boxes in any order.

    Parameters
    ----------
    boxes : (k, 7) float64
        x, y, z of the middle, length, width, height (metres), yaw (radians, counter-clockwise from +x).
    score : (k,) float64, 0 to 1
        Confidence of the detector.
    category : (k,) int64
        Index into the detector's classes.
    """

    boxes: Float
    score: Float
    category: Integer

    def __len__(self) -> int:
        return len(self.score)


@dataclass(frozen=True, eq=False)
class GroundTruth:
    """All road users of a frame, inside the region of interest and outside it; g boxes.

    Parameters
    ----------
    boxes : (g, 7) float64
        x, y, z of the middle, length, width, height (metres), yaw (radians, counter-clockwise from +x).
    category : (g,) str
        Category of the road user: car, van, truck, bus, motorcycle, bicycle or pedestrian.
    points : (g,) int64
        Number of returns from the road user, all sensors together.
    visibility : (g,) float64, 0 to 1
        Share of the rays towards the road user that no other object blocks.
    inside : (g,) bool
        Whether the middle of the box is in the region of interest.
    distance : (g,) float64, metres
        Distance from the middle of the box to the nearest sensor; infinite without sensors.
    parked : (g,) bool
        Whether the road user does not move during its run; false if unknown.
    """

    boxes: Float
    category: Text
    points: Integer
    visibility: Float
    inside: Boolean
    distance: Float
    parked: Boolean

    def __len__(self) -> int:
        return len(self.boxes)


@dataclass(frozen=True, eq=False)
class EvaluatedBoxes:
    """Detections of a frame with the attributes by which errors are broken down; k boxes.

    Parameters
    ----------
    boxes : (k, 7) float64
        x, y, z of the middle, length, width, height (metres), yaw (radians, counter-clockwise from +x).
    score : (k,) float64, 0 to 1
        Confidence of the detector.
    category : (k,) str
        Detected category; for a class of several categories, the first of them.
    points : (k,) int64
        Number of returns in the box.
    density : (k,) float64, per square metre
        Returns per area within `DENSITY_RADIUS` of the middle of the box in plan.
    inside : (k,) bool
        Whether the middle of the box is in the region of interest.
    distance : (k,) float64, metres
        Distance from the middle of the box to the nearest sensor; infinite without sensors.
    """

    boxes: Float
    score: Float
    category: Text
    points: Integer
    density: Float
    inside: Boolean
    distance: Float

    def __len__(self) -> int:
        return len(self.boxes)


@dataclass(frozen=True, eq=False)
class FrameResult:
    """Ground truth and detections of one frame.

    Parameters
    ----------
    run : str
        Name of the recording.
    time : float, seconds
        Time of the frame since the start of the run.
    truth : GroundTruth
        Road users of the frame.
    detected : EvaluatedBoxes
        Detections in the frame.
    """

    run: str
    time: float
    truth: GroundTruth
    detected: EvaluatedBoxes


def frame_result(
    frame: Frame,
    detections: Detections,
    *,
    region: BaseGeometry,
    sensors: Float,
    run: str,
    parked: Boolean | None = None,
) -> FrameResult:
    """Combine detections and road users of a frame.

    Parameters
    ----------
    region : shapely geometry, metres
        Region of interest in plan, local site axes.
    sensors : (s, 3) float64, metres
        Positions of the sensors, local site axes.
    run : str
        Name of the recording.
    parked : (u,) bool, optional
        Mask of the trajectories' road users that do not move during the run.
    """
    labels, boxes = frame.labels, detections.boxes
    first = np.array([members[0] for members in CLASS_CATEGORIES.values()], dtype=np.str_)
    points, density = _returns_around(boxes, frame.points)
    return FrameResult(
        run=run,
        time=frame.time,
        truth=GroundTruth(
            boxes=np.column_stack([labels.centre, labels.size, labels.yaw]),
            category=labels.category,
            points=labels.points.sum(axis=1),
            visibility=labels.visibility,
            inside=labels.inside,
            distance=_nearest(labels.centre, sensors),
            parked=np.zeros(len(labels), dtype=np.bool_) if parked is None else parked[labels.user],
        ),
        detected=EvaluatedBoxes(
            boxes=boxes,
            score=detections.score,
            category=first[detections.category],
            points=points,
            density=density,
            inside=np.asarray(shapely.contains_xy(region, boxes[:, 0], boxes[:, 1]), dtype=np.bool_),
            distance=_nearest(boxes[:, :3], sensors),
        ),
    )


def _nearest(points: Float, sensors: Float) -> Float:
    """Return the distance from each point to the nearest sensor."""
    distance: Float = np.linalg.norm(points[:, None] - sensors, axis=2).min(axis=1, initial=np.inf)
    return distance


def _returns_around(boxes: Float, points: NDArray[np.float32]) -> tuple[Integer, Float]:
    """Return the number of returns in each box, and their density around it in plan (per square metre), (k,) each."""
    inside, near = np.zeros(len(boxes), dtype=np.int64), np.zeros(len(boxes), dtype=np.int64)
    points = points[np.argsort(points[:, 0])]
    # One query serves both: this circle contains the box, whose corners are half a diagonal from its middle.
    reach = np.maximum(DENSITY_RADIUS, np.hypot(boxes[:, 3], boxes[:, 4]) / 2) + _ROUNDING
    first, end = np.searchsorted(points[:, 0], [boxes[:, 0] - reach, boxes[:, 0] + reach])
    for row, (x, y, z, length, width, height, yaw) in enumerate(boxes):
        strip = points[first[row] : end[row]]
        here = strip[np.abs(strip[:, 1] - y) <= reach[row]] - (x, y, z)
        near[row] = np.count_nonzero(here[:, 0] ** 2 + here[:, 1] ** 2 <= DENSITY_RADIUS**2)
        inside[row] = np.count_nonzero(within_box(here, (length, width, height), yaw))
    return inside, near / (np.pi * DENSITY_RADIUS**2)
