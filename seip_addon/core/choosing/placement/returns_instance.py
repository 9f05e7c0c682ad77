r"""Placement by expected returns: the reduced problem that its algorithms work on.

With :math:`R_{ij}` the expected returns of pose i from road user j,

.. math::
    \max_{x \in X} \sum_j w_j \, g\Big(\sum_i R_{ij} x_i\Big), \qquad g(s) = \ln(1 + s),

X being the placements that `PlacementProblem` allows: number, budget, one sensor per position, mandatory and forbidden
places, least distance. g is concave, so that the objective is monotone and submodular: each further return is worth
less than the one before.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...arrays import Boolean, Float, Integer
from ...errors import SeipError
from .constraints import Constrained, constraints_of, superfluous
from .problem import TIE_TOLERANCE, PlacementProblem, canonical_order

_ROWS_AT_ONCE = 32


@dataclass(frozen=True, eq=False, kw_only=True)
class ReturnsInstance(Constrained):
    """A placement problem by expected returns: c candidates in canonical order, m road users, g mandatory groups.

    It adds these parameters to those of `Constrained`.

    Parameters
    ----------
    returns : (c, m) float32
        R, the expected returns of each candidate from each road user.
    weight : (m,) float64
        w, the weights of the road users, which add up to 1.
    """

    rows = (*Constrained.rows, "returns")

    returns: NDArray[np.float32]
    weight: Float

    @property
    def margin(self) -> float:
        """Largest difference between equal values."""
        return TIE_TOLERANCE

    def together(self, chosen: Integer) -> Float:
        """Return the expected returns of chosen candidates together from each road user, (m,) float64."""
        sums: Float = self.returns[chosen].sum(axis=0, dtype=np.float64)
        return sums

    def value(self, chosen: Integer) -> float:
        """Return the objective of chosen candidates: the weighted mean of ln(1 + returns)."""
        return float(self.weight @ np.log1p(self.together(chosen)))

    def added(self, base: Float, among: Integer | None = None) -> Float:
        """Return the gain on top of returns ``base`` by each candidate, (c,) float64, or by those ``among``, (k,)."""
        among = np.arange(len(self)) if among is None else among
        gained = np.empty(len(among))
        scale = 1.0 / (1.0 + base)
        for part in row_blocks(len(among)):
            rows = self.returns[among[part]] * scale
            gained[part] = np.log1p(rows, out=rows) @ self.weight
        return gained


def row_blocks(rows: int) -> Iterator[slice]:
    """Yield slices of rows that fit into a processor's cache together."""
    for begin in range(0, rows, _ROWS_AT_ONCE):
        yield slice(begin, begin + _ROWS_AT_ONCE)


def make_returns_instance(problem: PlacementProblem, returns: NDArray[np.float32]) -> ReturnsInstance:
    """Reduce a problem to the candidates and road users that matter.

    The instance leaves out road users without weight or without returns, candidates without returns that serve no
    mandatory group, and dominated candidates: those for which another one at the same position has at least the same
    returns from every road user, serves the same groups and costs no more.

    Parameters
    ----------
    problem : PlacementProblem
        Problem whose weights are those of the road users; its ``visible`` is not used.
    returns : (c, m) float

    Raises
    ------
    SeipError
        No candidate has returns from a road user with weight.
    """
    order = canonical_order(problem)
    order = order[problem.allowed[order]]
    met = np.flatnonzero((problem.weights > 0) & (returns[order] > 0).any(axis=0))
    if not len(met):
        raise SeipError(
            "no candidate has returns from any road user; try other heights or sensor types, or remove obstacles"
        )
    instance = ReturnsInstance(
        returns=np.ascontiguousarray(returns[np.ix_(order, met)], dtype=np.float32),
        weight=problem.weights[met] / problem.weights.sum(),
        **constraints_of(problem, order),
    )
    meets = (instance.returns > 0).any(axis=1)
    needed = ~superfluous(instance, problem.positions[order], meets, lambda some: _no_more(instance.returns[some]))
    return instance.of(np.flatnonzero(needed))


def _no_more(returns: NDArray[np.float32]) -> Boolean:
    """Return for each pair of rows whether the first has no more returns from anyone than the second, (k, k) bool."""
    return np.stack([(returns <= row).all(axis=1) for row in returns], axis=1)
