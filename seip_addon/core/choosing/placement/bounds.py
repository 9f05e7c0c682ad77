r"""Upper bounds by Lagrangian relaxation, and the candidates that they rule out.

Let the i-th sensor that sees target j add at most :math:`a_{ji}` to the objective, :math:`a_{j1} \ge a_{j2} \ge …`; for
coverage :math:`a_{j1} = w_j` and the others are 0 (`multi_cover`). Relaxing the number of sensors that see a target
with multipliers :math:`0 \le \lambda_j \le a_{j1}` leaves

.. math::
    L(\lambda) = \sum_j \sum_i \max(0, a_{ji} - \lambda_j) + \max_{x \in X} \sum_i s_i x_i,
    \qquad s_i = \sum_j V_{ij} \lambda_j,

where X keeps the number of sensors and a partition into cliques (one sensor at most in each), and the budget and the
mandatory groups are relaxed with multipliers of their own. Every L is an upper bound; subgradients lead to the
smallest, which equals that of the linear relaxation (Galvão and ReVelle 1996; deflected steps: Camerini, Fratta and
Maffioli 1975).
"""

import math
from collections.abc import Generator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from ...arrays import Float, Integer
from ...progress import Progress
from .constraints import Constrained
from .reduced_problem import Instance
from .search_limits import Clock

MAX_ITERATIONS = 1000
PATIENCE = 20
STEP_REDUCTION = 0.7
DEFLECTION = 0.85
MIN_STEP = 1e-3

REDUCTION_INTERVAL, MAX_KEPT_SHARE = 25, 0.8
"""Steps between two reductions, and largest share of the candidates that may be left for a reduction to be worth it."""

AVERAGED_SHARE = 0.03  # weight of the last selection in the running average of all
MIN_GAP_LEFT, MIN_BOUND_LEFT = 0.03, 0.001
"""Shares of the distance between bound and goal, and of the bound, that further steps must be able to gain.

The average of the selections nearly solves the linear relaxation, so its value shows how far the bound can fall
(the volume algorithm: Barahona and Anbil 2000).
"""

MAX_LISTED_CHOICES = 10_000  # number of possible choices at which the search ends
FACTORS = (0.8, 0.95, 1.0, 1.05, 1.25)  # factors by which the budget's multiplier may change in a step
PRICES_TRIED = 200  # multipliers of the price that are tried for a bound on it


class HasValue(Protocol):
    """An upper bound of any form."""

    @property
    def value(self) -> float:
        """Upper bound on the objective value of any placement."""


@dataclass(frozen=True, eq=False)
class Selection:
    """The choice of largest summed scores: each candidate has a score that does not depend on the others.

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
        Upper bound on the objective value of any placement.
    targets : (t,) float64
        Multipliers of the targets.
    groups : (g,) float64
        Multipliers of the mandatory groups.
    """

    value: float
    targets: Float
    groups: Float
    selection: Selection


def select(instance: Constrained, score: Float, near: float = 0.0) -> Selection:
    """Choose the candidates of largest scores, one per clique, within the number and the budget.

    The budget is relaxed; its multiplier minimises the bound, by bisection, or is the best of a few near the one given.
    """
    # Without a multiplier the sorted choice is exact. It is the answer where its price happens to be within the budget.
    free = _select(instance, score, 0.0)
    if instance.affordable(float(instance.price[free.picked].sum())):
        return free
    if near > 0:
        return min((_select(instance, score, near * factor) for factor in FACTORS), key=lambda choice: choice.value)
    # The bound is convex in the multiplier, and its slope is the budget less the price of the selection: too high a
    # price means that the smallest bound lies at a larger multiplier. At the largest ratio of score to price nothing
    # that costs anything is picked, so that no larger multiplier is needed. Each trial is a valid bound; the best one
    # is kept, as the last one of the bisection need not be it.
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


