"""False detections, by distance and by the density of the cloud."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from headless.charts.detection import Bin
from headless.detection.average_precision import Evaluation
from headless.detection.breakdown import in_bin

import numpy as np

from seip_addon.core.arrays import Boolean

DENSITY_EDGES = (0.0, 1.0, 3.0, 10.0, 30.0, 100.0, np.inf)


def false_by(evaluation: Evaluation, quantity: str, edges: Sequence[float], score: float) -> tuple[Bin, ...]:
    """Return the false detections per frame with at least some score, in parts.

    Parameters
    ----------
    quantity : str
        ``density`` (returns per square metre around it) or ``distance`` (to the nearest sensor, metres).
    edges : sequence of float
        Ascending.
    """
    values, frames = getattr(evaluation.detections, quantity)[_is_false(evaluation, score)], len(evaluation.run)
    bins = pairwise(edges)
    return tuple(Bin(low, high, 0, float(in_bin(values, low, high).sum()) / frames) for low, high in bins)


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
    false = _is_false(evaluation, score)
    hits = detections.density[detections.hit & (detections.score >= score)]
    known = false.any() and len(hits)
    sparse = float((detections.density[false] < np.median(hits)).mean()) if known else np.nan
    return FalsePositives(float(false.sum()) / len(evaluation.run), sparse)


def _is_false(evaluation: Evaluation, score: float) -> Boolean:
    return ~evaluation.detections.hit & (evaluation.detections.score >= score)
