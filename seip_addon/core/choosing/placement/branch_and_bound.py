r"""Best-first branch and bound on the marginal gains of sensors, for coverage and multi-cover.

A placement is built in greedy order: each sensor adds no more than the one before it, because coverage is submodular.
At a node with k sensors still to come the best completion adds at most the sum of the k largest gains; these sums fall
along the sorted candidates, so all children below the first that falls short are cut at once (cf. Nemhauser and Wolsey
1981 on maximising submodular set functions). The gains on top of all children come from one matrix product, and cut
most of them before they become nodes. Where rings of beams overlap a little everywhere the relaxed integer program is
weak and this bound is strong.

The value of a target by the number of sensors that see it is concave (`multi_cover`), so that the value of a placement
is submodular, and exact for the last sensor.

The largest bound among the open nodes holds for every placement that the search has not visited. It falls as the search
continues, and a stopped search can be resumed.

Weights are whole numbers, so a search meets the same placements in the same order on every machine.
"""

import math
from collections.abc import Generator
from dataclasses import dataclass, replace
from heapq import heappop, heappush

import numpy as np

from ...arrays import Boolean, Float, Integer
from ...progress import Progress
from .bounds import Bound, lagrangian_bound, select
from .problem import TIE_TOLERANCE
from .reduced_problem import MAX_EXACT_DOUBLE, WHOLE_SLACK, Instance, Numbers
from .search_limits import Clock

MIN_SENSORS = 3  # least number of sensors to come for which a node is also bounded by Lagrangian relaxation

MIN_CHILDREN = 60
"""Least number of children of a node for which it is relaxed."""

TRIALS, MAX_KEPT_SHARE = 4, 0.5
"""Trials of the relaxation for each number of sensors to come, and the mean share of children that it may keep in them.

If it keeps more, nodes with this number of sensors to come are no longer relaxed.
"""

FIRST_STEPS, LATER_STEPS = 300, 30  # steps of the multipliers at the first node, and at nodes that start from others
MAX_ENTRIES = 30_000_000  # largest number of entries of V that the search keeps as numbers: 240 MB, or twice that
OPERATIONS_PER_FETCH = 8  # multiplications that take as long as fetching an entry of V

MAX_WAITING_FOLLOWERS = 16_000_000
"""Largest number of followers in the queue of open nodes: 200 MB. Beyond it, new nodes are searched first."""


@dataclass(frozen=True, eq=False)
class _Node:
    """Sensors chosen so far and the candidates that may follow, largest gain first.

    Parameters
    ----------
    bound : float
        No placement below this node has a larger objective value.
    chosen : tuple of int
        Candidates in the order in which they were chosen.
    value : float
        Objective value of the chosen candidates.
    goal : float
        Least objective value of placements below this node that are of interest.
    followers : (n,) int64
        Candidates that may be added.
    gains : (n,) float
        Upper bound on what each follower adds.
    multipliers : (t,) float64, optional
        Lagrangian multipliers of the targets to begin from.
    multiplier : float
        Multiplier of the budget to begin from.
    """

    bound: float
    chosen: tuple[int, ...]
    value: float
    goal: float
    followers: Integer
    gains: Numbers
    multipliers: Float | None = None
    multiplier: float = 0.0


def is_worthwhile(instance: Instance, candidates: Integer) -> bool:
    """Return whether a search among some candidates of an instance fits into useful memory."""
    return len(candidates) * max(len(instance.weight), len(candidates)) <= MAX_ENTRIES


def merit(instance: Instance, chosen: Integer) -> tuple[int, float, float, list[int]]:
    """Return number, price, double coverage and order as a key, smallest first, rounded to what counts as equal."""
    doubly = instance.doubly(chosen)
    return (
        len(chosen),
        round(math.fsum(instance.price[chosen]) / (float(instance.price.max(initial=0.0)) or 1.0), 8),
        -(doubly if instance.step == 1 else round(doubly / instance.slack)),
        chosen.tolist(),
    )