class _Average:
    """Running average of selections, whose value estimates the linear relaxation from below.

    What exceeds the budget or falls short of the mandatory groups is charged at their multipliers.
    """

    def __init__(self, layers: Float) -> None:
        self._layers = layers
        self._seen: Float = np.zeros(layers.shape[1])
        self._charge = 0.0
        self._weight = 0.0

    def record(self, seen: Integer, bound: Bound, instance: Instance) -> None:
        """Add a selection, with the number of its sensors that see each target."""
        selection = bound.selection
        charge = bound.groups @ (1.0 - instance.mandatory[:, selection.picked].sum(axis=1))
        if selection.multiplier > 0:
            charge += selection.multiplier * (float(instance.price[selection.picked].sum()) - instance.budget)
        # `_weight` follows the same recursion with ones: dividing by it removes the bias of a start at zero
        self._seen += AVERAGED_SHARE * (seen - self._seen)
        self._charge += AVERAGED_SHARE * (float(charge) - self._charge)
        self._weight += AVERAGED_SHARE * (1.0 - self._weight)

    @property
    def value(self) -> float:
        """Objective value of the average in the linear relaxation."""
        # A target that is seen 1.4 times on average has its first layer in full and 40 % of the second. Layers do not
        # increase, so this is the value of the linear relaxation.
        depth = np.arange(len(self._layers))[:, None]
        covered = (self._layers * np.clip(self._seen / self._weight - depth, 0.0, 1.0)).sum()
        return float(covered) - self._charge / self._weight


B = TypeVar("B", bound=HasValue)


class SubgradientDescent(Generic[B]):
    """Deflected subgradient steps that lower a bound.

    Parameters
    ----------
    bound : B
        Bound at the multipliers to begin from.
    total : float
        Objective value of all targets. A bound counts as smaller if it falls by more than 1e-7 of this.

    Attributes
    ----------
    best, current : B
        The smallest bound so far, and the one from which the next step is made.
    step : float
        Length of a step, as a share of the excess over the goal. It shrinks each time that `PATIENCE` steps in a row
        have not lowered the bound.
    """

    def __init__(self, bound: B, total: float) -> None:
        self._total = total
        self.step = 1.0
        self._stale = 0
        self.restart(bound)

    def restart(self, bound: B) -> None:
        """Continue from another bound, without the deflection by earlier steps."""
        self.best = self.current = bound
        self._direction: Float | float = 0.0

    def move(self, slope: Float, goal: float) -> Float | None:
        """Return the amounts to subtract from the multipliers; None where the slope shows that no bound is smaller."""
        # Part of the last direction is kept (Camerini, Fratta and Maffioli 1975): subgradients of successive steps
        # often nearly cancel, and the sum goes along the valley instead of across it.
        self._direction = slope + DEFLECTION * self._direction
        size = float(self._direction @ self._direction)
        if size == 0:
            return None
        # Polyak's step: the excess over the goal, divided by the squared length. Once the bound is at the goal or
        # below, a small part of the total keeps the steps positive.
        length = self.step * max(self.current.value - goal, 1e-6 * self._total) / size
        return length * self._direction

    def record(self, bound: B) -> None:
        """Record the bound after a step; return to the best one after `PATIENCE` steps without a smaller one."""
        self.current = bound
        self._stale += 1
        if bound.value < self.best.value - 1e-7 * self._total:
            self.best, self._stale = bound, 0
        elif self._stale == PATIENCE:
            self.step, self._stale = self.step * STEP_REDUCTION, 0
            self.restart(self.best)


def bound_from(
    instance: Instance,
    targets: Float,
    groups: Float,
    layers: Float | None = None,
    *,
    exact: bool = True,
    near: float = 0.0,
) -> Bound:
    """Return the bound for given multipliers, in double precision where ``exact``.

    Parameters
    ----------
    layers : (top, t) float64, optional
        Largest amount that each further sensor adds to each target. Default: those of targets that are not seen yet.
    exact : bool
        Whether to compute scores in double precision. Single precision may move the bound by more than its margin.
    near : float
        Multiplier of the budget near which to look for a better one; 0 to look everywhere.
    """
    if layers is None:
        layers = instance.unseen_layers
    if exact:
        score = np.concatenate([block @ targets for block in np.array_split(instance.visible, 16)])
    else:
        score = instance.gains(targets)
    # The three terms of L: what targets add beyond their multipliers; the mandatory groups, each relaxed as "at least
    # one of its candidates", which costs its multiplier once and adds it to the score of each member; the best
    # selection. `fsum` keeps the error of long sums below the instance's margin.
    selection = select(instance, score + groups @ instance.mandatory, near)
    rest = np.maximum(layers - targets, 0.0).ravel()
    value = (math.fsum(rest) if exact else float(rest.sum())) - math.fsum(groups) + selection.value
    return Bound(value, targets, groups, selection)


