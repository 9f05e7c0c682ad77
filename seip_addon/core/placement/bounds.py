r"""Upper bounds by Lagrangian relaxation, and the candidates that they rule out.

Relaxing :math:`y_j \le \sum_i V_{ij} x_i` with multipliers
:math:`0 \le \lambda_j \le w_j` leaves

.. math::
    L(\lambda) = \sum_j (w_j - \lambda_j) + \max_{x \in X} \sum_i s_i x_i,
    \qquad s_i = \sum_j V_{ij} \lambda_j,

where X keeps the number of sensors and a partition into cliques (one sensor at
most in each), and the budget and the mandatory groups are relaxed with
multipliers of their own. Every L is an upper bound; subgradients lead to the
smallest, which equals that of the linear relaxation (Galvão and ReVelle 1996;
deflected steps: Camerini, Fratta and Maffioli 1975).
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from ..arrays import Float, Integer
from ..progress import Progress
from .clock import Clock
from .instance import Instance

ITERATIONS = 1000
PATIENCE = 20
SHRINK = 0.7
DEFLECTION = 0.85
SMALLEST_STEP = 1e-3

REVIEW, WORTHWHILE = 25, 0.8
"""Every so many steps candidates are ruled out, where no more than such a share of them would be left."""

FEW = 10_000
"""The search ends when no more choices than these are left."""

NEAR = (0.8, 0.95, 1.0, 1.05, 1.25)
"""Factors by which the budget's multiplier may change in a step."""

PRICES = 200
"""Multipliers of the price that are tried for a bound on it."""


@dataclass(frozen=True, eq=False)
class Selection:
    """The best choice when candidates count for themselves alone.

    Parameters
    ----------
    value : float
        Upper bound on the summed scores of any placement.
    picked : (k,) int64
        Candidates that reach it, but for the budget.
    net : (c,) float64
        Scores less the multiplier's share of the price.
    multiplier : float
        Multiplier of the budget.
    """

    value: float
    picked: Integer
    net: Float
    multiplier: float


@dataclass(frozen=True, eq=False)
class Bound:
    """An upper bound and the multipliers that prove it.

    Parameters
    ----------
    value : float
        No placement covers more.
    targets : (t,) float64
        Multipliers of the targets.
    groups : (g,) float64
        Multipliers of the mandatory groups.
    selection : Selection
        The relaxed problem's solution.
    """

    value: float
    targets: Float
    groups: Float
    selection: Selection


def select(instance: Instance, score: Float, near: float = 0.0) -> Selection:
    """Choose the candidates of largest scores, one per clique, within the number and the budget.

    The budget is relaxed; its multiplier minimises the bound, by bisection,
    or is the best of a few near the one given.
    """
    free = _select(instance, score, 0.0)
    if instance.affordable(float(instance.price[free.picked].sum())):
        return free
    if near > 0:
        return min((_select(instance, score, near * factor) for factor in NEAR), key=lambda choice: choice.value)
    priced = instance.price > 0
    low, high = 0.0, float((score[priced] / instance.price[priced]).max())
    best = _select(instance, score, high)
    for _ in range(30):
        middle = (low + high) / 2
        trial = _select(instance, score, middle)
        if trial.value < best.value:
            best = trial
        if instance.price[trial.picked].sum() > instance.budget:
            low = middle
        else:
            high = middle
    return best


def bound_from(instance: Instance, targets: Float, groups: Float, *, exact: bool, near: float = 0.0) -> Bound:
    """Return the bound that some multipliers give, in double precision where ``exact``.

    The budget's multiplier is sought near the one given, if any.
    """
    if exact:
        score = np.concatenate([block @ targets for block in np.array_split(instance.visible, 16)])
    else:
        score = instance.gains(targets)
    selection = select(instance, score + groups @ instance.mandatory, near)
    total = math.fsum if exact else np.sum
    value = float(total(instance.weight - targets)) - math.fsum(groups) + selection.value
    return Bound(value, targets, groups, selection)