class Search:
    """Search of all placements in greedy order; subclasses select results in `_take`.

    Parameters
    ----------
    goal : float
        Least objective value of a result.
    root : (n,) int64 and Bound, optional
        Candidates to search among, and an upper bound on the value of their placements, where known.

    Attributes
    ----------
    goal : float
        Least value of a result. It rises as placements are found.
    satisfied : bool
        Whether enough placements were found.
    """

    def __init__(self, instance: Instance, goal: float, root: tuple[Integer, Bound] | None = None) -> None:
        self.instance = instance
        self.goal = instance.attainable(goal) - instance.slack
        self.satisfied = False
        self._clock = Clock(math.inf)
        self._matrix = instance.matrix
        self._by_target = np.ascontiguousarray(self._matrix.T)
        self._seen_by = np.ascontiguousarray(instance.visible.T)
        self._weight = instance.weight.astype(self._matrix.dtype)
        # For plain coverage the weight that two candidates both see is the same at every node: computed once, it saves
        # most of the work in `_overlaps`. With several values per target it depends on how often each is seen already.
        self._overlap = (self._matrix * self._weight) @ self._by_target if instance.cover.top == 1 else None
        self._excluded = instance.conflict | np.eye(len(instance), dtype=bool)
        # running sums of all gains, each at most the total, are exact below MAX_EXACT_DOUBLE and rounded beyond
        most = instance.total * (len(instance) + 1)
        self._rounding = 0.0 if most < MAX_EXACT_DOUBLE else most * len(instance) / MAX_EXACT_DOUBLE
        self._queue: list[tuple[tuple[float, int, int], _Node]] = []
        self._stack: list[_Node] = []
        self._serial = self._waiting = self._met = 0
        self._left_over: dict[int, list[float]] = {}
        # The root has no sensors, and all candidates as followers. The stable sort settles ties by the canonical order
        # of candidates, so that the tree does not depend on the machine.
        gains = self._matrix @ instance.unseen_layers[0].astype(self._matrix.dtype)
        first = np.argsort(-gains, kind="stable")
        bound, multipliers = math.inf, None
        if root is not None:
            first, bound, multipliers = first[np.isin(first, root[0])], root[1].value, root[1].targets
        self._push([_Node(bound, (), 0.0, -math.inf, first, gains[first], multipliers)])

    @property
    def bound(self) -> float:
        """Upper bound on the value of placements not visited yet; -inf once none of these can reach the goal."""
        # the queue is a heap by bound, so that its first node has the largest; the stack has no order
        bounds = [node.bound for node in self._stack] + [node.bound for _, node in self._queue[:1]]
        bound = max(bounds, default=-math.inf)
        return bound if bound >= self.goal - self._rounding else -math.inf

    def run(self, clock: Clock, seconds: float) -> Generator[Progress, None, bool]:
        """Continue the search; return whether it ended within the limits."""
        end = clock.elapsed + min(seconds, clock.left)
        self._clock = clock
        while self._is_open() and not self.satisfied:
            if clock.elapsed > end or clock.left <= 0:
                return False
            yield Progress(0, 0, f"searching placements, {self._met:,} branches so far")
            self._met += 1
            clock.spend(len(self.instance))
            self._push((yield from self._expand(self._pop())))
        return True

    def _take(self, placement: Integer) -> float:
        """Record a placement that may reach the goal; return the goal for placements with more sensors."""
        raise NotImplementedError

    def offer(self, chosen: Integer) -> float:
        """Record a placement found elsewhere; return the goal for placements with more sensors."""
        return self._take(np.sort(np.array(chosen, dtype=np.int64)))

    def _is_open(self) -> bool:
        # once the largest bound in the queue is below the goal, all nodes in it are
        if not self._stack and self._queue and self._queue[0][1].bound < self.goal - self._rounding:
            self._queue.clear()
        return bool(self._stack or self._queue)

    def _pop(self) -> _Node:
        if self._stack:
            return self._stack.pop()
        node = heappop(self._queue)[1]
        self._waiting -= len(node.followers)
        return node

    def _push(self, children: list[_Node]) -> None:
        # Best first keeps all open nodes in memory. Beyond the limit the search goes depth first instead, which needs
        # little memory and finishes subtrees. The proof stays complete, since `bound` includes the stack. Children are
        # pushed last to first, so that the one of largest gain is taken from the stack first.
        for child in reversed(children):
            if self._waiting > MAX_WAITING_FOLLOWERS:
                self._stack.append(child)
            else:
                self._serial += 1
                # of equal bounds the deepest node first, as it is nearest to a placement; then in the order of creation
                heappush(self._queue, ((-child.bound, -len(child.chosen), self._serial), child))
                self._waiting += len(child.followers)

    def _expand(self, node: _Node) -> Generator[Progress, None, list[_Node]]:
        """Return the children of a node that can still reach the goal, and record the placements that do."""
        # The goal may have risen since the node was queued: everything about it is checked again here.
        goal = self._wanted(node)
        left = 0 if node.bound < goal else self._left(node)
        if left == 0:
            return []
        node, children = _within_reach(node, left, goal)
        if children == 0:
            return []
        if left == 1:
            self._take_leaves(node, children)
            return []
        # The sum of the largest gains counts a target once for each follower that sees it. The Lagrangian bound
        # corrects that, but takes a product with V in each step: it is computed only where it may remove many children.
        # At the root the caller may have given its result already.
        known = node.multipliers is not None and not node.chosen
        if children >= MIN_CHILDREN and not known and self._relaxation_pays(left):
            before = children
            node, children = yield from self._relaxed(node, left, goal)
            self._left_over.setdefault(left, []).append(children / before)
            if children == 0:
                return []
        kept = self._children(node, children, left, goal)
        # With two sensors to come the children have leaves only. These are recorded at once and not queued: their
        # placements are known here, and bounds could not cut any more of them.
        if left > 2:
            return kept
        for child in kept:
            self._met += 1
            self._take_leaves(child, len(child.followers))
        return []

    def _children(self, node: _Node, children: int, left: int, goal: float) -> list[_Node]:
        """Return the children of a node whose bounds reach the goal, after offering those that reach it themselves.

        Child i adds follower i and keeps as followers only those after it. So every set of followers is below exactly
        one child, the one of its first member.
        """
        times = self.instance.times(node.chosen)
        # Row i has the gains of all followers after child i is added: their gains so far, less what child i takes away.
        # One matrix product gives all rows, and the sum of the largest gains in each is that child's bound.
        later = self._may_follow(node, children)
        gains_after = node.gains - self._overlaps(times, node.followers, children)
        multiplier, best = self._best_completions(node, np.where(later, gains_after, 0.0), left - 1)
        values = node.value + node.gains[:children].astype(np.float64)
        kept = []
        for row in np.flatnonzero(values + best >= goal):
            chosen, value, wanted = (*node.chosen, int(node.followers[row])), float(values[row]), self._wanted(node)
            # A placement that reaches the goal raises it for all placements with more sensors, so that the child, which
            # was within reach before, may not be any longer.
            if value >= wanted:
                wanted = self.offer(np.array(chosen))
            if value + best[row] < wanted:
                continue
            # sorted again by the gains after this child: greedy order is what makes the bounds of children fall
            after, bound = later[row], min(node.bound, value + float(best[row]))
            order = np.flatnonzero(after)[np.argsort(-gains_after[row, after], kind="stable")]
            followers, gains = node.followers[order], gains_after[row, order]
            kept.append(_Node(bound, chosen, value, wanted, followers, gains, node.multipliers, multiplier))
        return kept

    def _wanted(self, node: _Node) -> float:
        """Return the objective value that a placement below a node must have, less the largest rounding error."""
        return max(node.goal, self.goal) - self._rounding

    def _left(self, node: _Node) -> int:
        """Return the largest number of sensors that can follow."""
        # the cheapest followers, in turn, until the budget is spent: no other choice buys more sensors
        left = self.instance.count - len(node.chosen)
        if not math.isfinite(self.instance.budget):
            return left
        prices = np.sort(self.instance.price[node.followers])[:left]
        spent = math.fsum(self.instance.price[list(node.chosen)])
        return int(np.count_nonzero(self.instance.affordable(spent + np.cumsum(prices))))

    def _take_leaves(self, node: _Node, children: int) -> None:
        """Record the placements with one sensor more."""
        if self._left(node) == 0:
            return
        # followers come by falling gain, and for the last sensor gains are exact: the first that falls short ends it
        for candidate, gain in zip(node.followers[:children].tolist(), node.gains[:children].tolist(), strict=True):
            if self.satisfied or node.value + gain < self._wanted(node):
                return
            self.offer(np.array((*node.chosen, candidate)))

    def _rest(self, node: _Node, left: int, targets: Integer) -> Instance:
        """Return the instance below a node: its followers, the given targets, and the number and budget that are left.

        Conflicts other than cliques, and mandatory groups, are left out. That only enlarges the set of placements, so
        that an upper bound on it is one on the placements below the node.
        """
        instance, followers = self.instance, node.followers
        spent = math.fsum(instance.price[list(node.chosen)])
        return replace(
            instance,
            visible=self._seen_by[targets][:, followers].T,  # rows of targets are copied faster
            weight=instance.weight[targets],
            price=instance.price[followers],
            conflict=np.broadcast_to(np.False_, (len(followers), len(followers))),  # bounds use the cliques only
            clique=instance.clique[followers],
            mandatory=np.zeros((0, len(followers)), bool),
            original=instance.original[followers],
            count=left,
            budget=max(instance.budget * (1 + TIE_TOLERANCE) - spent, 0.0),
        )

    def _relaxation_pays(self, left: int) -> bool:
        """Whether relaxing nodes with ``left`` sensors to come has cut enough children so far."""
        shares = self._left_over.get(left, [])
        return left >= MIN_SENSORS and (len(shares) < TRIALS or sum(shares) <= MAX_KEPT_SHARE * len(shares))

    def _relaxed(self, node: _Node, left: int, goal: float) -> Generator[Progress, None, tuple[_Node, int]]:
        """Drop the followers that a Lagrangian bound rules out; return also the number of children."""
        instance = self.instance
        layers = instance.layers(instance.times(node.chosen), left)
        # Targets to which no sensor can add any more are left out: they would only cost time. A child starts from the
        # multipliers of its parent, which differs by one sensor, and so needs fewer steps than the root.
        open_targets = np.flatnonzero(layers[0] > 0)
        rest = self._rest(node, left, open_targets)
        start = None if node.multipliers is None else node.multipliers[open_targets]
        steps = FIRST_STEPS if start is None else LATER_STEPS
        keep, bound = yield from lagrangian_bound(
            rest, goal - node.value, self._clock, start, steps, layers[:, open_targets]
        )
        multipliers = np.zeros(len(instance.weight))
        multipliers[open_targets] = bound.targets
        node = replace(
            node,
            bound=min(node.bound, node.value + bound.value),
            followers=node.followers[keep],
            gains=node.gains[keep],
            multipliers=multipliers,
        )
        return _within_reach(node, left, goal)

    def _may_follow(self, node: _Node, children: int) -> Boolean:
        """Return which followers may follow each child, (children, n) bool."""
        instance, followers = self.instance, node.followers
        first = followers[:children]
        # only those after the child in the order of gains: the sets with an earlier one are below that one's node
        later: Boolean = np.arange(len(followers)) > np.arange(children)[:, None]
        later &= ~self._excluded[first[:, None], followers]
        if math.isfinite(instance.budget):
            spent = math.fsum(instance.price[list(node.chosen)])
            later &= instance.affordable(spent + instance.price[first, None] + instance.price[followers])
        return later

    def _overlaps(self, times: Integer, followers: Integer, children: int) -> Numbers:
        """Return the loss of each follower's gain by the choice of each child, (children, n).

        For plain coverage this is the weight that both see and no chosen sensor sees.

        Parameters
        ----------
        times : (t,) int64
            Number of chosen sensors that see each target.
        """
        instance = self.instance
        # A target that child and follower both see, and that is seen n times, adds increment(n) before the child is
        # chosen and increment(n + 1) after it. The sum of these differences over the common targets is the loss.
        lost = instance.increments(times) - instance.increments(times + 1)
        # Only targets that some child sees matter. For plain coverage there are two ways to the same whole numbers: add
        # up the targets that nobody sees yet, or take those seen already from the overlap of all targets that was
        # computed at the start. The product over fewer targets is the cheaper one.
        by_child = instance.visible[followers[:children]].any(axis=0)
        kept, changed = np.flatnonzero(by_child & (lost == 0)), np.flatnonzero(by_child & (lost != 0))
        overlap = self._overlap if len(kept) <= len(changed) else None
        targets = changed if overlap is None else kept
        factor = (lost if overlap is None else instance.weight)[targets].astype(self._matrix.dtype)[:, None]
        self._clock.spend(len(targets) * len(followers) * (children + OPERATIONS_PER_FETCH))
        rows, by_target = followers[:children], self._by_target[targets]
        # V is kept by target here, since whole rows are fetched fast. Fetching the columns of the followers first costs
        # another copy, which pays where these are fewer than half of all candidates.
        if 2 * len(followers) < len(instance):
            by_target = by_target[:, followers]
            shared: Numbers = (by_target[:, :children] * factor).T @ by_target
        else:
            shared = ((by_target[:, rows] * factor).T @ by_target)[:, followers]
        return shared if overlap is None else overlap[rows[:, None], followers] - shared

    def _best_completions(self, node: _Node, gains_after: Numbers, left: int) -> tuple[float, Float]:
        """Return upper bounds on what ``left`` more sensors add to each child within the budget that is left.

        Returns
        -------
        float
            Multiplier of the budget.
        (children,) float64
            Upper bound for each child.
        """
        # Submodularity: what several sensors add together is at most the sum of what each adds by itself.
        best: Float = _largest(gains_after, left).sum(axis=1, dtype=np.float64)
        if not math.isfinite(self.instance.budget):
            return 0.0, best
        rest = self._rest(node, left + 1, np.zeros(0, dtype=np.int64))
        # Under a budget C, also for any μ >= 0: gains are at most μ C plus the sum of the largest positive gains less μ
        # times the price. Every μ gives a valid bound, so that the one for the node serves all its children, and the
        # search for it starts from the parent's.
        multiplier = select(rest, node.gains.astype(np.float64), node.multiplier).multiplier
        if multiplier > 0:
            net = np.maximum(gains_after - multiplier * rest.price, 0.0)
            spent = multiplier * (rest.budget - rest.price[: len(net)])
            best = np.minimum(best, _largest(net, left).sum(axis=1, dtype=np.float64) + spent)
        return multiplier, best


