"""Constraints of a reduced placement problem, whatever its objective."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self, TypeVar

import numpy as np

from ...arrays import Boolean, Float, Integer
from .problem import TIE_TOLERANCE, PlacementProblem

MICROMETRE = 1e-6  # metres; posts may be closer than the minimum distance by less than this, as positions are rounded

Kind = TypeVar("Kind", bound="Constrained")


@dataclass(frozen=True, eq=False, kw_only=True)
class Constrained:
    """Base class of `Instance` and `ReturnsInstance`: c candidates, g mandatory groups and their constraints.

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
    """

    rows: ClassVar[tuple[str, ...]] = ("price", "clique", "original")
    """Fields with one row for each candidate."""

    price: Float
    conflict: Boolean
    clique: Integer
    mandatory: Boolean
    original: Integer
    count: int
    budget: float

    def __len__(self) -> int:
        """Return the number of candidates."""
        return len(self.price)

    def of(self, keep: Integer) -> Self:
        """Return the same instance with only the candidates ``keep``."""
        return replace(
            self,
            **{name: getattr(self, name)[keep] for name in self.rows},
            conflict=self.conflict[np.ix_(keep, keep)],
            mandatory=self.mandatory[:, keep],
        )

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


def constraints_of(problem: PlacementProblem, order: Integer) -> dict[str, Any]:
    """Return the fields of `Constrained` for the candidates of a problem in an order, by name."""
    conflict = conflicts(problem.positions[order], problem.xyz[order], problem.min_distance)
    return {
        "price": problem.prices[order],
        "conflict": conflict,
        "clique": cliques(conflict),
        "mandatory": problem.mandatory_groups[:, order],
        "original": order,
        "count": problem.most_sensors,
        "budget": math.inf if problem.budget is None else float(problem.budget),
    }


def conflicts(positions: Integer, xyz: Float, min_distance: float) -> Boolean:
    """Return the pairs of candidates at one position, or closer in plan than the minimum distance, (c, c) bool."""
    conflict: Boolean = positions[:, None] == positions[None, :]
    if min_distance > 0:
        for index, xy in enumerate(xyz[:, :2]):
            conflict[index] |= np.hypot(*(xyz[:, :2] - xy).T) < min_distance - MICROMETRE
    np.fill_diagonal(conflict, val=False)
    return conflict


def cliques(conflict: Boolean) -> Integer:
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


def superfluous(
    instance: Constrained, positions: Integer, useful: Boolean, no_more: Callable[[Integer], Boolean]
) -> Boolean:
    """Mark candidates that no canonical optimum contains, (c,) bool.

    A candidate that is of no use and serves no mandatory group only adds to the number of sensors. A candidate can be
    replaced by another one at the same position that is of at least the same use, is in at least the same groups,
    excludes nothing more, and is cheaper (or costs the same and comes first): value, number, price, double coverage
    and order all stay or improve.

    Parameters
    ----------
    positions : (c,) int64
        Position of each candidate.
    useful : (c,) bool
        Whether a candidate adds to the value of a placement.
    no_more : callable
        From indices of candidates (k,) to (k, k) bool, for each pair: whether the first adds no more than the second,
        whatever else is chosen.
    """
    out: Boolean = ~useful & ~instance.mandatory.any(axis=0)
    excluded = instance.conflict | np.eye(len(instance), dtype=bool)
    by_position = np.argsort(positions, kind="stable")
    for group in np.split(by_position, np.flatnonzero(np.diff(positions[by_position])) + 1):
        rank = np.lexsort((group, instance.price[group])).argsort()
        replaceable = (
            (rank[None, :] < rank[:, None])
            & no_more(group)
            & subsets(instance.mandatory[:, group].T)
            & subsets(excluded[group]).T
        )
        out[group] |= replaceable.any(axis=1)
    return out


def subsets(rows: Boolean) -> Boolean:
    """Return for each pair of rows whether the first is a subset of the second, (k, k) bool."""
    overlap = rows.astype(np.float32) @ rows.T.astype(np.float32)
    subset: Boolean = overlap == overlap.diagonal()[:, None]
    return subset
