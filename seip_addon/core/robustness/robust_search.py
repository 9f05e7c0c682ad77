r"""Branch and bound for objectives that a sum over targets bounds from above.

The bounding function counts what sees a target: with p in P (`risk`),

.. math::
    F(S) = \sum_k p_k \sum_j w_j\, φ(n_{jk}(S)) \ge T(S),

φ being what a target is worth by the sensors that see it (`worth`). φ rises, but
where more than one look is asked for it is not concave: one look of two is worth
nothing. With S chosen and l sensors still to come, a target seen n times is worth
φ(n), and what follows adds to it no more than the least concave function
:math:`φ_{n,l}` above :math:`φ(n), …, φ(n + l)`,

.. math::
    F(S \cup R) \le F(S) + \sum_k p_k \sum_j w_j\, φ_{n_{jk}(S),\,l}(n_{jk}(R)),
    \quad |R| \le l,

which is submodular in R, and tighter in every branch than above it: who has been
seen once counts in full or not at all, who cannot be seen often enough any more
counts no longer, and for the last sensor it is exact. A set S with
:math:`T(S) \ge g` has :math:`F(S) \ge g` as well: sets are built so that a sensor
is followed by those that add less than it where it was chosen, as in
`placement.branch_and_bound`, branches that cannot bring F to the best T so far are
cut, and T itself is asked of every set that is left. Relaxing what a target's
sensors add with multipliers λ bounds what is added by

.. math::
    L(λ) = \sum_j \sum_{i \ge 1} \max(0,\, w_j φ_{n,l,i} - λ_j) + \max_{x \in X} \sum_i x_i \sum_j V_{ij} λ_j,

:math:`φ_{n,l,i}` being the i-th rise of :math:`φ_{n,l}`; for one look this is the
relaxation of `placement.bounds`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from functools import cached_property
from heapq import heappop, heappush

import numpy as np

from ..arrays import Boolean, Float, Integer
from ..placement.bounds import Selection, select
from ..placement.clock import Clock
from ..placement.greedy import addable
from ..placement.instance import SINGLE, Instance, Numbers
from ..progress import Progress
from .worth import Worth

FIRST_STEPS, LATER_STEPS = 300, 60
PATIENCE, SHRINK, DEFLECTION, SMALLEST_STEP = 15, 0.7, 0.85, 1e-3
"""Of the search for multipliers, as in `placement.bounds`."""

REVIEW = 25
"""Every so many steps candidates are ruled out."""

RELAXED, WIDE = 2, 40
"""With so many sensors to come, and so many candidates, or more, a branch is bounded by relaxation as well.

