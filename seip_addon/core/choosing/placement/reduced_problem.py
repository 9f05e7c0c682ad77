"""Reduced placement problem that all algorithms work on: sorted candidates, merged targets, none dominated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Boolean, Float, Integer
from ...errors import SeipError
from .constraints import Constrained, constraints_of, subsets, superfluous
from .multi_cover import COVERAGE, MultiCover
from .problem import TIE_TOLERANCE, PlacementProblem, canonical_order

MAX_EXACT_DOUBLE = 2**53  # sums of whole numbers up to here are exact in double precision
MAX_EXACT_SINGLE = 2**24  # sums of whole numbers up to here are exact in single precision, in any order

INCOMMENSURABLE_TOTAL = 2**50
"""Total of weights that have no common unit: sums stay exact in double precision, rounding below `TIE_TOLERANCE`."""

WHOLE_SLACK = 0.25  # whole weights differ by one or not at all
BOUND_ROUNDING = 1e-11  # share of all weight by which rounding may move a sum in double precision, with room to spare
MAX_BINARY_PARTS = 1024  # binary fractions up to this are taken as the unit of weights: halves, quarters, ...
DENOMINATORS = range(1, 13)  # a common unit of all weights is sought among these parts of the smallest one


Numbers = NDArray[np.floating[Any]]


@dataclass(frozen=True, eq=False, kw_only=True)
class Instance(Constrained):
    """A reduced maximal covering instance: c candidates in canonical order, t merged targets, g mandatory groups.

    It adds these parameters to those of `Constrained`.

    Parameters
    ----------
    visible : (c, t) bool
        No column is empty and no two are equal.
    weight : (t,) float64
        Weights of the merged targets: whole numbers, so that sums are exact and ties are ties on every machine.
    step : float
        A placement is proven optimal where none covers more by this: one unit of weight, or half of ``slack``.
    slack : float
        Covered weights that differ by no more are equal. Weights with a common unit are compared exactly (``slack`` is
        less than one unit); without one, this is `TIE_TOLERANCE` of the weight that the candidates together see.
    margin : float
        Rounding error that the bound of a relaxation may have.
    cover : MultiCover
        Value of a unit of weight by the number of sensors that see it.
    """

    rows = (*Constrained.rows, "visible")

    visible: Boolean
    weight: Float
    step: float
    slack: float
    margin: float
    cover: MultiCover = COVERAGE

    @cached_property
    def matrix(self) -> Numbers:
        """``visible`` as numbers, in the smallest precision in which products with increments are exact."""
        return self.visible.astype(np.float32 if self.total < MAX_EXACT_SINGLE else np.float64)

    @cached_property
    def seen_by(self) -> tuple[Integer, Integer]:
        """Candidates that see each target: the index of each target's first one (t + 1,), and their list (n,) int64."""
        target, candidate = np.nonzero(self.visible.T)
        number = np.bincount(target, minlength=len(self.weight))
        return np.concatenate(([0], np.cumsum(number))), candidate

    @cached_property
    def total(self) -> float:
        """Value of all targets if each is seen by enough sensors."""
        return float(self.weight.sum()) * self.cover.unit

    def attainable(self, goal: float) -> float:
        """Return the smallest covered weight of at least ``goal`` that a placement can have at all."""
        return math.ceil(goal - self.slack) if self.step == 1 else goal

    def as_good(self, value: float) -> float:
        """Return the smallest covered weight that is equal to ``value``, ties included."""
        return self.attainable(value - self.slack)

    def attained(self, bound: float) -> float:
        """Return the largest covered weight up to ``bound`` that a placement can have at all."""
        return math.floor(bound + self.margin) if self.step == 1 else bound

    def times(self, chosen: Integer | Sequence[int]) -> Integer:
        """Return how many of the chosen candidates see each target, (t,) int64."""
        seen: Integer = self.visible[np.asarray(chosen, dtype=np.int64)].sum(axis=0, dtype=np.int64)
        return seen

    def increments(self, times: Integer, level: int = 0) -> Float:
        """Return the increment by the next sensor on targets seen ``times`` times (`MultiCover.increment`)."""
        more: Float = self.weight * self.cover.increment(times, level)
        return more

    def layers(self, times: Integer, left: int) -> Float:
        """Return the increment by each of the next ``left`` sensors on targets seen ``times`` times, (top, t)."""
        return np.stack([(level < left) * self.increments(times, level) for level in range(self.cover.top)])

    @property
    def unseen_layers(self) -> Float:
        """Increments by each of the sensors on targets that are not seen yet, (top, t) float64."""
        return self.layers(np.zeros(len(self.weight), dtype=np.int64), self.count)

    def gains(self, per_target: Float) -> Float:
        """Return the sum over each candidate's visible targets of increments per target, exactly, (c, ...) float64.

        Parameters
        ----------
        per_target : (t, ...) float64
        """
        gained: Float = (self.matrix @ per_target.astype(self.matrix.dtype)).astype(np.float64)
        return gained

    def value(self, chosen: Integer) -> float:
        """Return the value of the targets that the chosen candidates see: for `COVERAGE`, the covered weight."""
        return float(self.weight @ self.cover.value(self.times(chosen)))

    def doubly(self, chosen: Integer) -> float:
        """Return the weight that two or more of the chosen candidates cover."""
        return float(self.weight[self.visible[chosen].sum(axis=0) > 1].sum())

    def part(self, keep: Integer) -> Instance:
        """Return the same instance with only the candidates ``keep``, and with its targets merged again."""
        visible, weight = merge_targets(self.visible[keep], self.weight)
        return replace(self.of(keep), visible=visible, weight=weight)


