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
"""Every so many steps candidates are ruled out, where no more than such a share of them would be left."""

AVERAGED_SHARE = 0.03  # weight of the last selection in the running average of all
MIN_GAP_LEFT, MIN_BOUND_LEFT = 0.03, 0.001
"""Shares of the distance between bound and goal, and of the bound, that further steps must be able to gain.

The average of the selections nearly solves the linear relaxation, so what it covers says how far the bound can fall
(the volume algorithm: Barahona and Anbil 2000).
"""

MAX_LISTED_CHOICES = 10_000  # the search ends when no more choices than these are left
FACTORS = (0.8, 0.95, 1.0, 1.05, 1.25)  # factors by which the budget's multiplier may change in a step
PRICES_TRIED = 200  # multipliers of the price that are tried for a bound on it


class HasValue(Protocol):
    """A bound, of whatever form."""

    @property
    def value(self) -> float:
        """No placement has a larger objective value."""


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
        No placement has a larger objective value.
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
    free = _select(instance, score, 0.0)
    if instance.affordable(float(instance.price[free.picked].sum())):
        return free
    if near > 0:
        return min((_select(instance, score, near * factor) for factor in FACTORS), key=lambda choice: choice.value)
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
    """Running average of selections: what it covers estimates the linear relaxation from below.

    What exceeds the budget or falls short of the mandatory groups is charged at their multipliers.
    """

    def __init__(self, layers: Float) -> None:
        self._layers = layers
        self._seen: Float = np.zeros(layers.shape[1])
        self._charge = 0.0
        self._weight = 0.0

    def record(self, seen: Integer, bound: Bound, instance: Instance) -> None:
        """Add a selection, with how often it sees each target."""
        selection = bound.selection
        charge = bound.groups @ (1.0 - instance.mandatory[:, selection.picked].sum(axis=1))
        if selection.multiplier > 0:
            charge += selection.multiplier * (float(instance.price[selection.picked].sum()) - instance.budget)
        self._seen += AVERAGED_SHARE * (seen - self._seen)
        self._charge += AVERAGED_SHARE * (float(charge) - self._charge)
        self._weight += AVERAGED_SHARE * (1.0 - self._weight)

    @property
    def value(self) -> float:
        """Objective value of the average, as a linear relaxation counts it."""
        depth = np.arange(len(self._layers))[:, None]
        covered = (self._layers * np.clip(self._seen / self._weight - depth, 0.0, 1.0)).sum()
        return float(covered) - self._charge / self._weight


B = TypeVar("B", bound=HasValue)