Only where each sensor adds less than the one before it: elsewhere branching itself tightens the bound, and sooner.
"""

COPY = 8
"""Multiplications for each entry of V that count as the work of one branch."""

OPEN = 10_000
"""Branches that wait to be taken by their bounds; with so many, those below one are searched before any other."""

STARTS, FIRST = 8, 100
"""Pairs to begin from where one look is worth nothing, and candidates that may be the first of a pair."""

RIVALS = 24
"""Exchanges of a sensor that are judged, those with the largest F."""


@dataclass(frozen=True, eq=False)
class CountedCover:
    """F, the sum of what targets are worth by how many chosen candidates see them.

    Parameters
    ----------
    instance : Instance
        Candidates with their constraints, targets merged; weights are whole numbers.
    worth : Worth
        For each unit of weight.
    """

    instance: Instance
    worth: Worth

    @cached_property
    def matrix(self) -> Numbers:
        """V as numbers, in the smallest precision in which products with what is added are exact."""
        most = self.instance.total * self.worth.unit
        return self.instance.visible.astype(np.float32 if most < SINGLE else np.float64)

    def added(self, times: Integer, left: int, level: int = 0) -> Float:
        """Return what the next sensor adds at most at targets seen so many times, (t,) float64; see `Worth.added`."""
        more: Float = self.instance.weight * self.worth.added(times, left, level)
        return more

    def gains(self, per_target: Float) -> Float:
        """Return what each candidate sees of figures per target, (c, …) float64."""
        gained: Float = (self.matrix @ per_target.astype(self.matrix.dtype)).astype(np.float64)
        return gained

    def times(self, chosen: Integer) -> Integer:
        """Return how many of the chosen candidates see each target, (t,) int64."""
        seen: Integer = self.instance.visible[chosen].sum(axis=0, dtype=np.int64)
        return seen

    def value(self, chosen: Integer) -> float:
        """Return F."""
        return float(self.instance.weight @ self.worth.reached(self.times(chosen)))

    def of(self, keep: Integer) -> CountedCover:
        """Return the same with only some candidates."""
        return CountedCover(self.instance.of(keep), self.worth)


def greedy_cover(cover: CountedCover, chosen: Integer) -> Integer:
    """Add the candidate that adds most to F, at most and with those to come, until nothing adds, ascending."""
    while True:
        left = max(cover.instance.count - len(chosen), 0)
        gain = cover.gains(cover.added(cover.times(chosen), left))
        gain[~addable(cover.instance, chosen)] = 0.0
        best = int(np.argmax(gain))
        if gain[best] <= 0:
            return np.sort(chosen)
        chosen = np.append(chosen, best)


def exchanged(cover: CountedCover, chosen: Integer) -> Generator[Progress, None, Integer]:
    """Exchange candidates, and add some, for as long as F grows."""
    chosen = greedy_cover(cover, chosen)
    while True:
        yield Progress(0, 0, "exchanging sensors")
        gone, new, value = _best_exchange(cover, chosen)
        if value <= cover.value(chosen):
            return chosen
        chosen = greedy_cover(cover, np.append(chosen[chosen != gone], new))


def _best_exchange(cover: CountedCover, chosen: Integer) -> tuple[int, int, float]:
    """Return who goes, who comes, and F after it; for F without any gain nobody."""
    if len(chosen) == 0:
        return -1, -1, -math.inf
    values = _exchange_values(cover, chosen)
    gone, new = np.unravel_index(int(np.argmax(values)), values.shape)
    return int(chosen[gone]), int(new), float(values[gone, new])


def _exchange_values(cover: CountedCover, chosen: Integer) -> Float:
    """Return F after each exchange, (s, c) float64; -inf where it is not allowed."""
    times = cover.times(chosen)
    left = [times - cover.instance.visible[candidate] for candidate in chosen]
    gains = cover.gains(np.stack([cover.added(each, 1) for each in left], axis=1)).T
    values: Float = gains + np.array([[cover.value(chosen[chosen != candidate])] for candidate in chosen])
    for row, candidate in zip(values, chosen, strict=True):
        others = chosen[chosen != candidate]
        row[~addable(cover.instance, others)] = -np.inf
    return values


def exchanged_from_pairs(
    cover: CountedCover, start: Integer, best: Integer, clock: Clock
) -> Generator[Progress, None, Integer]:
    """Exchange from pairs that see most together, for part of the time; what is best already, if none is better.

    One sensor alone adds nothing where a target must be seen twice: who is added first is a guess, and exchanges
    of single sensors do not lead from every guess to the best.
    """
    time, value = clock.left, cover.value(best)
    for pair in _best_pairs(cover, start):
        if clock.left < 0.75 * time:
            break
        chosen = yield from exchanged(cover, np.append(start, pair))
        if cover.value(chosen) > value:
            best, value = chosen, cover.value(chosen)
    return best


def _best_pairs(cover: CountedCover, start: Integer) -> list[list[int]]:
    """Return pairs that can join the start, no candidate in two of them, those that see most together first."""
    instance = cover.instance
    sight = cover.gains(instance.weight)
    sight[~addable(instance, start)] = 0.0
    first = np.argsort(-sight, kind="stable")[: min(FIRST, np.count_nonzero(sight))]
    together = (cover.matrix[first] * instance.weight.astype(cover.matrix.dtype)) @ cover.matrix.T
    together[instance.conflict[first] | (sight == 0) | (first[:, None] == np.arange(len(instance)))] = 0.0
    pairs: list[list[int]] = []
    while len(pairs) < STARTS and together.any():
        row, other = np.unravel_index(int(np.argmax(together)), together.shape)
        pair = [int(first[row]), int(other)]
        together[np.isin(first, pair)] = 0.0
        together[:, pair] = 0.0
        if addable(instance, np.append(start, pair[0]))[pair[1]]:
            pairs.append(pair)
    return pairs


def exchanged_as_judged(
    cover: CountedCover, judge: Callable[[Integer], float], chosen: Integer
) -> Generator[Progress, None, Integer]:
    """Exchange candidates for as long as T grows, of each sensor's exchanges those with the largest F."""
    value = judge(chosen)
    while len(chosen) > 0:
        yield Progress(0, 0, "exchanging sensors")
        values = _exchange_values(cover, chosen)
        rivals = [
            np.sort(np.append(chosen[chosen != gone], new))
            for gone, row in zip(chosen, values, strict=True)
            for new in np.argsort(-row, kind="stable")[:RIVALS]
            if math.isfinite(row[new])
        ]
        reached = [judge(rival) for rival in rivals]
        if not rivals or max(reached) <= value:
            break
        value = max(reached)
        chosen = rivals[reached.index(value)]
    return chosen


