"""Number of false detections, and where the cloud is sparse."""

from dataclasses import dataclass

from headless.detection.average_precision import Evaluation

import numpy as np


@dataclass(frozen=True)
class FalsePositives:
    """Counts of the false detections with at least some score.

    Parameters
    ----------
    sparse : float, 0 to 1
        Share of them that lie where the cloud is sparser than around half of the hits; chance alone gives a half.
        NaN without false detections or without hits.
    """

    per_frame: float
    sparse: float


def false_positives(evaluation: Evaluation, score: float) -> FalsePositives:
    """Count the false detections with at least some score, and how many of them lie in sparse places."""
    detections = evaluation.detections
    counted = detections.score >= score
    false, hits = ~detections.hit & counted, detections.density[detections.hit & counted]
    known = false.any() and len(hits)
    sparse = float((detections.density[false] < np.median(hits)).mean()) if known else np.nan
    return FalsePositives(float(false.sum()) / len(evaluation.run), sparse)
