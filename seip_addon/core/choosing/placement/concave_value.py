r"""Concave values of a target, and the lines that bound them from above.

A target with the expected returns s of all chosen sensors together has the value g(s), g being concave, monotone and
g(0) = 0. As g is concave, each of its tangents lies above it, and so does the smallest of several,

.. math::
    g(s) \le \hat g(s) = \min_k (a_k + b_k s).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...arrays import Float


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight lines whose minimum bounds a concave function from above.

    Parameters
    ----------
    intercept, slope : (k,) float64
        a and b, in the order of falling slopes: the interval in which each line is the smallest follows that of the
        line before it.
    """

    intercept: Float
    slope: Float

    def __call__(self, s: Float) -> Float:
        """Return the smallest of the lines at each s, (n,) float64."""
        smallest: Float = (self.intercept + self.slope * np.asarray(s)[..., None]).min(axis=-1)
        return smallest

    def up_to(self, most: float) -> Lines:
        """Return the lines that are the smallest one somewhere from 0 to ``most``."""
        begins = np.diff(self.intercept) / -np.diff(self.slope)  # where each line but the first becomes the smallest
        needed = np.concatenate([[True], begins < most])
        return Lines(self.intercept[needed], self.slope[needed])


class ConcaveValue(Protocol):
    """A concave, monotone value of expected returns, with g(0) = 0."""

    def __call__(self, s: Float) -> Float:
        """Return g(s), (n,) float64."""

    def lines(self, most: float, error: float) -> Lines:
        """Return lines whose minimum exceeds g by at most ``error`` from 0 to ``most``."""

    def tangent(self, s: float) -> tuple[float, float]:
        """Return intercept and slope of a line that touches g at s and is nowhere below it."""


class LogReturns:
    r"""The value :math:`g(s) = \ln(1 + s)`: each further return is worth less than the one before.

    With u the ratio of 1 + s to 1 + t, the tangent at t exceeds g(s) by :math:`u - 1 - \ln u`. Tangents at steps of h
    in :math:`\ln(1 + t)` intersect where :math:`u = h/(1 - e^{-h})`, counted from the smaller of two neighbours; there
    their minimum exceeds g the most.
    """

    def __call__(self, s: Float) -> Float:
        """Return ln(1 + s)."""
        value: Float = np.log1p(s)
        return value

    def lines(self, most: float, error: float) -> Lines:
        """Return tangents whose minimum exceeds g by at most ``error`` from 0 to ``most``."""
        low, high = 0.0, 64.0  # bounds on the largest step with that error, by bisection: the error grows with the step
        for _ in range(100):
            step = (low + high) / 2
            low, high = (step, high) if _excess(step) <= error else (low, step)
        points = np.expm1(low * np.arange(math.ceil(math.log1p(most) / low) + 1))
        return Lines(np.log1p(points) - points / (1 + points), 1 / (1 + points))

    def tangent(self, s: float) -> tuple[float, float]:
        """Return intercept and slope of the tangent at s."""
        return math.log1p(s) - s / (1 + s), 1 / (1 + s)


def _excess(step: float) -> float:
    """Return the largest excess over ln(1 + s) of tangents at neighbouring points, a step apart in ln(1 + t)."""
    if step == 0:
        return 0.0
    ratio = step / -math.expm1(-step)
    return ratio - 1 - math.log(ratio)
