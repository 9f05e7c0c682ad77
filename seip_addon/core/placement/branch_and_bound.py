"""Branch and bound on what each sensor adds: proves small numbers of sensors that linear programs leave open.

A placement is built in greedy order: each sensor adds no more than the one
before it, because coverage is submodular. At a node with k sensors still to
come the best completion adds at most the sum of the k largest gains; these
sums fall along the sorted candidates, so all children below the first that
falls short are cut at once (cf. Nemhauser and Wolsey 1981 on maximising
submodular set functions). The gains on top of all children come from one
matrix product, and cut most of them before they become nodes. Where rings of
beams overlap a little everywhere the relaxed integer program is weak and this
bound is strong.

Weights are whole numbers, so a search meets the same placements in the same
order on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Boolean, Float, Integer
from ..progress import Progress
from .bounds import lagrangian_bound, select
from .clock import Clock
from .instance import Instance, Numbers
from .problem import TIE

RELAXED = 3
"""With so many sensors to come, or more, a node is bounded by Lagrangian relaxation as well."""

WIDE = 60
"""... where at least so many children are left."""

FIRST_STEPS, LATER_STEPS = 300, 100
"""Steps that the multipliers of the first node may take, and of each later one from its parent's."""

LARGEST = 30_000_000
"""Entries of V up to which the search keeps V as numbers: 120 MB, or twice that where weights are uneven."""

MOST_SENSORS = 8
"""Beyond so many sensors to choose the branches are too many to hope for an end."""


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found.

    Parameters
    ----------
    placements : tuple of (k,) int64
        Sorted candidates of placements of the largest coverage found.
    finished : bool
        Whether no placement covers more; where there is none, that none reaches the goal.
    complete : bool
        Whether all that cover as much are among them, but for those with idle sensors.
    """

    placements: tuple[Integer, ...]
    finished: bool
    complete: bool


@dataclass(frozen=True, eq=False)
class _Node:
    """Sensors chosen so far and who may follow, largest gain first.

    Parameters
    ----------
    chosen : tuple of int
        In the order in which they were chosen.
    value : float
        What they cover.
    goal : float
        What a placement below this node must cover to be wanted.
    followers : (n,) int64
    gains : (n,) float
        What each follower would add.
    multipliers : (t,) float64, optional
        Lagrangian multipliers of the targets to begin from.
    """

    chosen: tuple[int, ...]
    value: float
    goal: float
    followers: Integer
    gains: Numbers
    multipliers: Float | None


def is_worthwhile(instance: Instance, candidates: Integer) -> bool:
    """Return whether a search among some candidates of an instance may end in useful time and memory."""
    return instance.count <= MOST_SENSORS and len(candidates) * len(instance.weight) <= LARGEST


def best_placements(
    instance: Instance, goal: float, most: int, bound: float, clock: Clock, seconds: float
) -> Generator[Progress, None, Found]:
    """List the placements of largest coverage among those that cover at least ``goal``.

    Parameters
    ----------
    instance : Instance
    goal : float
        Weight to be covered at least.
    most : int
        Longest list; of more placements these are the first that the search meets.
    bound : float
        No placement covers more: the search ends when the list is full of such.
    clock : Clock
    seconds : float
        Longest time to search.

    Yields
    ------
    Progress

    Returns
    -------
    Found
    """
    search = _BestPlacements(instance, goal, most, bound)
    finished = yield from search.run(clock, seconds)
    return Found(tuple(search.found), finished, complete=finished and not search.overflowed)


def first_in_order(
    instance: Instance, goal: float, clock: Clock, seconds: float
) -> Generator[Progress, None, tuple[Integer | None, bool]]:
    """Find the first by `merit` of the placements that cover a goal with as many sensors as are allowed.

    Parameters
    ----------
    instance : Instance
        No placement with fewer sensors than its ``count`` reaches the goal.
    goal : float
    clock : Clock
    seconds : float
        Longest time to search.

    Yields
    ------
    Progress

    Returns
    -------
    (k,) int64 or None
    bool
        Whether the search came to its end.
    """
    search = _FirstInOrder(instance, goal)
    finished = yield from search.run(clock, seconds)
    return search.best, finished


def merit(instance: Instance, chosen: Integer) -> tuple[int, float, float, list[int]]:
    """Return number, price, double coverage and order as a key, smallest first, rounded to what counts as equal."""
    doubly = instance.doubly(chosen)
    return (
        len(chosen),
        relative_price(instance, math.fsum(instance.price[chosen])),
        -(doubly if instance.step == 1 else round(doubly / instance.step)),
        chosen.tolist(),
    )


def relative_price(instance: Instance, price: float) -> float:
    """Return a price in units of the dearest sensor's, rounded to what counts as equal."""
    return round(price / (float(instance.price.max(initial=0.0)) or 1.0), 8)