def lagrangian_bound(
    instance: Instance, goal: float, clock: Clock, start: Float | None = None, iterations: int = ITERATIONS
) -> Generator[Progress, None, tuple[Integer, Bound]]:
    """Search for multipliers with a small bound by deflected subgradients.

    Candidates that the bound rules out are left out of the steps that follow,
    which makes these shorter and the bound smaller.

    Parameters
    ----------
    goal : float
        Covered weight to reach; the search ends when the bound falls below.
    clock : Clock
        Ends the search when the time is up.
    start : (t,) float64, optional
        Multipliers of the targets to begin from.
    iterations : int
        At most so many steps.

    Yields
    ------
    Progress

    Returns
    -------
    (k,) int64
        Candidates that some placement covering ``goal`` may contain.
    Bound
        The best one found for placements of these, evaluated in double
        precision; where none is left, of those that were left last.
    """
    keep = np.arange(len(instance))
    targets = instance.weight / np.maximum(1, instance.visible.sum(axis=0)) ** 0.5 if start is None else start
    groups = np.zeros(len(instance.mandatory))
    # group multipliers live on the scale of scores, those of targets on that of weights
    stretch = instance.visible.sum() / len(instance) if len(groups) else 1.0
    best = bound_from(instance, targets, groups, exact=False)
    direction, group_direction = np.zeros(len(targets)), np.zeros(len(groups))
    step, stale = 1.0, 0
    current = best
    for iteration in range(iterations):
        if best.value < goal - instance.margin or step < SMALLEST_STEP or clock.left <= 0:
            break
        if iteration % REVIEW == REVIEW - 1 and len(can_reach(instance, best, goal)) <= WORTHWHILE * len(keep):
            within = can_reach(instance, bound_from(instance, best.targets, best.groups, exact=True), goal)
            if _few(instance, within):
                break
            keep, instance = keep[within], instance.of(within)
            targets, groups = best.targets, best.groups
            current = best = bound_from(instance, targets, groups, exact=False)
            direction[:], group_direction[:] = 0.0, 0.0
        yield Progress(iteration, iterations, "bounding what any placement can cover")
        clock.spend(2 * instance.visible.size)
        picked = current.selection.picked
        seen = instance.visible[picked].sum(axis=0)
        slope = np.where(targets < instance.weight, seen - 1.0, np.maximum(seen - 1.0, 0.0))
        direction = slope + DEFLECTION * direction
        group_direction = stretch * (instance.mandatory[:, picked].sum(axis=1) - 1.0) + DEFLECTION * group_direction
        size = float(direction @ direction + group_direction @ group_direction)
        if size == 0:
            break
        length = step * max(current.value - goal, 1e-6 * instance.total) / size
        targets = np.clip(targets - length * direction, 0.0, instance.weight)
        groups = np.maximum(groups - length * stretch * group_direction, 0.0)
        current = bound_from(instance, targets, groups, exact=False, near=current.selection.multiplier)
        if current.value < best.value - 1e-7 * instance.total:
            best, stale = current, 0
        else:
            stale += 1
            if stale == PATIENCE:
                step, stale = step * SHRINK, 0
                targets, groups, current = best.targets, best.groups, best
                direction[:], group_direction[:] = 0.0, 0.0
    best = bound_from(instance, best.targets, best.groups, exact=True)
    within = can_reach(instance, best, goal)
    if len(within):
        best = bound_from(instance.of(within), best.targets, best.groups, exact=True)
    return keep[within], best


def least_price(instance: Instance, bound: Bound, goal: float) -> float:
    r"""Return a price below which no placement covers ``goal``.

    With the bound's multipliers and a multiplier :math:`\mu > 0` of the
    price, a placement of price C covers at most :math:`L(\lambda, \mu) +
    \mu C`, so that :math:`C \ge (goal - L(\lambda, \mu)) / \mu`.
    """
    score = bound.selection.net + bound.selection.multiplier * instance.price
    fixed = bound.value - bound.selection.value
    worth = np.unique(score[instance.price > 0] / instance.price[instance.price > 0])
    worth = worth[worth > 0]
    tried = worth[np.linspace(0, len(worth) - 1, min(len(worth), PRICES)).astype(np.int64)]
    gained = [_select(instance, score, multiplier) for multiplier in tried]
    prices = [
        (goal - fixed - math.fsum(selection.net[selection.picked])) / selection.multiplier for selection in gained
    ]
    return max([0.0, *prices])


def can_reach(instance: Instance, bound: Bound, goal: float) -> Integer:
    """Return the candidates that some placement covering ``goal`` may contain, (k,) int64.

    A candidate is ruled out when the bound, with that candidate forced into
    the selection, falls short of the goal by more than `TIE`: all optimal
    placements survive, ties included.
    """
    picked, net = bound.selection.picked, bound.selection.net
    in_clique = np.zeros(int(instance.clique.max()) + 1)
    # what gives way: the clique's own pick, else the weakest pick when the number is used up
    in_clique[:] = net[picked].min() if len(picked) == instance.count else 0.0
    in_clique[instance.clique[picked]] = net[picked]
    forced = bound.value + np.minimum(net - in_clique[instance.clique], 0.0)
    return np.flatnonzero(forced >= goal - instance.margin)


def _few(instance: Instance, candidates: Integer) -> bool:
    return math.comb(len(candidates), min(instance.count, len(candidates) // 2)) <= FEW


def _select(instance: Instance, score: Float, multiplier: float) -> Selection:
    net = score - multiplier * instance.price if multiplier else score
    best_first = np.lexsort((-net, instance.clique))
    clique = instance.clique[best_first]
    heads = best_first[np.concatenate([[True], clique[1:] != clique[:-1]])]
    heads = heads[np.argsort(-net[heads], kind="stable")][: instance.count]
    picked = heads[net[heads] > 0]
    value = math.fsum(net[picked]) + (multiplier * instance.budget if multiplier else 0.0)
    return Selection(value, picked, net, multiplier)
