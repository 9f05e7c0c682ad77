"""Data of the detection charts, taken from evaluations."""

from dataclasses import replace

from headless.charts.detection import PrecisionRecallLine
from headless.charts.error_view import ErrorView

import numpy as np
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from seip_addon.core.arrays import Float

from .average_precision import Evaluation, precision_recall
from .frame_results import FrameResult
from .matching import NO_MATCH, Rule, match

PLAN_COLUMNS = [0, 1, 3, 4, 6]


def curve(sensor: str, count: int, evaluation: Evaluation) -> PrecisionRecallLine:
    """Return precision and recall of one type and number of sensors."""
    found = precision_recall(evaluation)
    return PrecisionRecallLine(sensor, count, found.recall, found.precision, evaluation.average_precision)


def error_view(  # noqa: PLR0913 - a frame, how it is evaluated, and where it is
    name: str,
    frame: FrameResult,
    rule: Rule,
    *,
    score: float,
    cloud: NDArray[np.float32],
    region: BaseGeometry,
    sensors: Float,
) -> ErrorView:
    """Return a frame with the detections of at least some score, and what of them is wrong.

    Parameters
    ----------
    cloud : (n, 3) float32, metres
    region : shapely geometry
    sensors : (s, 3) float64, metres
    """
    kept = frame.detected.score >= score
    columns = {column: values[kept] for column, values in vars(frame.detected).items()}
    shown = replace(frame, detected=replace(frame.detected, **columns))
    found = match(shown, rule)
    return ErrorView(
        name=name,
        cloud=cloud[:, :2].astype(np.float64),
        region=region,
        sensors=sensors[:, :2],
        truth=frame.truth.boxes[:, PLAN_COLUMNS],
        wanted=found.counted,
        missed=found.counted & (found.found_by == NO_MATCH),
        detected=shown.detected.boxes[:, PLAN_COLUMNS],
        false=found.evaluated & ~found.hit,
    )
