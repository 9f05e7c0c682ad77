"""Reduced placement problem that all algorithms work on: sorted candidates, none of them dominated, merged targets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Boolean, Float, Integer
from ...base.errors import SeipError
from .concave import ConcaveSum, Steps
from .problem import TIE_TOLERANCE, PlacementProblem, canonical_order
from .risk import NOMINAL, Risk

MICROMETRE = 1e-6  # metres; posts may be closer than the minimum distance by less than this, as positions are rounded
MAX_EXACT = 2.0**52  # sums of whole numbers up to here are exact in double precision
MAX_SINGLE_TOTAL = 20_000.0  # total of whole weights up to which single precision tells sums apart
MAX_DOUBLE = 20_000_000  # entries of A up to which several blocks together are kept in double precision
WHOLE_SLACK = 0.25  # whole weights differ by one or not at all
BINARY_PARTS = 16  # whole numbers, halves and so on up to this have a common unit


@dataclass(frozen=True, eq=False, kw_only=True)
class Instance:
    """A reduced placement problem: c candidates in canonical order, g mandatory groups, K blocks of targets.

    Parameters
    ----------
    price : (c,) float64, dollars
    conflict : (c, c) bool
        Pairs that exclude each other: same position, or too close. The diagonal is false.
    clique : (c,) int64
        Clique of each candidate, in a partition into sets of which at most one candidate can be chosen. Without a
        minimum distance these are the positions.
    mandatory : (g, c) bool
    original : (c,) int64
        Index of each candidate in the problem.
    count : int
        Largest number of sensors.
    budget : float, dollars
        Largest total price; infinite where there is no budget.
    blocks : tuple of ConcaveSum
        The sum F of each scenario.
    risk : Risk
        Risk measure over the blocks, and failure after which each is measured.
    unit : float
        Weight in the problem of one unit of weight in the instance.
    slack : float
        Values that differ by no more are equal.
    step : float
        A better placement is better by at least this.
    """

    price: Float
    conflict: Boolean
    clique: Integer
    mandatory: Boolean
    original: Integer
    count: int
    budget: float
    blocks: tuple[ConcaveSum, ...]
    risk: Risk
    unit: float
    slack: float
    step: float

    def __len__(self) -> int:
        """Return the number of candidates."""
        return len(self.price)

    def of(self, keep: Integer) -> Instance:
        """Return the same instance with only the candidates ``keep``."""
        return replace(
            self,
            **{name: getattr(self, name)[keep] for name in ("price", "clique", "original")},
            conflict=self.conflict[np.ix_(keep, keep)],
            mandatory=self.mandatory[:, keep],
            blocks=tuple(block.of(keep) for block in self.blocks),
        )

    @property
    def update_operations(self) -> float:
        """Number of multiplications that take as long as all gains, after those of a similar choice."""
        return sum(block.update_operations for block in self.blocks)

    @property
    def is_plain(self) -> bool:
        """Whether the objective is the value of a single block without failures."""
        return len(self.blocks) == 1 and self.risk.failure == "none"

    def affordable(self, price: Float | float) -> Boolean | bool:
        """Return whether a total price is within the budget, except for rounding."""
        return price <= self.budget * (1 + TIE_TOLERANCE)

    def feasible(self, chosen: Integer) -> bool:
        """Return whether the chosen candidates meet every constraint."""
        return bool(
            len(chosen) <= self.count
            and self.affordable(math.fsum(self.price[chosen]))
            and not self.conflict[np.ix_(chosen, chosen)].any()
            and self.mandatory[:, chosen].any(axis=1).all()
        )

    def addable(self, chosen: Integer) -> Boolean:
        """Return which candidates can join the chosen ones, and leave room for the mandatory groups, (c,) bool."""
        if len(chosen) >= self.count:
            return np.zeros(len(self), bool)
        room: Boolean = ~self.conflict[chosen].any(axis=0)
        room[chosen] = False
        unserved = self.mandatory[~self.mandatory[:, chosen].any(axis=1)]
        room &= len(unserved) - unserved.sum(axis=0) < self.count - len(chosen)
        least = np.array([self.price[group].min() for group in unserved])
        room &= self.affordable(math.fsum(self.price[chosen]) + self.price + least @ ~unserved)
        return room

    def gains(self, chosen: Integer) -> Float:
        """Return what each candidate adds to the chosen ones, the mean of the blocks without failures, (c,)."""
        gains = [block.gains(block.together(chosen)) for block in self.blocks]
        mean: Float = np.mean(gains, axis=0)
        return mean

    def value(self, chosen: Integer) -> float:
        """Return the objective value of chosen candidates, in units of the instance."""
        return self.risk.of(np.array([self._outcome(block, chosen) for block in self.blocks]))

    def values_with(self, chosen: Integer) -> Float:
        """Return the objective value of the chosen candidates together with each other one, (c,) float64.

        Rounding errors are those of `ConcaveSum.gains`.
        """
        outcomes = [self._outcomes_with(block, chosen) for block in self.blocks]
        return outcomes[0] if len(outcomes) == 1 else self.risk.of_each(np.stack(outcomes))

    def _outcome(self, block: ConcaveSum, chosen: Integer) -> float:
        """Return the value of a block after the failure of one sensor."""
        base = block.together(chosen)
        whole = block.value_at(base)
        if self.risk.failure == "none":
            return whole
        left = np.array([block.value_at(base - block.amounts[one]) for one in chosen])
        return float(self.risk.after_failure(whole, left, self.count))

    def _outcomes_with(self, block: ConcaveSum, chosen: Integer) -> Float:
        """Return the value of a block after the failure of one of the chosen sensors and one more, (c,)."""
        base = block.together(chosen)
        value = block.value_at(base)
        whole = value + block.gains(base)
        if self.risk.failure == "none":
            return whole
        rests = [base - block.amounts[one] for one in chosen]
        left = [block.value_at(rest) + block.gains(rest) for rest in rests]
        return self.risk.after_failure(whole, np.stack([*left, np.full(len(self), value)]), self.count)

    def relaxed(self, shares: Float) -> ConcaveSum:
        """Return a sum that is nowhere below the objective: the mean of the blocks by shares (K,) that add up to 1.

        Any shares of at most 1/m give a bound on the mean of the m worst of K outcomes. After a failure the value of a
        target by the number of sensors that see it is that of the mean over failures, which the worst one does not
        exceed; for other functions than `Steps` the bound is that without failures.
        """
        used = np.flatnonzero(shares)
        blocks = [self.blocks[k] for k in used]
        if len(blocks) == 1 and self.risk.failure == "none":
            only: ConcaveSum = blocks[0]
            return only
        weight: Float = np.concatenate([shares[k] * self.blocks[k].weight for k in used])
        amounts = np.concatenate([block.amounts for block in blocks], axis=1)
        g = blocks[0].g
        if isinstance(g, Steps):
            amounts, weight = _merged(amounts > 0, weight)
            if self.risk.failure != "none":
                weight, g = weight / self.count, Steps((self.count - 1.0, 1.0))
        relaxed: ConcaveSum = g.sum_over(amounts, weight, single=amounts.size > MAX_DOUBLE)
        return relaxed


def make_instance(
    problem: PlacementProblem, cases: Sequence[NDArray[Any]] | None = None, risk: Risk = NOMINAL
) -> Instance:
    """Reduce a problem to the candidates and targets that matter.

    It leaves out targets without weight, or without amounts from any candidate; and candidates that serve no mandatory
    group and add nothing, or for which another one at the same position adds no less anywhere, serves the same groups,
    excludes nothing more and costs no more.

    Parameters
    ----------
    cases : sequence of (c, t) arrays, optional
        Amounts in each scenario; by default the problem's are the only ones.

    Raises
    ------
    SeipError
        No candidate adds anything.
    """
    order = canonical_order(problem)
    order = order[problem.allowed[order]]
    unit, whole = common_unit(problem.weights[problem.weights > 0]) if isinstance(problem.g, Steps) else (1.0, False)
    weights = np.rint(problem.weights / unit) if whole else problem.weights / unit
    parts = [_merged(amounts[order], weights) for amounts in (cases or [problem.amounts])]
    if not any(len(weight) for _, weight in parts):
        raise SeipError(problem.nothing_added)
    conflict = _conflicts(problem.positions[order], problem.xyz[order], problem.min_distance)
    mandatory = problem.mandatory_groups[:, order]
    needed = _needed(problem, order, np.concatenate([amounts for amounts, _ in parts], axis=1), conflict, mandatory)
    # after reductions the same columns may be equal again: they are merged once more
    parts = [_merged(amounts[needed], weight) for amounts, weight in parts]
    total = max(float(weight.sum()) for _, weight in parts)
    slack = WHOLE_SLACK if whole else TIE_TOLERANCE * total
    exact = whole and len(parts) == 1 and risk.failure != "mean"
    if whole and not exact:
        slack = min(TIE_TOLERANCE * total, WHOLE_SLACK / (risk.counted(len(parts)) * problem.most_sensors))
    # of several blocks only the search needs gains, and it evaluates each placement exactly
    single = len(parts) > 1 or (exact and total <= MAX_SINGLE_TOTAL)
    return Instance(
        price=problem.prices[order[needed]],
        conflict=conflict[np.ix_(needed, needed)],
        clique=_cliques(conflict[np.ix_(needed, needed)]),
        mandatory=mandatory[:, needed],
        original=order[needed],
        count=problem.most_sensors,
        budget=math.inf if problem.budget is None else float(problem.budget),
        blocks=tuple(problem.g.sum_over(amounts, weight, single=single) for amounts, weight in parts),
        risk=risk,
        unit=unit,
        slack=slack,
        step=1.0 if exact else slack,
    )


def common_unit(weights: Float) -> tuple[float, bool]:
    """Return a unit in which all weights are whole numbers, and whether there is one; otherwise the unit is 1.

    Parameters
    ----------
    weights : (n,) float64
        Positive.
    """
    parts = weights * BINARY_PARTS
    if math.fsum(weights) * BINARY_PARTS <= MAX_EXACT and np.array_equal(np.rint(parts), parts):
        return float(np.gcd.reduce(parts.astype(np.int64))) / BINARY_PARTS, True
    return 1.0, False


def _merged(amounts: NDArray[Any], weight: Float) -> tuple[NDArray[Any], Float]:
    """Drop targets without weight or amounts; merge those that the same candidates see, (c, m) and (m,)."""
    used = np.flatnonzero((weight > 0) & (amounts > 0).any(axis=0))
    amounts, weight = amounts[:, used], weight[used]
    if amounts.dtype != bool or not len(used):
        return amounts, weight
    packed = np.ascontiguousarray(np.packbits(amounts, axis=0).T)
    keys = packed.view(np.dtype((np.void, packed.shape[1])))[:, 0]
    _, first, group = np.unique(keys, return_index=True, return_inverse=True)
    return amounts[:, first], np.bincount(group.ravel(), weight).astype(np.float64)


def _conflicts(positions: Integer, xyz: Float, min_distance: float) -> Boolean:
    """Return the pairs of candidates at one position, or closer in plan than the minimum distance, (c, c) bool."""
    conflict: Boolean = positions[:, None] == positions[None, :]
    if min_distance > 0:
        for index, xy in enumerate(xyz[:, :2]):
            conflict[index] |= np.hypot(*(xyz[:, :2] - xy).T) < min_distance - MICROMETRE
    np.fill_diagonal(conflict, val=False)
    return conflict


def _cliques(conflict: Boolean) -> Integer:
    """Partition the candidates into sets whose members all exclude each other, grown greedily in order, (c,) int64."""
    clique = np.full(len(conflict), -1)
    for first in range(len(conflict)):
        if clique[first] < 0:
            members = [first]
            common = conflict[first] & (clique < 0)
            while common.any():
                members.append(int(np.argmax(common)))
                common &= conflict[members[-1]]
            clique[members] = first
    numbered: Integer = np.unique(clique, return_inverse=True)[1]
    return numbered


def _needed(
    problem: PlacementProblem, order: Integer, amounts: NDArray[Any], conflict: Boolean, mandatory: Boolean
) -> Integer:
    """Return the candidates, as indices into an order, that `make_instance` keeps."""
    drop: Boolean = ~(amounts > 0).any(axis=1) & ~mandatory.any(axis=0)
    excluded = conflict | np.eye(len(order), dtype=bool)
    positions, price = problem.positions[order], problem.prices[order]
    total = amounts.sum(axis=1, dtype=np.float64)
    by_position = np.argsort(positions, kind="stable")
    for group in np.split(by_position, np.flatnonzero(np.diff(positions[by_position])) + 1):
        rank = np.lexsort((group, price[group])).argsort()
        for own, candidate in enumerate(group):
            others = group[(rank < rank[own]) & (total[group] >= total[candidate] * (1 - TIE_TOLERANCE))]
            covered = (amounts[others] >= amounts[candidate]).all(axis=1)
            covered &= (mandatory[:, others] >= mandatory[:, [candidate]]).all(axis=0)
            covered &= (excluded[others] <= excluded[candidate]).all(axis=1)
            drop[candidate] |= covered.any()
    return np.flatnonzero(~drop)
