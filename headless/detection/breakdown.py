"""Average precision, recall and false positives by distance, returns, visibility, category and density."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from seip_addon.core.arrays import Boolean, Float, Integer

from .average_precision import Evaluation, part

DISTANCE_EDGES = (0.0, 10.0, 20.0, 30.0, 40.0, 60.0, np.inf)
POINT_EDGES = (0.0, 1.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, np.inf)
VISIBILITY_EDGES = (0.0, 0.1, 0.25, 0.5, 0.75, 0.95, np.inf)
DENSITY_EDGES = (0.0, 1.0, 3.0, 10.0, 30.0, 100.0, np.inf)


@dataclass(frozen=True)
class Bin:
    """Figures of the road users and detections in one bin.

    Parameters
    ----------
    low, high : float
        What holds these together: from ``low`` to below ``high``.
    wanted : int
        Road users that had to be found.
    value : float
        NaN where there are none to take it of.
    """

    low: float
    high: float
    wanted: int
    value: float


def average_precision_by(evaluation: Evaluation, quantity: str, edges: Sequence[float]) -> tuple[Bin, ...]:
    """Return the average precision in parts.

    A hit belongs to the part of the road user that it found (the box itself
    may lie beyond the edge), a false detection to its own.

    Parameters
    ----------
    quantity : str
        ``distance`` (to the nearest sensor, metres) or ``points`` (returns from it, or in the false box).
    edges : sequence of float
        Ascending.
    """
    wanted, detections = getattr(evaluation.wanted, quantity), getattr(evaluation.detections, quantity)
    parts = [
        (low, high, part(evaluation, _between(detections, low, high), _between(wanted, low, high)))
        for low, high in pairwise(edges)
    ]
    return tuple(Bin(low, high, len(some.wanted), some.average_precision) for low, high, some in parts)


def recall_by(evaluation: Evaluation, quantity: str, edges: Sequence[float], score: float) -> tuple[Bin, ...]:
    """Return the share of road users found with at least some score, in parts.

    Parameters
    ----------
    quantity : str
        ``visibility``, ``distance`` or ``points``.
    edges : sequence of float
        Ascending.
    """
    wanted = evaluation.wanted
    bins = []
    for low, high in pairwise(edges):
        found = wanted.score[_between(getattr(wanted, quantity), low, high)] >= score
        bins.append(Bin(low, high, len(found), float(found.mean()) if len(found) else np.nan))
    return tuple(bins)


def recall_by_category(evaluation: Evaluation, score: float) -> dict[str, tuple[float, int]]:
    """Return the share of road users found with at least some score, and their number, by category."""
    wanted = evaluation.wanted
    found = {name: wanted.score[wanted.category == name] >= score for name in evaluation.rule.categories}
    return {name: (float(some.mean()), len(some)) for name, some in found.items() if len(some)}


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
    return tuple(Bin(low, high, 0, float(_between(values, low, high).sum()) / frames) for low, high in bins)


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


def _between(values: Float | Integer, low: float, high: float) -> Boolean:
    return (values >= low) & (values < high)
