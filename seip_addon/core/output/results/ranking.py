"""Candidates ranked by coverage, alone or added to a placement."""

from dataclasses import dataclass

import numpy as np

from ...arrays import Boolean, Float


@dataclass(frozen=True)
class Ranked:
    """A candidate pose and its worth.

    Parameters
    ----------
    pose : int
        Index among the site's candidates.
    share : float
        Share of the targets' weight: that it sees, or that it adds.
    """

    pose: int
    share: float


def rank_alone(visible: Boolean, weight: Float, most: int) -> list[Ranked]:
    """Return the poses that see the most weight by themselves.

    Parameters
    ----------
    visible : (c, t) bool
    weight : (t,) float64
    """
    return _ranked(visible, weight, np.zeros(visible.shape[1], dtype=bool), most)


def rank_added(visible: Boolean, weight: Float, seen: Boolean, free: Boolean, most: int) -> list[Ranked]:
    """Return the poses that would add the most weight to a placement, at positions that it leaves free.

    Parameters
    ----------
    visible : (c, t) bool
    weight : (t,) float64
    seen : (t,) bool
        What the placement sees.
    free : (c,) bool
        Poses at positions that it leaves free.
    """
    return [one for one in _ranked(visible, weight, seen, len(visible)) if free[one.pose]][:most]


def _ranked(visible: Boolean, weight: Float, seen: Boolean, most: int) -> list[Ranked]:
    total = float(weight.sum())
    worth = visible @ np.where(seen, 0.0, weight) / (total if total > 0 else 1.0)
    order = np.lexsort((np.arange(len(worth)), -worth))[:most]
    return [Ranked(int(pose), float(worth[pose])) for pose in order]