class Search:
    """The walk over all placements in greedy order; what is wanted of them is up to `_take` and `_is_hopeless`."""

    def __init__(self, instance: Instance, goal: float) -> None:
        self.instance = instance
        self.matrix = instance.matrix
        self.weight = instance.weight.astype(self.matrix.dtype)
        self.goal = instance.attainable(goal) - instance.slack
        self.satisfied = False
        self._clock = Clock(math.inf)

    def run(self, clock: Clock, seconds: float, most: float = math.inf) -> Generator[Progress, None, bool]:
        """Search depth first; return whether all was seen, or enough, before the time was up, in ``most`` branches."""
        end = clock.elapsed + min(seconds, clock.left)
        self._clock = clock
        everyone = np.arange(len(self.instance))
        stack = [_sorted_node((), 0.0, -math.inf, everyone, self.matrix @ self.weight, None)]
        nodes = 0
        while stack and not self.satisfied:
            if clock.elapsed > end or nodes >= most:
                return False
            yield Progress(0, 0, f"searching placements, {nodes:,} branches so far")
            nodes += 1
            stack += reversed((yield from self._expand(stack.pop())))
        return True

    def _take(self, chosen: tuple[int, ...], value: float) -> float:
        """Take a placement that reaches the goal; return the goal that placements with more sensors must reach."""
        raise NotImplementedError

    def _is_hopeless(self, chosen: tuple[int, ...], followers: Integer) -> bool:
        """Whether nothing below is wanted for another reason than its coverage."""
        raise NotImplementedError

    def _expand(self, node: _Node) -> Generator[Progress, None, list[_Node]]:
        """Return the children of a node that can still reach the goal; take those that do."""
        goal = max(node.goal, self.goal)
        left = self._left(node)
        if left == 0:
            return []
        node, children = _within_reach(node, left, goal)
        if children == 0 or self._is_hopeless(node.chosen, node.followers):
            return []
        if left == 1:
            self._take_leaves(node, children)
            return []
        rest = self._rest(node, left)
        if left >= RELAXED and children >= WIDE:
            node, children = yield from self._relaxed(node, rest, left, goal)
            if children == 0:
                return []
            rest = self._rest(node, left)
        later, gains_after = _after_each(rest, node.gains, children)
        best = _best_completions(rest, node.gains, np.where(later, gains_after, 0.0), left - 1)
        values = node.value + node.gains[:children].astype(np.float64)
        kept = []
        for row in np.flatnonzero(values + best >= goal):
            chosen, value = (*node.chosen, int(node.followers[row])), float(values[row])
            wanted = max(node.goal, self.goal)
            if value >= wanted:
                wanted = self._take(chosen, value)
            if value + best[row] >= wanted:
                after = later[row]
                kept.append(
                    _sorted_node(
                        chosen, value, wanted, node.followers[after], gains_after[row, after], node.multipliers
                    )
                )
        return kept

    def _left(self, node: _Node) -> int:
        """Return how many sensors can follow at most."""
        left = self.instance.count - len(node.chosen)
        if not math.isfinite(self.instance.budget):
            return left
        prices = np.sort(self.instance.price[node.followers])[:left]
        spent = math.fsum(self.instance.price[list(node.chosen)])
        return int(np.count_nonzero(self.instance.affordable(spent + np.cumsum(prices))))

    def _take_leaves(self, node: _Node, children: int) -> None:
        for candidate, gain in zip(node.followers[:children].tolist(), node.gains[:children].tolist(), strict=True):
            if node.value + gain >= max(node.goal, self.goal):
                self._take((*node.chosen, candidate), node.value + gain)

    def _rest(self, node: _Node, left: int) -> Instance:
        """Return what is left to decide at a node: its followers, the targets that are not seen yet."""
        instance, followers = self.instance, node.followers
        unseen = self._unseen(node)
        spent = math.fsum(instance.price[list(node.chosen)])
        return replace(
            instance,
            visible=instance.visible[np.ix_(followers, unseen)],
            weight=instance.weight[unseen],
            price=instance.price[followers],
            conflict=instance.conflict[np.ix_(followers, followers)],
            clique=instance.clique[followers],
            mandatory=np.zeros((0, len(followers)), bool),
            original=instance.original[followers],
            count=left,
            budget=max(instance.budget * (1 + TIE) - spent, 0.0),
        )

    def _unseen(self, node: _Node) -> Integer:
        return np.flatnonzero(~self.instance.visible[list(node.chosen)].any(axis=0))

    def _relaxed(
        self, node: _Node, rest: Instance, left: int, goal: float
    ) -> Generator[Progress, None, tuple[_Node, int]]:
        """Drop the followers that a Lagrangian bound rules out; return also how many are children."""
        unseen = self._unseen(node)
        start = None if node.multipliers is None else node.multipliers[unseen]
        steps = FIRST_STEPS if start is None else LATER_STEPS
        keep, bound = yield from lagrangian_bound(rest, goal - node.value, self._clock, start, steps)
        multipliers = np.zeros(len(self.weight))
        multipliers[unseen] = bound.targets
        node = replace(node, followers=node.followers[keep], gains=node.gains[keep], multipliers=multipliers)
        return _within_reach(node, left, goal)