@dataclass(frozen=True, eq=False)
class Relaxation:
    """An upper bound of F over all placements, and the multipliers that prove it.

    Parameters
    ----------
    targets : (t,) float64
    """

    value: float
    targets: Float
    selection: Selection

    def can_reach(self, instance: Instance, goal: float) -> Integer:
        """Return the candidates that some placement of F at least ``goal`` may contain."""
        picked, net = self.selection.picked, self.selection.net
        gives_way = np.full(int(instance.clique.max(initial=-1)) + 1, 0.0)
        gives_way[:] = net[picked].min() if len(picked) == instance.count else 0.0
        gives_way[instance.clique[picked]] = net[picked]
        forced = self.value + np.minimum(net - gives_way[instance.clique], 0.0)
        return np.flatnonzero(forced >= goal)


def relax(  # what is bounded, and how far to go
    cover: CountedCover, times: Integer, goal: float, iterations: int, start: Float | None
) -> Generator[Progress, None, tuple[Integer, Relaxation]]:
    """Search for multipliers with a small bound on what can be added to F, by deflected subgradients.

    Parameters
    ----------
    times : (t,) int64
        How often each target is seen already; the count of the cover's instance is of those to come.
    goal : float
        What must be added; the search ends when the bound falls below.
    start : (t,) float64, optional
        Multipliers to begin from.

    Returns
    -------
    (k,) int64
        Candidates that may be among those that add the goal.
    Relaxation
    """
    keep = np.arange(len(cover.instance))
    layers = np.stack([cover.added(times, cover.instance.count, level) for level in range(cover.worth.top)])
    most = layers[0]
    begin = most / np.maximum(1, cover.instance.visible.sum(axis=0)) ** 0.5 if start is None else start
    current = best = _relaxation(cover, layers, np.minimum(begin, most))
    direction, step, stale = np.zeros(len(most)), 1.0, 0
    total = float(layers.sum())
    for iteration in range(iterations):
        if step < SMALLEST_STEP or best.value < goal:
            break
        if iteration % REVIEW == REVIEW - 1:
            best = _relaxation(cover, layers, best.targets, exact=True)
            within = best.can_reach(cover.instance, goal)
            if len(within) < 0.8 * len(keep):
                keep, cover = keep[within], cover.of(within)
                if len(keep) == 0:
                    return keep, best
                current = best = _relaxation(cover, layers, best.targets)
                direction[:] = 0.0
        yield Progress(0, 0, "bounding what any placement can reach")
        picked = current.selection.picked
        slope = cover.times(picked) - (layers > current.targets).sum(axis=0)
        slope = np.where(current.targets > 0, slope, np.minimum(slope, 0))
        direction = slope + DEFLECTION * direction
        size = float(direction @ direction)
        if size == 0:
            break
        length = step * max(current.value - goal, 1e-6 * total) / size
        current = _relaxation(cover, layers, np.clip(current.targets - length * direction, 0.0, most))
        if current.value < best.value - 1e-7 * total:
            best, stale = current, 0
        else:
            stale += 1
            if stale == PATIENCE:
                step, stale, current = step * SHRINK, 0, best
                direction[:] = 0.0
    best = _relaxation(cover, layers, best.targets, exact=True)
    within = best.can_reach(cover.instance, goal)
    return keep[within], best


