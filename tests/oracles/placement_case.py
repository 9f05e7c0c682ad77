"""A placement problem as plain arrays, which the independent checks of solvers compute on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Boolean = NDArray[np.bool_]
Float = NDArray[np.float64]

LEAST_EXCESS = 1 + 1e-9
"""Prices are decimals, whose sums floats round: this much above a budget is within it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlacementCase:
    """Maximise sum_t w_t g(sum_{i in S} A_it), where g(x) is min(x, 1) or, for returns, log(1 + x).

    Parameters
    ----------
    amounts : (c, t) bool or float32
        A: whether each candidate sees each target, or its returns from each road user.
    logarithm : bool
        Whether g is the logarithm.
    positions : (c,) int64
        At most one candidate is chosen at each.
    mandatory : (g, c) bool
        Groups of candidates of which at least one must be chosen.
    budget : float
        Infinite where there is none.
    """

    amounts: NDArray[np.generic]
    logarithm: bool
    weights: Float
    prices: Float
    positions: NDArray[np.int64]
    xyz: Float
    labels: NDArray[np.str_]
    mandatory: Boolean
    forbidden: Boolean
    count: int | None = None
    budget: float = math.inf
    min_distance: float = 0.0

    def value(self, chosen: Sequence[int]) -> float:
        """Return the objective value of chosen candidates."""
        sums = self.amounts[list(chosen)].sum(axis=0, dtype=np.float64)
        return math.fsum(self.weights * (np.log1p(sums) if self.logarithm else sums >= 1))

    def conflict(self) -> Boolean:
        """Return the pairs of which at most one can be chosen, (c, c) bool; the diagonal included."""
        apart = np.hypot(*(self.xyz[:, None, :2] - self.xyz[None, :, :2]).transpose(2, 0, 1))
        return (self.positions[:, None] == self.positions) | (apart < self.min_distance - 1e-6)
