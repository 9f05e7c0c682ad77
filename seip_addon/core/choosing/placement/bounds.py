r"""Upper bounds on placements by linear bounds on their concave values.

`ConcaveSum.bound` is linear in the sensors: a constant and a score of each candidate. The largest sum of scores within
the number of sensors and a partition into cliques is a matter of sorting; the budget is relaxed with a multiplier μ,

.. math::
    \max_{x \in X} F(x) \le \sum_t w_t C_t + μ B + \max_{x \in X'} \sum_i (s_i - μ p_i) x_i .

Each choice of parameters gives an upper bound. Subgradient steps lead to a small one (Polyak 1969; deflected steps:
Camerini, Fratta and Maffioli 1975).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ...base.arrays import Boolean, Float, Integer
from .concave import ConcaveSum
from .instance import Instance
from .problem import TIE_TOLERANCE

DEFLECTION = 0.7  # part of the last direction that a step keeps: successive subgradients nearly cancel
PATIENCE, STEP_REDUCTION = 10, 0.6  # steps without a smaller bound, and the factor of the step length then
MIN_STEP = 1e-3  # length of a step at which the descent ends
FACTORS = (0.8, 0.95, 1.0, 1.05, 1.25)  # factors by which the budget's multiplier may change in a step
MAX_PRICES, MAX_COMPOSITIONS = 3, 30  # different prices, and numbers of each, that are bounded separately at most


@dataclass(frozen=True, eq=False)
class Selection:
    """The candidates of largest summed scores.

    Parameters
    ----------
    value : float
        Upper bound on the summed scores of any placement.
    picked : (k,) int64
        Candidates that reach it; their price may exceed the budget.
    net : (c,) float64
        Scores less the multiplier times the price.
    multiplier : float
        Multiplier of the budget.
    weakest : (c,) float64
        Net score that each candidate would replace at least: the smallest one picked, or 0 where there is room.
    """

    value: float
    picked: Integer
    net: Float
    multiplier: float
    weakest: Float


@dataclass(frozen=True, eq=False)
class Bound:
    """An upper bound, and the parameters that prove it.

    Parameters
    ----------
    value : float
        Upper bound on the objective value of any placement.
    parameters : (t,) float64
    selection : Selection
    step : float
        Length of the step that led to it, as a share of the distance to the goal.
    """

    value: float
    parameters: Float
    selection: Selection
    step: float = 1.0

    @property
    def constant(self) -> float:
        """Part of the bound that does not depend on the candidates, to which their net scores are added."""
        return self.value - math.fsum(self.selection.net[self.selection.picked])

    def forced(self) -> Float:
        """Return upper bounds on placements with each candidate, (c,) float64 (reduced costs)."""
        forced: Float = self.value + np.minimum(self.selection.net - self.selection.weakest, 0.0)
        return forced


@dataclass(frozen=True, eq=False)
class Rest:
    """Constraints on further sensors where some are chosen: the part of an `Instance` that a `Selection` respects.

    Parameters
    ----------
    price : (c,) float64
    clique : (c,) int64
    kind : (c,) int64
        Kind of each candidate, from 0 on: its price, where a composition is given.
    groups : (g, c) bool
        Mandatory groups without a chosen sensor. No candidate is in two of them.
    quota : tuple of int
        Largest number of further sensors of each kind.
    count : int
        Largest number of further sensors.
    budget : float
        Largest price of further sensors; infinite where the quotas keep the budget.
    """

    price: Float
    clique: Integer
    kind: Integer
    groups: Boolean
    quota: tuple[int, ...]
    count: int
    budget: float

    def select(self, score: Float, near: float = 0.0) -> Selection:
        """Select the candidates of largest scores.

        The budget's multiplier minimises the bound by bisection, or is the best of a few near the one given.
        """
        free = self._select(score, 0.0)
        if math.isinf(self.budget) or self.price[free.picked].sum() <= self.budget:
            return free
        if near > 0:
            return min((self._select(score, near * factor) for factor in FACTORS), key=lambda choice: choice.value)
        # The bound is convex in the multiplier, and its slope is the budget less the price of the selection. At the
        # largest ratio of score to price nothing that costs anything is picked. Each trial is a valid bound.
        priced = self.price > 0
        low, high = 0.0, float((score[priced] / self.price[priced]).max())
        best = self._select(score, high)
        for _ in range(30):
            middle = (low + high) / 2
            trial = self._select(score, middle)
            best = min(best, trial, key=lambda choice: choice.value)
            low, high = (middle, high) if self.price[trial.picked].sum() > self.budget else (low, middle)
        return best

    def _select(self, score: Float, multiplier: float) -> Selection:
        """Return the selection at a multiplier of the budget, by sorting."""
        net = score - multiplier * self.price if multiplier else score
        # The best member of each group is picked in any case. A placement has a member of each, and what else it has
        # is at most the largest net scores of as many other cliques; the clique of a group of one clique is taken.
        forced = [int(np.argmax(np.where(group, net, -np.inf))) for group in self.groups]
        taken = [self.clique[one] for group, one in zip(self.groups, forced, strict=True) if self._is_single(group)]
        best_first = np.argsort(-net, kind="stable")
        best_first = best_first[net[best_first] > 0]
        if forced:
            best_first = best_first[~np.isin(self.clique[best_first], taken) & ~np.isin(best_first, forced)]
        picked, weakest = [np.array(forced, dtype=np.int64)], np.zeros(len(self.quota))
        for kind, quota in enumerate(self.quota):
            own = best_first[self.kind[best_first] == kind] if len(self.quota) > 1 else best_first
            heads = own[np.sort(np.unique(self.clique[own], return_index=True)[1])][:quota]
            picked.append(heads)
            if quota and len(heads) == quota:
                weakest[kind] = net[heads[-1]]
        every = np.concatenate(picked)
        if len(every) > self.count:
            free = every[len(forced) :]
            free = free[np.argsort(-net[free], kind="stable")][: max(0, self.count - len(forced))]
            every = np.concatenate([every[: len(forced)], free])
        if forced or len(every) < sum(map(len, picked)):
            weakest[:] = min(0.0, *net[every].tolist()) if len(every) < self.count else float(net[every].min())
        value = math.fsum(net[every]) + (multiplier * self.budget if multiplier else 0.0)
        return Selection(value, every, net, multiplier, weakest[self.kind])

    def _is_single(self, group: Boolean) -> bool:
        return bool(np.ptp(self.clique[group]) == 0)


def rest_of(instance: Instance, chosen: Integer, left: Integer, composition: Composition | None = None) -> Rest:
    """Return the constraints on candidates ``left`` after some are chosen, within a composition if one is given."""
    unserved = instance.mandatory[~instance.mandatory[:, chosen].any(axis=1)][:, left]
    groups: list[Boolean] = []
    for group in unserved:  # some of the groups, disjoint from each other
        if group.any() and not any((group & other).any() for other in groups):
            groups.append(group)
    count = instance.count - len(chosen)
    spent = math.fsum(instance.price[chosen])
    quota: tuple[int, ...] = (count,)
    kind, budget = np.zeros(len(left), dtype=np.int64), instance.budget * (1 + TIE_TOLERANCE) - spent
    if composition is not None:
        used = np.bincount(composition.kind[chosen], minlength=len(composition.quota))
        quota = tuple(int(most - own) for most, own in zip(composition.quota, used, strict=True))
        kind, budget, count = composition.kind[left], math.inf, min(count, sum(quota))
    return Rest(
        price=instance.price[left],
        clique=instance.clique[left],
        kind=kind,
        groups=np.array(groups, dtype=bool).reshape(len(groups), len(left)),
        quota=quota,
        count=count,
        budget=budget,
    )


@dataclass(frozen=True, eq=False)
class Composition:
    """Numbers of sensors of each price.

    Parameters
    ----------
    kind : (c,) int64
        Number of the price of each candidate of an instance.
    quota : tuple of int
        Largest number of sensors of each price.
    """

    kind: Integer
    quota: tuple[int, ...]


def compositions(instance: Instance) -> list[Composition]:
    """Return compositions, one of which each placement keeps to; none without a budget or if there are many.

    Under a budget the bound of each composition by itself is smaller than that with a multiplier, which mixes them.
    """
    prices, kind = np.unique(instance.price, return_inverse=True)
    if math.isinf(instance.budget) or len(prices) > MAX_PRICES or prices[0] <= 0:
        return []
    budget = instance.budget * (1 + TIE_TOLERANCE)
    dear = np.array(list(itertools.product(range(instance.count + 1), repeat=len(prices) - 1)), dtype=np.int64)
    left = budget - dear @ prices[1:]
    cheap = np.minimum((left // prices[0]).astype(np.int64), instance.count - dear.sum(axis=1))
    full = [(int(number), *map(int, others)) for number, others in zip(cheap, dear, strict=True) if number >= 0]
    full = [one for one in full if np.dot(one, prices) <= budget]
    kept = [one for one in full if not any(_within(one, other) for other in full)]
    return [Composition(kind, one) for one in kept] if len(kept) <= MAX_COMPOSITIONS else []


def _within(one: tuple[int, ...], other: tuple[int, ...]) -> bool:
    """Return whether another composition has no fewer sensors of any price, and more of one."""
    return one != other and all(own <= more for own, more in zip(one, other, strict=True))


def bound_at(
    block: ConcaveSum, rest: Rest, base: Float, parameters: Float, rounding: float, near: float = 0.0
) -> Bound:
    """Return the bound for given parameters (t,); at the lowest ones it is that by gains (Leskovec et al. 2007)."""
    constant, score = block.bound(base, parameters)
    selection = rest.select(score, near)
    return Bound(constant + selection.value + rounding, parameters, selection)


def falling_bounds(
    block: ConcaveSum, rest: Rest, base: Float, start: Bound, goal: float, rounding: float
) -> Iterator[Bound]:
    """Yield the smallest bound so far after each subgradient step, without end until no step can lower it.

    Parameters
    ----------
    block : ConcaveSum
        Sum over the candidates that are left.
    rest : Rest
    base : (t,) float64
        Amounts of the chosen sensors.
    start : Bound
        Bound to begin from.
    goal : float
        Value that the bound need not fall below; steps are as long as if it could be reached.
    rounding : float
        Largest rounding error, by which bounds are raised.
    """
    best = current = start
    step, stale = start.step, 0
    direction: Float | float = 0.0
    while step >= MIN_STEP:
        slope = block.slope(base, current.parameters, current.selection.picked)
        # one step length for all targets: each counts as many times as its weight
        direction = slope + DEFLECTION * direction
        size = float(block.weight @ (direction * direction))
        if size == 0:
            return
        length = step * max(current.value - goal, 1e-6 * abs(current.value)) / size
        moved = block.clipped(base, current.parameters - length * direction)
        current = bound_at(block, rest, base, moved, rounding, current.selection.multiplier)
        stale += 1
        if current.value < best.value - 1e-7 * abs(best.value):
            best, stale = replace(current, step=step), 0
        elif stale == PATIENCE:
            step, stale, direction = step * STEP_REDUCTION, 0, 0.0
            current = best = replace(best, step=step)
        yield best