def _relaxation(cover: CountedCover, layers: Float, targets: Float, *, exact: bool = False) -> Relaxation:
    """Return the bound that multipliers give, in double precision where ``exact``."""
    if exact:
        score = np.concatenate([block @ targets for block in np.array_split(cover.instance.visible, 16)])
    else:
        score = cover.gains(targets)
    selection = select(cover.instance, score)
    value = math.fsum(np.maximum(layers - targets, 0.0).sum(axis=1)) + selection.value
    return Relaxation(value, targets, selection)


@dataclass(frozen=True, eq=False)
class Searched:
    """What a search found.

    Parameters
    ----------
    chosen : (k,) int64
        The best placement.
    value : float
        Its T.
    bound : float
        No placement has a larger T.
    finished : bool
        Whether all was seen.
    """

    chosen: Integer
    value: float
    bound: float
    finished: bool


@dataclass(frozen=True, eq=False)
class _Node:
    """Candidates chosen so far, and who may follow, the largest gain first."""

    chosen: tuple[int, ...]
    value: float
    bound: float
    followers: Integer
    gains: Float
    multipliers: Float | None


class RobustSearch:
    """Finds the placement of largest T.

    Parameters
    ----------
    cover : CountedCover
        F.
    unit : float
        F in these units is what T is bounded by.
    judge : callable
        Returns T of candidates of the cover.
    chosen : (k,) int64
        A placement to begin from.
    slack : float
        Values of T that differ by no more count as equal.
    """

    def __init__(
        self, cover: CountedCover, unit: float, judge: Callable[[Integer], float], chosen: Integer, slack: float
    ) -> None:
        self._cover, self._unit, self._judge, self._slack = cover, unit, judge, slack
        self._best, self._value = chosen, judge(chosen)

    def run(self, clock: Clock) -> Generator[Progress, None, Searched]:
        """Search until all is seen or the time is up, first where the bound is largest: it falls all the while."""
        cover = self._cover
        nothing = np.zeros(len(cover.instance.weight), dtype=np.int64)
        keep, relaxation = yield from relax(cover, nothing, self._goal(), FIRST_STEPS, None)
        gains = cover.gains(cover.added(nothing, cover.instance.count))[keep]
        first = _node((), 0.0, relaxation.value, keep, gains, relaxation.targets)
        queue, dive, nodes = [(-first.bound, 0, first)], list[_Node](), 0
        while (queue or dive) and clock.left > 0:
            yield Progress(0, 0, f"searching placements, {nodes:,} branches so far")
            clock.spend(self._cover.matrix.size * COPY)
            node = dive.pop() if dive else heappop(queue)[2]
            for child in reversed((yield from self._expand(node))):
                nodes += 1
                if len(queue) < OPEN:
                    heappush(queue, (-child.bound, nodes, child))
                else:
                    dive.append(child)
        bound = max([self._value, *(node.bound / self._unit for node in dive + [node for _, _, node in queue])])
        return Searched(np.sort(self._best), self._value, min(bound, relaxation.value / self._unit), not queue + dive)

    def _goal(self) -> float:
        """Return the F that a placement as good as the best has at least."""
        return (self._value - self._slack) * self._unit

    def _expand(self, node: _Node) -> Generator[Progress, None, list[_Node]]:
        left = self._left(node)
        node, children = _within_reach(node, left, self._goal())
        if left == 0 or children == 0:
            return []
        if left == 1:
            for candidate, gain in zip(node.followers[:children].tolist(), node.gains, strict=False):
                if node.value + gain < self._goal():
                    break
                self._take((*node.chosen, candidate))
            return []
        times = self._cover.times(np.array(node.chosen, dtype=np.int64))
        concave = self._cover.worth.concave
        if concave and len(node.chosen) > 0 and left >= RELAXED and children >= WIDE:
            rest = CountedCover(self._rest(node, left), self._cover.worth)
            goal = self._goal() - node.value
            kept, relaxation = yield from relax(rest, times, goal, LATER_STEPS, node.multipliers)
            bound = min(node.bound, node.value + relaxation.value)
            node = replace(
                node,
                bound=bound,
                followers=node.followers[kept],
                gains=node.gains[kept],
                multipliers=relaxation.targets,
            )
            node, children = _within_reach(node, left, self._goal())
        return self._children(node, times, children, left)

    def _children(self, node: _Node, times: Integer, children: int, left: int) -> list[_Node]:
        """Return the branches below a node, after judging the placements that they begin with."""
        cover, followers = self._cover, node.followers
        instance = cover.instance
        rows = cover.matrix[followers]
        before, behind = (cover.added(seen, left - 1).astype(rows.dtype) for seen in (times, times + 1))
        after = rows @ before + (rows[:children] * (behind - before)) @ rows.T
        follows = np.arange(len(followers)) > np.arange(children)[:, None]
        follows &= ~instance.conflict[np.ix_(followers[:children], followers)]
        reach = _largest(np.where(follows, after, 0.0), left - 1).sum(axis=1, dtype=np.float64)
        values = node.value + rows[:children] @ cover.added(times, 1)
        kept = []
        for row in range(children):
            if values[row] + reach[row] < self._goal():
                continue
            chosen = (*node.chosen, int(followers[row]))
            self._take(chosen)
            bound = min(node.bound, values[row] + reach[row])
            some = follows[row]
            kept.append(_node(chosen, float(values[row]), bound, followers[some], after[row, some], node.multipliers))
        return kept

    def _take(self, chosen: tuple[int, ...]) -> None:
        """Judge a placement; of equal ones the one with fewer sensors, then the cheaper, then the first stays."""
        placement = np.sort(np.array(chosen, dtype=np.int64))
        instance = self._cover.instance
        if not instance.feasible(placement):
            return
        value = self._judge(placement)
        if value > self._value + self._slack or (
            value >= self._value - self._slack and self._rank(placement) < self._rank(self._best)
        ):
            self._best, self._value = placement, value

    def _rank(self, chosen: Integer) -> tuple[int, float, list[int]]:
        instance = self._cover.instance
        return len(chosen), round(math.fsum(instance.price[chosen]), 6), chosen.tolist()

    def _left(self, node: _Node) -> int:
        """Return how many sensors can follow at most."""
        instance = self._cover.instance
        left = min(instance.count - len(node.chosen), len(node.followers))
        if not math.isfinite(instance.budget):
            return left
        prices = np.sort(instance.price[node.followers])[:left]
        spent = math.fsum(instance.price[list(node.chosen)])
        return int(np.count_nonzero(instance.affordable(spent + np.cumsum(prices))))

    def _rest(self, node: _Node, left: int) -> Instance:
        rest = self._cover.instance.of(node.followers)
        spent = math.fsum(self._cover.instance.price[list(node.chosen)])
        no_groups: Boolean = np.zeros((0, len(node.followers)), dtype=bool)
        return replace(rest, count=left, budget=max(rest.budget - spent, 0.0), mandatory=no_groups)


def _node(  # what a branch is made of
    chosen: tuple[int, ...], value: float, bound: float, followers: Integer, gains: Float, multipliers: Float | None
) -> _Node:
    order = np.argsort(-gains, kind="stable")
    return _Node(chosen, value, bound, followers[order], gains[order], multipliers)


def _within_reach(node: _Node, left: int, goal: float) -> tuple[_Node, int]:
    """Drop the followers that add too little, and return how many can come next."""
    if left == 0:
        return node, 0
    sums = np.concatenate([[0.0], np.cumsum(node.gains), np.full(left, node.gains.sum())])
    reach = node.value + sums[left : left + len(node.gains)] - sums[: len(node.gains)]
    useful = int(np.count_nonzero(node.value + sums[left - 1] + node.gains >= goal))
    node = replace(node, followers=node.followers[:useful], gains=node.gains[:useful])
    return node, int(np.count_nonzero(reach[:useful] >= goal))


def _largest(rows: Float, number: int) -> Float:
    """Return the largest figures of each row."""
    if number >= rows.shape[1]:
        return rows
    return np.partition(rows, rows.shape[1] - number, axis=1)[:, rows.shape[1] - number :]