def _within_reach(node: _Node, left: int, goal: float) -> tuple[_Node, int]:
    """Drop the followers whose gains are too small, and return how many can come next."""
    sums = np.concatenate(([0.0], np.cumsum(node.gains, dtype=np.float64), np.full(left, np.sum(node.gains))))
    reach = node.value + sums[left : left + len(node.gains)] - sums[: len(node.gains)]
    # A follower matters only where it reaches the goal together with the largest gains.
    useful = int(np.count_nonzero(node.value + sums[left - 1] + node.gains >= goal))
    node = replace(node, followers=node.followers[:useful], gains=node.gains[:useful])
    return node, int(np.count_nonzero(reach >= goal))


def _after_each(rest: Instance, gains: Numbers, children: int) -> tuple[Boolean, Numbers]:
    """Return who may follow each child, and the gains of all followers on top of it, (children, n) each."""
    matrix = rest.matrix
    overlap = (matrix[:children] * rest.weight.astype(matrix.dtype)) @ matrix.T
    later: Boolean = np.arange(len(gains)) > np.arange(children)[:, None]
    later &= ~rest.conflict[:children]
    later &= rest.price[:children, None] + rest.price <= rest.budget
    return later, np.maximum(gains - overlap, 0.0)


def _best_completions(rest: Instance, gains: Numbers, gains_after: Numbers, left: int) -> Float:
    """Return what so many sensors more add to each child at most, within what it leaves of the budget, (children,)."""
    best: Float = _largest(gains_after, left).sum(axis=1, dtype=np.float64)
    multiplier = select(rest, gains.astype(np.float64)).multiplier
    if multiplier > 0:
        net = np.maximum(gains_after - multiplier * rest.price, 0.0)
        spent = multiplier * (rest.budget - rest.price[: len(net)])
        best = np.minimum(best, _largest(net, left).sum(axis=1, dtype=np.float64) + spent)
    return best


def _sorted_node(
    chosen: tuple[int, ...],
    value: float,
    goal: float,
    followers: Integer,
    gains: Numbers,
    multipliers: Float | None,
) -> _Node:
    order = np.argsort(-gains, kind="stable")
    return _Node(chosen, value, goal, followers[order], gains[order], multipliers)


class _BestPlacements(Search):
    """Lists the placements of largest coverage: a better one clears the list."""

    def __init__(self, instance: Instance, goal: float, most: int, bound: float) -> None:
        super().__init__(instance, goal)
        self.found: list[Integer] = []
        self.overflowed = False
        self._most = most
        self._bound = bound
        self._value = -math.inf

    def _take(self, chosen: tuple[int, ...], value: float) -> float:
        instance = self.instance
        placement = np.sort(np.array(chosen, dtype=np.int64))
        if not instance.feasible(placement):
            return self.goal
        if value > self._value + instance.slack:
            self.found, self.overflowed, self._value = [], False, value
            self.goal = value - instance.slack
        if len(self.found) < self._most:
            self.found.append(placement)
        else:
            # one more than can be listed: from here on only a better one is of interest
            self.overflowed = True
            self.goal = self._value + instance.step - instance.slack
        self.satisfied = self.overflowed and self._bound < self._value + instance.step - instance.slack
        return value + instance.step - instance.slack

    def _is_hopeless(self, chosen: tuple[int, ...], followers: Integer) -> bool:  # noqa: ARG002 -- coverage is all
        return False


class _FirstInOrder(Search):
    """Keeps the first by merit, and cuts what is dearer or doubly covers less.

    What is covered once and what is covered twice are together a submodular
    function too: the largest gains bound it in the same way.
    """

    def __init__(self, instance: Instance, goal: float) -> None:
        super().__init__(instance, goal)
        self.best: Integer | None = None
        self._key: tuple[int, float, float, list[int]] | None = None

    def _take(self, chosen: tuple[int, ...], value: float) -> float:  # noqa: ARG002 -- the goal is all that counts
        placement = np.sort(np.array(chosen, dtype=np.int64))
        if self.instance.feasible(placement):
            key = merit(self.instance, placement)
            if self._key is None or key < self._key:
                self.best, self._key = placement, key
        return self.goal

    def _is_hopeless(self, chosen: tuple[int, ...], followers: Integer) -> bool:
        if self._key is None:
            return False
        instance, left = self.instance, self.instance.count - len(chosen)
        prices = np.sort(instance.price[followers])[:left]
        price = relative_price(instance, math.fsum(instance.price[list(chosen)]) + math.fsum(prices))
        if price != self._key[1]:
            return price > self._key[1]
        twice = np.minimum(instance.visible[list(chosen)].sum(axis=0), 2)
        reach = float(instance.weight @ twice) + float(_largest(self._below_two(twice)[followers], left).sum())
        doubly = reach - self.goal
        return (doubly if instance.step == 1 else doubly / instance.step + 1) < -self._key[2]

    def _below_two(self, times: Integer) -> Float:
        return self.instance.gains(self.instance.weight * (times < 2))


def _largest(values: Numbers, number: int) -> Numbers:
    """Return the largest numbers of each row, in any order."""
    if values.shape[-1] <= number:
        return values
    return np.partition(values, values.shape[-1] - number, axis=-1)[..., -number:]