class SubgradientDescent(Generic[B]):
    """Deflected subgradient steps that lower a bound.

    Parameters
    ----------
    bound : B
        At the multipliers to begin from.
    total : float
        Objective value of all targets: a bound falls where it falls by a share of this.

    Attributes
    ----------
    best, current : B
        The smallest bound met, and the one to make the next step from.
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
        """Go on from another bound, without the deflection by earlier steps."""
        self.best = self.current = bound
        self._direction: Float | float = 0.0

    def move(self, slope: Float, goal: float) -> Float | None:
        """Return what is to be taken from the multipliers; None where the slope shows that no bound is smaller."""
        self._direction = slope + DEFLECTION * self._direction
        size = float(self._direction @ self._direction)
        if size == 0:
            return None
        length = self.step * max(self.current.value - goal, 1e-6 * self._total) / size
        return length * self._direction

    def record(self, bound: B) -> None:
        """Take the bound that a step has led to; after too many in vain, return to the best."""
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
    """Return the bound that some multipliers give, in double precision where ``exact``.

    The budget's multiplier is sought near the one given, if any.

    Parameters
    ----------
    layers : (top, t) float64, optional
        What each further sensor adds at most to a target; without them no target is seen yet.
    """
    if layers is None:
        layers = instance.unseen_layers
    if exact:
        score = np.concatenate([block @ targets for block in np.array_split(instance.visible, 16)])
    else:
        score = instance.gains(targets)
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

    Candidates that the bound rules out are left out of the steps that follow,
    which makes these shorter and the bound smaller.

    Parameters
    ----------
    goal : float
        Objective value to reach; the search ends when the bound falls below.
    start : (t,) float64, optional
        Multipliers of the targets to begin from.
    layers : (top, t) float64, optional
        As for `bound_from`.

    Returns
    -------
    (k,) int64
        Candidates that some placement reaching ``goal`` may contain.
    Bound
        The best one found for placements of these, evaluated in double
        precision; where none is left, of those that were left last.
    """
    layers = instance.unseen_layers if layers is None else layers
    most = layers[0]
    keep = np.arange(len(instance))
    targets = most / np.maximum(1, instance.visible.sum(axis=0)) ** 0.5 if start is None else start
    groups = np.zeros(len(instance.mandatory))
    # group multipliers live on the scale of scores, those of targets on that of weights
    stretch = instance.visible.sum() / len(instance) if len(groups) else 1.0
    descent = SubgradientDescent(bound_from(instance, targets, groups, layers, exact=False), float(layers.sum()))
    total, average = float(layers.sum()), _Average(layers)
    for iteration in range(iterations):
        best = descent.best
        if best.value < goal - instance.margin or descent.step < MIN_STEP or clock.left <= 0:
            break
        due = iteration % REDUCTION_INTERVAL == REDUCTION_INTERVAL - 1
        least = min(MIN_GAP_LEFT * (best.value - goal), MIN_BOUND_LEFT * best.value)
        if due and min(best.value, total) - average.value <= least:
            break
        if due and len(can_reach(instance, best, goal)) <= MAX_KEPT_SHARE * len(keep):
            within = can_reach(instance, bound_from(instance, best.targets, best.groups, layers), goal)
            if math.comb(len(within), min(instance.count, len(within) // 2)) <= MAX_LISTED_CHOICES:
                break
            keep, instance = keep[within], instance.of(within)
            descent.restart(bound_from(instance, best.targets, best.groups, layers, exact=False))
        yield Progress(0, 0, "bounding what any placement can cover")  # it mostly ends long before the limit
        clock.spend(2 * instance.visible.size)
        current = descent.current
        picked = current.selection.picked
        seen = instance.visible[picked].sum(axis=0)
        average.record(seen, current, instance)
        # the subgradient nearest to zero: where a multiplier meets layers any number of these may count
        slope = np.maximum(
            seen - (layers >= current.targets).sum(axis=0), np.minimum(seen - (layers > current.targets).sum(axis=0), 0)
        )
        group_slope = stretch * (instance.mandatory[:, picked].sum(axis=1) - 1.0)
        change = descent.move(np.concatenate([slope, group_slope]), goal)
        if change is None:
            break
        targets = np.clip(current.targets - change[: len(most)], 0.0, most)
        groups = np.maximum(current.groups - stretch * change[len(most) :], 0.0)
        descent.record(bound_from(instance, targets, groups, layers, exact=False, near=current.selection.multiplier))
    best = descent.best
    best = bound_from(instance, best.targets, best.groups, layers)
    within = can_reach(instance, best, goal)
    if len(within):
        best = bound_from(instance.of(within), best.targets, best.groups, layers)
    return keep[within], best


def least_price(instance: Instance, bound: Bound, goal: float) -> float:
    r"""Return a price below which no placement covers ``goal``.

    With the bound's multipliers and a multiplier :math:`\mu > 0` of the price, a placement of price C covers at most
    :math:`L(\lambda, \mu) + \mu C`, so that :math:`C \ge (goal - L(\lambda, \mu)) / \mu`.
    """
    score = bound.selection.net + bound.selection.multiplier * instance.price
    fixed = bound.value - bound.selection.value
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
    more than `TIE_TOLERANCE`: all optimal placements survive, ties included.
    """
    picked, net = bound.selection.picked, bound.selection.net
    in_clique = np.zeros(int(instance.clique.max()) + 1)
    # what gives way: the clique's own pick, else the weakest pick when the number is used up
    in_clique[:] = net[picked].min() if len(picked) == instance.count else 0.0
    in_clique[instance.clique[picked]] = net[picked]
    forced = bound.value + np.minimum(net - in_clique[instance.clique], 0.0)
    return np.flatnonzero(forced >= goal - instance.margin)


def _select(instance: Constrained, score: Float, multiplier: float) -> Selection:
    net = score - multiplier * instance.price if multiplier else score
    best_first = np.lexsort((-net, instance.clique))
    clique = instance.clique[best_first]
    heads = best_first[np.concatenate([[True], clique[1:] != clique[:-1]])]
    heads = heads[np.argsort(-net[heads], kind="stable")][: instance.count]
    picked = heads[net[heads] > 0]
    value = math.fsum(net[picked]) + (multiplier * instance.budget if multiplier else 0.0)
    return Selection(value, picked, net, multiplier)