def lagrangian_bound(
    instance: Instance,
    goal: float,
    clock: Clock,
    start: Float | None = None,
    iterations: int = MAX_ITERATIONS,
    layers: Float | None = None,
) -> Generator[Progress, None, tuple[Integer, Bound]]:
    """Search for multipliers with a small bound by deflected subgradients.

    Candidates that the bound rules out are left out of the following steps, which makes these shorter and the bound
    smaller.

    Parameters
    ----------
    goal : float
        Objective value to reach; the search ends when the bound falls below.
    start : (t,) float64, optional
        Multipliers of the targets to begin from.
    layers : (top, t) float64, optional
        Layers as for `bound_from`.

    Returns
    -------
    (k,) int64
        Candidates that some placement reaching ``goal`` may contain.
    Bound
        Smallest bound found for placements of these candidates, evaluated in double precision. If no candidate is
        left, it is the bound for those of the last step.
    """
    layers = instance.unseen_layers if layers is None else layers
    most = layers[0]
    keep = np.arange(len(instance))
    # A target that many candidates see is likely to be seen by several chosen ones: its multiplier, the share of it
    # that each sensor is credited with, begins lower. This is a heuristic start; any multipliers give a valid bound.
    targets = most / np.maximum(1, instance.visible.sum(axis=0)) ** 0.5 if start is None else start
    groups = np.zeros(len(instance.mandatory))
    # Multipliers of groups are of the size of scores, those of targets of the size of weights. One step length serves
    # both only after scaling by the mean number of targets that a candidate sees.
    stretch = instance.visible.sum() / len(instance) if len(groups) else 1.0
    descent = SubgradientDescent(bound_from(instance, targets, groups, layers, exact=False), float(layers.sum()))
    total, average = float(layers.sum()), _Average(layers)
    for iteration in range(iterations):
        best = descent.best
        if best.value < goal - instance.margin or descent.step < MIN_STEP or clock.left <= 0:
            break
        # Every `REDUCTION_INTERVAL` steps: stop if the linear relaxation, estimated by the average, leaves hardly any
        # room below the bound; else rule candidates out, and stop if so few are left that their choices can be listed.
        due = iteration % REDUCTION_INTERVAL == REDUCTION_INTERVAL - 1
        least = min(MIN_GAP_LEFT * (best.value - goal), MIN_BOUND_LEFT * best.value)
        if due and min(best.value, total) - average.value <= least:
            break
        if due and len(can_reach(instance, best, goal)) <= MAX_KEPT_SHARE * len(keep):
            # the test above used the fast bound; candidates are only removed by the one in double precision
            within = can_reach(instance, bound_from(instance, best.targets, best.groups, layers), goal)
            if math.comb(len(within), min(instance.count, len(within) // 2)) <= MAX_LISTED_CHOICES:
                break
            # earlier directions belong to the larger set of candidates, so that the descent restarts without them
            keep, instance = keep[within], instance.of(within)
            descent.restart(bound_from(instance, best.targets, best.groups, layers, exact=False))
        yield Progress(0, 0, "bounding what any placement can cover")  # it mostly ends long before the limit
        clock.spend(2 * instance.visible.size)
        current = descent.current
        picked = current.selection.picked
        seen = instance.visible[picked].sum(axis=0)
        average.record(seen, current, instance)
        # L falls with a multiplier by one for each layer above it, and rises by one for each selected sensor that sees
        # the target. Where the multiplier equals some layers, any number of these may count: of this interval of slopes
        # the one nearest to zero is taken, so that a slope of zero everywhere proves that the bound is the smallest.
        slope = np.maximum(
            seen - (layers >= current.targets).sum(axis=0), np.minimum(seen - (layers > current.targets).sum(axis=0), 0)
        )
        group_slope = stretch * (instance.mandatory[:, picked].sum(axis=1) - 1.0)
        change = descent.move(np.concatenate([slope, group_slope]), goal)
        if change is None:
            break
        # clipped to where multipliers are valid: 0 <= λ <= a_1 for targets, at least 0 for groups
        targets = np.clip(current.targets - change[: len(most)], 0.0, most)
        groups = np.maximum(current.groups - stretch * change[len(most) :], 0.0)
        descent.record(bound_from(instance, targets, groups, layers, exact=False, near=current.selection.multiplier))
    best = descent.best
    best = bound_from(instance, best.targets, best.groups, layers)
    within = can_reach(instance, best, goal)
    # Every placement that reaches the goal consists of the candidates that are left, so that the bound for these holds
    # for it: a smaller selection from fewer candidates, at no further step.
    if len(within):
        best = bound_from(instance.of(within), best.targets, best.groups, layers)
    return keep[within], best


def least_price(instance: Instance, bound: Bound, goal: float) -> float:
    r"""Return a price below which no placement covers ``goal``.

    With the bound's multipliers and a multiplier :math:`\mu > 0` of the price, a placement of price C covers at most
    :math:`L(\lambda, \mu) + \mu C`, so that :math:`C \ge (goal - L(\lambda, \mu)) / \mu`.
    """
    # `net` has the price taken off at the bound's own multiplier: adding it again gives the plain scores
    score = bound.selection.net + bound.selection.multiplier * instance.price
    fixed = bound.value - bound.selection.value
    # The selection changes only where the multiplier passes a candidate's ratio of score to price: it is enough to try
    # these, and of many an even spread. The largest of the lower bounds holds.
    worth = np.unique(score[instance.price > 0] / instance.price[instance.price > 0])
    worth = worth[worth > 0]
    tried = worth[np.linspace(0, len(worth) - 1, min(len(worth), PRICES_TRIED)).astype(np.int64)]
    gained = [_select(instance, score, multiplier) for multiplier in tried]
    prices = [
        (goal - fixed - math.fsum(selection.net[selection.picked])) / selection.multiplier for selection in gained
    ]
    return max([0.0, *prices])


def can_reach(instance: Instance, bound: Bound, goal: float) -> Integer:
    """Return the candidates that some placement reaching ``goal`` may contain, (k,) int64.

    A candidate is ruled out when the bound, with that candidate forced into the selection, falls short of the goal by
    more than rounding errors: all optimal placements survive, ties included (reduced-cost fixing).
    """
    picked, net = bound.selection.picked, bound.selection.net
    in_clique = np.zeros(int(instance.clique.max()) + 1)
    # A forced candidate replaces the pick of its clique, or, if its clique has none and the number is used up, the
    # weakest pick; otherwise it is added, and replaces nothing (0).
    in_clique[:] = net[picked].min() if len(picked) == instance.count else 0.0
    in_clique[instance.clique[picked]] = net[picked]
    forced = bound.value + np.minimum(net - in_clique[instance.clique], 0.0)
    return np.flatnonzero(forced >= goal - instance.margin)


def _select(instance: Constrained, score: Float, multiplier: float) -> Selection:
    """Return the selection at a multiplier of the budget: exact for cliques and number, by sorting."""
    net = score - multiplier * instance.price if multiplier else score
    # sorted by clique, and within each by falling net score: the first of each clique is its best candidate
    best_first = np.lexsort((-net, instance.clique))
    clique = instance.clique[best_first]
    heads = best_first[np.concatenate([[True], clique[1:] != clique[:-1]])]
    # no more than ``count`` of these, and none that would lower the sum
    heads = heads[np.argsort(-net[heads], kind="stable")][: instance.count]
    picked = heads[net[heads] > 0]
    value = math.fsum(net[picked]) + (multiplier * instance.budget if multiplier else 0.0)
    return Selection(value, picked, net, multiplier)