class BestPlacements(Search):
    """Search that lists the placements of largest coverage among those that cover at least a goal.

    A placement that covers more raises the goal, and placements below the new goal leave the list.

    Parameters
    ----------
    goal : float
        Least weight to cover.
    most : int
        Length of the list; of more placements it has the first that the search meets.
    bound : float
        Upper bound on the weight that any placement covers: the search ends when the list is full of such placements.

    Attributes
    ----------
    overflowed : bool
        Whether there are more placements than the list has. If not, then at the end of the search it has all that cover
        the same weight, except those with idle sensors.
    """

    def __init__(self, instance: Instance, goal: float, most: int, bound: float) -> None:
        super().__init__(instance, goal)
        self.overflowed = False
        self._listed: dict[bytes, tuple[float, Integer]] = {}
        self._most = most
        self._bound = bound
        self._value = -math.inf

    @property
    def found(self) -> list[Integer]:
        """Sorted candidates of the placements that cover most, in the order in which the search met them."""
        return [placement for _, placement in self._listed.values()]

    def _take(self, placement: Integer) -> float:
        instance, value = self.instance, self.instance.value(placement)
        if value < self.goal or not instance.feasible(placement):
            return self.goal
        # A placement with more sensors and the same coverage is not a result, as fewer sensors come first among ties:
        # below this one only placements that cover at least one unit more count. Weights are whole numbers.
        more = value + 1 - WHOLE_SLACK
        if value > self._value:
            self.overflowed &= value <= self._value + instance.slack
            self._value, self.goal = value, value - instance.slack
            self._listed = {key: tie for key, tie in self._listed.items() if tie[0] >= self.goal}
        # a placement may come twice: from the search, and from `offer`
        if placement.tobytes() in self._listed:
            return more
        if len(self._listed) < self._most:
            self._listed[placement.tobytes()] = value, placement
        else:
            # the list is full: from here on only a better placement is of interest
            self.overflowed = True
            self.goal = max(self.goal, more)
        self.satisfied = self.overflowed and self._bound < more
        return more


def _within_reach(node: _Node, left: int, goal: float) -> tuple[_Node, int]:
    """Drop the followers whose gains are too small, and return the number of children."""
    gains = node.gains.astype(np.float64)
    # If follower i comes next, those after it follow: the bound of child i is the sum of ``left`` gains from i on, a
    # difference of running sums. The repeated total at the end makes windows that reach beyond the last follower end
    # there. As gains fall, so do the bounds, and the children within reach are the first ones.
    sums = np.concatenate(([0.0], np.cumsum(gains), np.full(left, gains.sum())))
    reach = node.value + sums[left : left + len(gains)] - sums[: len(gains)]
    # A follower is of use only if it reaches the goal together with the ``left`` - 1 largest gains. This keeps more
    # followers than there are children: one too small to come next may still come later.
    useful = int(np.count_nonzero(node.value + sums[left - 1] + gains >= goal))
    node = replace(node, followers=node.followers[:useful], gains=node.gains[:useful])
    return node, int(np.count_nonzero(reach >= goal))


def _largest(values: Numbers, number: int) -> Numbers:
    """Return the largest numbers of each row, in any order."""
    if values.shape[-1] <= number:
        return values
    return np.partition(values, values.shape[-1] - number, axis=-1)[..., -number:]
