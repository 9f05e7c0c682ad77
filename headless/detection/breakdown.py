"""Average precision and recall by distance, returns, visibility and category."""

from collections.abc import Sequence
from itertools import pairwise

from headless.charts.detection import Bin

import numpy as np

from seip_addon.core.base.arrays import Boolean, Float, Integer

from .average_precision import Evaluation, part

DISTANCE_EDGES = (0.0, 10.0, 20.0, 30.0, 40.0, 60.0, np.inf)
POINT_EDGES = (0.0, 1.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, np.inf)


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
        (low, high, part(evaluation, in_bin(detections, low, high), in_bin(wanted, low, high)))
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
        found = wanted.score[in_bin(getattr(wanted, quantity), low, high)] >= score
        bins.append(Bin(low, high, len(found), float(found.mean()) if len(found) else np.nan))
    return tuple(bins)


def recall_by_category(evaluation: Evaluation, score: float) -> dict[str, tuple[float, int]]:
    """Return the share of road users found with at least some score, and their number, by category."""
    wanted = evaluation.wanted
    found = {name: wanted.score[wanted.category == name] >= score for name in evaluation.rule.categories}
    return {name: (float(some.mean()), len(some)) for name, some in found.items() if len(some)}


def in_bin(values: Float | Integer, low: float, high: float) -> Boolean:
    """Return which values lie in a bin from ``low`` to below ``high``."""
    return (values >= low) & (values < high)