def make_instance(problem: PlacementProblem) -> tuple[Instance, float]:
    """Reduce a problem, and return it with the factor that scaled its weights.

    Raises
    ------
    SeipError
        No candidate sees any target of positive weight.

    Examples
    --------
    A lamp, and a mast with two heights, of which the higher one sees nothing more and is left out. The same candidates
    see the first two targets, which are merged. Weights become whole numbers.

    >>> problem = PlacementProblem(
    ...     visible=np.array([[1, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]], dtype=bool),
    ...     weights=np.array([0.5, 0.5, 1.0, 2.0]),
    ...     prices=np.full(3, 9000.0),
    ...     positions=np.array([0, 1, 1]),
    ...     xyz=np.array([[0.0, 6.0, 5.0], [30.0, 6.0, 5.0], [30.0, 6.0, 8.0]]),
    ...     labels=np.array(["os1_128"] * 3),
    ...     count=1,
    ... )
    >>> instance, factor = make_instance(problem)
    >>> instance.visible.tolist(), instance.weight.tolist(), factor
    ([[False, True], [True, False]], [6.0, 2.0], 2.0)
    >>> instance.value(np.array([1])) / factor
    3.0
    """
    order = canonical_order(problem)
    order = order[problem.allowed[order]]
    seen = problem.visible[order].any(axis=0) & (problem.weights > 0)
    if not seen.any():
        raise SeipError(
            "no candidate sees any target; try other heights or sensor types, a larger δ, a lower probability of "
            "detection or better weather, or remove obstacles"
        )
    unit, whole = common_unit(problem.weights[seen])
    visible, weight = merge_targets(problem.visible[order][:, seen], np.rint(problem.weights[seen] / unit))
    total = float(weight.sum())
    slack = min(TIE_TOLERANCE * total, WHOLE_SLACK) if whole else TIE_TOLERANCE * total
    instance = Instance(
        visible=visible,
        weight=weight,
        step=1.0 if whole else slack / 2,
        slack=slack,
        margin=BOUND_ROUNDING * total,
        **constraints_of(problem, order),
    )
    sees = instance.visible.any(axis=1)
    needed = ~superfluous(instance, problem.positions[order], sees, lambda some: subsets(instance.visible[some]))
    return instance.part(np.flatnonzero(needed)), 1 / unit


def common_unit(weights: Float) -> tuple[float, bool]:
    """Return a unit in which all weights are whole numbers, and whether it is a common unit or only a fine grain.

    It is a common unit if all weights are whole numbers, or binary fractions, whose sum is exact in double precision;
    or if rounding all weights to its multiples moves no sum of them by more than `TIE_TOLERANCE` and one unit is more
    than that.

    Parameters
    ----------
    weights : (t,) float64
        Positive.
    """
    total = math.fsum(weights)
    parts = max(weight.as_integer_ratio()[1] for weight in np.unique(weights).tolist())  # each a power of two
    if parts <= MAX_BINARY_PARTS and total * parts <= MAX_EXACT_DOUBLE:
        return float(np.gcd.reduce((weights * parts).astype(np.int64))) / parts, True
    for share in DENOMINATORS:
        unit = float(weights.min()) / share
        rounding = math.fsum(np.abs(weights - np.rint(weights / unit) * unit))
        if unit > 4 * TIE_TOLERANCE * total and rounding <= TIE_TOLERANCE / 2 * total:
            return unit, True
    return total / INCOMMENSURABLE_TOTAL, False


def merge_targets(visible: Boolean, weight: Float) -> tuple[Boolean, Float]:
    """Merge targets that the same candidates see and drop those that none sees.

    Parameters
    ----------
    visible : (c, t) bool
    weight : (t,) float64
        Whole numbers.

    Returns
    -------
    (c, m) bool, (m,) float64
        Distinct columns in ascending order, and the summed weight of each.
    """
    seen = np.flatnonzero(visible.any(axis=0) & (weight > 0))
    visible, weight = np.take(visible, seen, axis=1), weight[seen]
    if len(seen) == 0:
        return visible, weight
    packed = np.ascontiguousarray(np.packbits(visible, axis=0).T)
    keys = packed.view(np.dtype((np.void, packed.shape[1])))[:, 0]
    _, first, group = np.unique(keys, return_index=True, return_inverse=True)
    merged: Boolean = np.take(visible, first, axis=1)  # indexed, it would hold the rows of targets together in memory
    return merged, np.bincount(group, weight).astype(np.float64)
