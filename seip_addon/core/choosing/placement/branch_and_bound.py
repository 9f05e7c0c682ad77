"""Branch and bound, which shares its best placement with the search: best-first on linear bounds, or by gains.

A node is the set of placements with some chosen candidates and any of those that are left. Its candidates are sorted by
what they contribute to its bound; each child chooses one of them and leaves out those before it. The bounds of children
fall along that order, so that all after the first that falls short are cut at once. A child begins its own bound from
the parameters of its parent: few steps are enough.

The search goes in stages, each with a goal between the best value and the bound: what cannot reach the goal waits for a
later stage. So the bound of all falls early, at little work for each node, and a stopped search can be resumed.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, field, replace
from heapq import heapify, heappop, heappush

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Boolean, Float, Integer
from ...base.progress import Progress
from .bounds import Bound, Composition, Rest, bound_at, compositions, falling_bounds, rest_of
from .concave import ConcaveSum, StepSum
from .incumbent import Incumbent

ROOT_STEPS, NODE_STEPS = 300, 8  # largest number of steps of the bound at the root, and at each other node
ROOT_SHARE = 0.4  # share of the work for the bounds of the first nodes
ROUND = 25  # steps at the root after which candidates that the bound rules out are dropped
LEAST_FALL = 0.001  # share of the bound that a round must gain for another one
FEW_SENSORS, DEEP_SHARE, GOAL_SHARE = 5, 0.36, 0.7
"""Share of the gap that remains at the end of each stage, up to a number of sensors and beyond it: with few sensors a
stage ends soon, and a low goal spares the work of those between."""
LEAST_GAP = 0.002  # gap below which the next stage is the last one
MAX_PAIRS = 4_000_000  # pairs of a child and a candidate that are bounded at once
PAIR_OPERATIONS = 60.0  # multiplications that take as long as what is done for each such pair
PRODUCT_SHARE = 0.1  # time of a multiplication in a product of matrices, as a share of one in other steps
SELECT_OPERATIONS = 2.0  # multiplications that take as long as to select an amount for a node
REPORTED = 10  # nodes between two reports


@dataclass(order=True, slots=True)
class _Node:
    """A set of placements that has not been searched.

    Parameters
    ----------
    rank : float
        Negative upper bound on their values: the heap has the node of the largest bound first.
    number : int
        Serial number, which settles equal bounds.
    chosen : (k,) int64
        Candidates that all of them contain.
    left : (n,) int64
        Candidates that they may contain besides, ascending.
    first : (f,) int64
        Candidates of which they contain at least one: usually all that are left.
    parameters : (t,) float64
        Parameters of a bound to begin from.
    composition : Composition, optional
        Numbers of sensors of each price.
    able : (ceil(n / 8),) uint8, optional
        Bits of the candidates ``left`` that belong to it, where it shares these with its siblings, in no order: most
        children are never taken, and there are many of them.
    """

    rank: float
    number: int
    chosen: Integer = field(compare=False)
    left: Integer = field(compare=False)
    first: Integer = field(compare=False)
    parameters: Float = field(compare=False)
    composition: Composition | None = field(compare=False, default=None)
    able: NDArray[np.uint8] | None = field(compare=False, default=None)

    def unpacked(self) -> _Node:
        """Return the node with candidates of its own, ascending."""
        if self.able is None:
            return self
        left = np.sort(self.left[np.unpackbits(self.able, count=len(self.left)).view(bool)])
        return replace(self, left=left, first=left, able=None)


@dataclass(frozen=True, eq=False)
class _Problem:
    """The problem of a node: what the candidates that are left can add.

    Parameters
    ----------
    node : _Node
    left, first : int64
        As in `_Node`.
    block : ConcaveSum
        Sum over the candidates that are left, and the targets to which they may add anything.
    rest : Rest
    base : (t,) float64
        Amounts of the chosen sensors at these targets.
    raised : float
        Value of the other targets, and the rounding error.
    """

    node: _Node
    left: Integer
    first: Integer
    block: ConcaveSum
    rest: Rest
    base: Float
    raised: float


class BranchAndBound:
    """Search for a proof that no placement is better than the best one so far, and for better ones.

    Parameters
    ----------
    incumbent : Incumbent
        Best placement so far, with the limit of work; it is improved where a better one is met.
    block : ConcaveSum
        Sum over all candidates of the instance that is nowhere below the objective; see `Instance.relaxed`.
    """

    def __init__(self, incumbent: Incumbent, block: ConcaveSum) -> None:
        self.incumbent, self.instance, self._block = incumbent, incumbent.instance, block
        self._rounding, self._total = block.rounding, block.value(np.arange(len(block)))
        self._number = self._met = 0
        self._open: list[_Node] = []
        self._waiting: list[_Node] = []
        self._goal = -math.inf
        self._spare = 0.0

    @property
    def bound(self) -> float:
        """Upper bound on the value of any placement."""
        ranks = [node.rank for node in self._waiting] + [node.rank for node in self._open[:1]]
        return max(self.incumbent.value, -min(ranks, default=math.inf))

    def left(self) -> Integer:
        """Return the candidates of the best placement and of all open nodes, ascending."""
        nodes = [node.unpacked() for node in (*self._open, *self._waiting)]
        members = [part for node in nodes for part in (node.chosen, node.left)]
        left: Integer = np.unique(np.concatenate([self.incumbent.chosen, *members]))
        return left

    def start(self) -> Generator[Progress, None, Float]:
        """Bound all placements, and open the first nodes: one, or one for each composition that spends the budget.

        Returns
        -------
        (c,) float64
            Rank of the candidates: the net scores of the bound on all placements, minus infinity for those that it
            rules out.
        """
        every, work = np.arange(len(self.instance)), self.incumbent.work
        begin = self._block.start(self._block.together(self.incumbent.chosen))
        kinds = compositions(self.instance)
        last = (1.0 - ROOT_SHARE) * work.left
        rank = np.full(len(every), -math.inf)
        root = _Node(-math.inf, 0, every[:0], every, every, begin)
        self._spare = last + (0.5 * (work.left - last) if kinds else 0.0)
        found = yield from self._root(root, begin)
        if found is not None:
            root, rank[found[0].left] = found
        if found is not None and not kinds:
            self._push(root, -root.rank)
        for number, composition in enumerate(kinds if found is not None else []):
            # each has its share of the work; without any left the parameters of the bound on all give a bound on each
            self._spare = work.left - max(0.0, work.left - last) / (len(kinds) - number)
            found = yield from self._root(replace(root, composition=composition), begin)
            if found is not None:
                self._push(found[0], -found[0].rank)
        self._spare = 0.0
        self._note(self.bound)
        yield self.incumbent.progress("computing an upper bound")
        return rank

    def _root(self, root: _Node, begin: Float) -> Generator[Progress, None, tuple[_Node, Float] | None]:
        """Return a root with its bound, and the net scores of the candidates that are left; None if it is cut.

        Parameters
        ----------
        begin : (t,) float64
            Parameters from which the bound is lowered; those of the root may give a lower one.
        """
        problem, targets = self._problem(root, root.left)
        known = bound_at(problem.block, problem.rest, problem.base, root.parameters[targets], problem.raised)
        bound = known
        if root.composition is not None and self.incumbent.work.left > self._spare:
            bound = bound_at(problem.block, problem.rest, problem.base, begin[targets], problem.raised)
        if root.composition is None:
            lowest = problem.block.lowest(problem.base)
            by_gains = bound_at(problem.block, problem.rest, problem.base, lowest, problem.raised)
            bound = min(bound, by_gains, key=lambda one: one.value)
        self.incumbent.work.spend(2.0 * problem.block.operations)
        for _ in range(0, ROOT_STEPS, ROUND):
            before = bound.value
            if self.incumbent.work.left > self._spare:
                bound = self._steps(problem, bound, ROUND)
            yield self.incumbent.progress("computing an upper bound")
            within = np.flatnonzero(bound.forced() >= self.incumbent.least_better)
            if not len(within):
                return None
            if len(within) < len(problem.left):
                problem = self._restricted(problem, within)
                lower = bound_at(problem.block, problem.rest, problem.base, bound.parameters, problem.raised)
                bound = replace(lower, step=bound.step)
            if before - bound.value < LEAST_FALL * bound.value or self.incumbent.work.left <= self._spare:
                break
        self.incumbent.offer(problem.left[bound.selection.picked])
        parameters = root.parameters.copy()
        if bound.value < known.value or root.composition is None:
            parameters[targets] = bound.parameters
        limit = min(bound.value, known.value, self._total + self._rounding)
        node = replace(root, rank=-limit, left=problem.left, first=problem.left, parameters=parameters)
        return node, bound.selection.net

    def run(self) -> Generator[Progress, None, bool]:
        """Search until nothing can be better, or the work is done; return whether the best placement is proven."""
        while not self._next_stage():
            if not (yield from self._finish_stage()):
                return False
        return True

    def _finish_stage(self) -> Generator[Progress, None, bool]:
        """Take nodes until none reaches the goal of the stage; return False if no work is left before."""
        incumbent = self.incumbent
        while self._open and -self._open[0].rank >= max(self._goal, incumbent.least_better):
            if self._met % REPORTED == 0:
                self._note(self.bound)
                yield incumbent.progress("proving that no placement is better")
            if incumbent.work.left <= 0:
                self._note(self.bound)
                return False
            self._met += 1
            self._take(heappop(self._open))
        return True

    def _next_stage(self) -> bool:
        """Set the goal of the next stage, and return whether there is none, as nothing is left that could be better."""
        incumbent = self.incumbent
        self._open = [node for node in (*self._open, *self._waiting) if -node.rank >= incumbent.least_better]
        self._waiting = []
        heapify(self._open)
        self._note(self.bound)
        if not self._open:
            incumbent.close()
        distance = self.bound - incumbent.value
        share = DEEP_SHARE if self.instance.count <= FEW_SENSORS else GOAL_SHARE
        self._goal = incumbent.value + share * distance if distance > LEAST_GAP * self.bound else -math.inf
        return not self._open

    def _note(self, bound: float) -> None:
        self.incumbent.bound = max(self.incumbent.value, min(self.incumbent.bound, bound))

    def _push(self, node: _Node, bound: float) -> None:
        """Open a new node with a bound, or let it wait for a later stage."""
        if bound < self.incumbent.least_better or not len(node.first):
            return
        self._number += 1
        node.rank, node.number = -bound, self._number
        if bound < self._goal:
            self._waiting.append(node)
        else:
            heappush(self._open, node)

    def _push_unlikely(self, node: _Node, reach: Float) -> None:
        """Let the placements of a node wait that contain a candidate with which none reaches the goal of the stage.

        Parameters
        ----------
        reach : (n,) float64
            Upper bound on placements with each candidate that is left.
        """
        able = reach >= self.incumbent.least_better
        unlikely = able & (reach < self._goal)
        if unlikely.any():
            waiting = replace(node, left=np.sort(node.left[able]), first=np.sort(node.left[unlikely]))
            self._push(waiting, float(reach[unlikely].max()))

    def _problem(self, node: _Node, left: Integer) -> tuple[_Problem, Integer]:
        """Return the problem of a node, and its targets."""
        whole = self._block.together(node.chosen)
        targets = self._block.open_targets(whole)
        block, base = self._block.of(left, targets), whole[targets]
        raised = self._rounding + self._block.value_at(whole) - block.value_at(base)
        first = np.intersect1d(node.first, left)
        rest = rest_of(self.instance, node.chosen, left, node.composition)
        return _Problem(node, left, first, block, rest, base, raised), targets

    def _restricted(self, problem: _Problem, keep: Integer) -> _Problem:
        """Return a problem with only some of its candidates."""
        left = problem.left[keep]
        return replace(
            problem,
            left=left,
            first=np.intersect1d(problem.first, left),
            block=problem.block.of(keep),
            rest=rest_of(self.instance, problem.node.chosen, left, problem.node.composition),
        )

    def _take(self, node: _Node) -> None:
        """Bound a node, offer the placement that its bound selects, and open its children."""
        incumbent, node = self.incumbent, node.unpacked()
        left = self._addable(node)
        if not len(left):
            incumbent.offer(node.chosen)
            return
        problem, targets = self._problem(node, left)
        lowest = problem.block.lowest(problem.base)
        by_gains = bound_at(problem.block, problem.rest, problem.base, lowest, problem.raised)
        incumbent.work.spend(2.0 * problem.block.operations + SELECT_OPERATIONS * problem.block.amounts.size)
        if problem.rest.count == 1:
            complete(incumbent, node.chosen, left, by_gains.constant + by_gains.selection.net)
            return
        bound = self._lowered(node, problem, by_gains, targets)
        incumbent.offer(np.append(node.chosen, left[bound.selection.picked]))
        limit = min(bound.value, -node.rank)
        parameters = node.parameters.copy()
        parameters[targets] = bound.parameters
        node = replace(node, left=left, parameters=parameters)
        reach = np.minimum(np.minimum(bound.forced(), by_gains.forced()), limit)
        self._push_unlikely(node, reach)
        goal = max(self._goal, incumbent.least_better)
        within = np.flatnonzero(reach >= goal)
        if len(within):
            problem = self._restricted(replace(problem, node=node), within)
            # With unserved groups, children choose among the members of one: all placements have one of them.
            first = np.isin(problem.left, problem.first)
            if len(problem.rest.groups):
                first = min(problem.rest.groups, key=np.count_nonzero)
            orders = [_Order(problem.rest, one, within, first, limit) for one in (bound, by_gains)]
            self._branch(problem, min(orders, key=lambda order: order.children(goal)), goal)

    def _lowered(self, node: _Node, problem: _Problem, bound: Bound, targets: Integer) -> Bound:
        """Lower the bound of a node by several steps, from that of its parent or by gains."""
        if min(bound.value, -node.rank) < max(self._goal, self.incumbent.least_better):
            return bound
        block, base = problem.block, problem.base
        from_parent = bound_at(block, problem.rest, base, block.clipped(base, node.parameters[targets]), problem.raised)
        self.incumbent.work.spend(block.operations)
        return self._steps(problem, min(bound, from_parent, key=lambda one: one.value), NODE_STEPS)

    def _steps(self, problem: _Problem, bound: Bound, most: int) -> Bound:
        """Return the bound after a number of steps, or less if it falls below the goal."""
        goal = max(self._goal, self.incumbent.least_better)
        steps = falling_bounds(problem.block, problem.rest, problem.base, bound, goal, problem.raised)
        for _, lower in zip(range(most), steps, strict=False):
            bound = lower
            self.incumbent.work.spend(problem.block.operations)
            if bound.value < goal or self.incumbent.work.left <= self._spare:
                break
        return bound

    def _branch(self, problem: _Problem, order: _Order, goal: float) -> None:
        """Open the children of a node that reach a goal, and let the others wait together."""
        node, among = problem.node, order.among
        ordered = problem.left[order.candidates]
        number = order.children(goal)
        if number < among:
            left, first = np.sort(ordered[number:]), np.sort(ordered[number:among])
            self._push(replace(node, left=left, first=first), float(order.most[number]))
        at_once = max(1, MAX_PAIRS // len(ordered))
        for begin in range(0, number, at_once):
            self._open_children(problem, order, np.arange(begin, min(number, begin + at_once)))

    def _open_children(self, problem: _Problem, order: _Order, rows: Integer) -> None:
        """Open some children of a node.

        Parameters
        ----------
        rows : (k,) int64
            Their candidates, as indices into the order.
        """
        ordered = problem.left[order.candidates]
        # a child has no candidate whose own child comes before it
        later = np.arange(len(ordered)) > rows[:, None]
        later &= ~self.instance.conflict[np.ix_(ordered[rows], ordered)]
        most, reach = order.reach(rows)
        reach = np.minimum(reach, most[:, None])
        self.incumbent.work.spend(PAIR_OPERATIONS * reach.size)
        for row in np.flatnonzero(most >= self.incumbent.least_better).tolist():
            chosen = np.append(problem.node.chosen, ordered[rows[row]])
            among = later[row] & (reach[row] >= self.incumbent.least_better)
            if among.any():
                child = replace(problem.node, chosen=chosen, left=ordered, first=ordered, able=np.packbits(among))
                self._push(child, min(float(most[row]), float(reach[row, among].max())))
            else:
                self.incumbent.offer(chosen)

    def _addable(self, node: _Node) -> Integer:
        """Return the candidates left that are within the budget and the composition, without conflicts."""
        instance, chosen, left = self.instance, node.chosen, node.left
        if len(chosen) == instance.count:
            return left[:0]
        room: Boolean = ~instance.conflict[np.ix_(chosen, left)].any(axis=0)
        room &= instance.affordable(math.fsum(instance.price[chosen]) + instance.price[left])
        if node.composition is not None:
            kind, quota = node.composition.kind, np.array(node.composition.quota)
            room &= (np.bincount(kind[chosen], minlength=len(quota)) < quota)[kind[left]]
        return left[room]


class _Order:
    """Candidates of a node in the order of what they contribute to a bound, with bounds on the children.

    Parameters
    ----------
    rest : Rest
        Constraints on the candidates that are left.
    bound : Bound
    within : (n,) int64
        Candidates of the bound that are left.
    first : (n,) bool
        Which of them have children of their own; they come first.
    limit : float
        Another bound on all placements of the node.

    Attributes
    ----------
    candidates : (n,) int64
        Indices among those left.
    among : int
        Number of those that have children.
    most : (among,) float64
        Bound on the placements with each candidate and any after it, which never rises along the order.
    """

    def __init__(self, rest: Rest, bound: Bound, within: Integer, first: Boolean, limit: float) -> None:
        net = bound.selection.net[within]
        self.candidates: Integer = np.lexsort((-net, ~first))
        self.among = among = int(np.count_nonzero(first))
        self._net, self._kind = net[self.candidates], rest.kind[self.candidates]
        added = np.maximum(self._net, 0.0)
        largest = self._net[:among].copy()
        self._weakest = np.zeros((among, len(rest.quota)))
        for kind, quota in enumerate(rest.quota):
            # the largest sum of those after each candidate: some of the others, and the next of those with children
            own = self._kind == kind
            others = _sums(added[among:][own[among:]])
            sums, begin = _sums(added[:among][own[:among]]), np.cumsum(own[:among])
            most = np.minimum(quota - own[:among], rest.count - 1)
            split = [
                others[number] + sums[np.minimum(begin + most - number, len(sums) - 1)] - sums[begin]
                for number in range(min(quota, rest.count - 1, len(others) - 1) + 1)
            ]
            allowed = [np.where(number <= most, sum_, 0.0) for number, sum_ in enumerate(split)]
            largest += np.max(allowed, axis=0)
            end = begin + most
            full = (end < len(sums)) & (end > begin) & (len(others) == 1)
            self._weakest[full, kind] = np.diff(sums)[end[full] - 1]
        self._largest = bound.constant + largest
        self.most = np.maximum.accumulate(np.minimum(limit, self._largest)[::-1])[::-1]

    def children(self, goal: float) -> int:
        """Return the number of children whose bounds reach a goal."""
        return int(np.count_nonzero(self.most >= goal))

    def reach(self, rows: Integer) -> tuple[Float, Float]:
        """Return the bounds on some children (k,), and on those with each further candidate (k, n)."""
        weakest = self._weakest[rows][:, self._kind]
        # a candidate replaces the weakest one of the sum itself: of the other bound it would take away too much
        return self.most[rows], self._largest[rows][:, None] - weakest + np.minimum(self._net, weakest)


def _sums(values: Float) -> Float:
    """Return the sums of the first 0, 1, … of some values."""
    return np.concatenate([[0.0], np.cumsum(values)])


class GainSearch:
    """Depth-first search of all placements of some candidates, in the order of gains.

    What several sensors add together is at most the sum of what each adds by itself (cf. Nemhauser and Wolsey 1981).
    One product of matrices has the gains of all candidates after each of them: so few sensors are proven soonest.

    Parameters
    ----------
    incumbent : Incumbent
        Best placement so far, with the limit of work; it is improved where a better one is met.
    block : StepSum
        Sum over all candidates of the instance that is nowhere below the objective; see `Instance.relaxed`.
    """

    def __init__(self, incumbent: Incumbent, block: StepSum) -> None:
        self.incumbent, self.instance, self._block = incumbent, incumbent.instance, block
        self._rounding, self._met, self._spare = block.rounding, 0, 0.0

    def run(self, among: Integer, share: float) -> Generator[Progress, None, bool]:
        """Search with a share of the work that is left; return whether the best placement is proven.

        Parameters
        ----------
        among : (n,) int64
            Candidates that a better placement may contain.
        """
        self._spare = (1.0 - share) * self.incumbent.work.left
        yield from self._visit(among[:0], among)
        if self.incumbent.work.left <= self._spare:
            return False
        self.incumbent.close()
        return True

    def _visit(self, chosen: Integer, left: Integer) -> Generator[Progress, None, None]:
        """Search the placements of some candidates and of those that are left, none of which they exclude."""
        incumbent, block = self.incumbent, self._block
        if incumbent.work.left <= self._spare:
            return
        if self._met % REPORTED == 0:
            yield incumbent.progress("proving that no placement is better")
        self._met += 1
        count, whole = self.instance.count - len(chosen), block.together(chosen)
        targets = block.open_targets(whole)
        part, base, value = block.of(left, targets), whole[targets], block.value_at(whole) + self._rounding
        gains = part.gains(base)
        order = np.argsort(-gains, kind="stable")
        left, gains = left[order], gains[order]
        incumbent.work.spend(part.operations)
        if count == 1:
            complete(incumbent, chosen, left, value + gains)
            return
        # each child has only candidates of smaller gain
        sums, number = _sums(gains), len(left)
        most = value + sums[np.minimum(np.arange(number) + count, number)] - sums[:number]
        children, further = int(np.count_nonzero(most >= incumbent.least_better)), min(count - 1, number)
        at_once = max(1, MAX_PAIRS // number)
        for begin in range(0, children, at_once):
            rows = np.arange(begin, min(children, begin + at_once))
            able = self._able(chosen, left, rows)
            after = np.where(able, part.gains_after(base, order[rows])[:, order], 0.0)
            incumbent.work.spend(len(rows) * (PRODUCT_SHARE * part.operations + PAIR_OPERATIONS * number))
            largest = np.partition(after, number - further, axis=1)[:, number - further :]
            bound, weakest = value + gains[rows] + largest.sum(axis=1), largest.min(axis=1)[:, None]
            reach = bound[:, None] - weakest + np.minimum(after, weakest)
            able &= reach >= incumbent.least_better
            for row in np.flatnonzero(bound >= incumbent.least_better).tolist():
                child, members = np.append(chosen, left[rows[row]]), left[able[row]]
                if not len(members):
                    incumbent.offer(child)
                elif count == 2:
                    complete(incumbent, child, members, reach[row, able[row]])
                else:
                    yield from self._visit(child, np.sort(members))

    def _able(self, chosen: Integer, left: Integer, rows: Integer) -> Boolean:
        """Return which candidates may follow each of some children, (k, n)."""
        instance = self.instance
        later: Boolean = np.arange(len(left)) > rows[:, None]
        later &= ~instance.conflict[np.ix_(left[rows], left)]
        if math.isfinite(instance.budget):
            spent = math.fsum(instance.price[chosen]) + instance.price[left[rows]]
            later &= instance.affordable(spent[:, None] + instance.price[left])
        return later


def complete(incumbent: Incumbent, chosen: Integer, left: Integer, most: Float) -> None:
    """Offer the placements with one sensor more that may be better, by upper bounds on their values."""
    for one in np.argsort(-most, kind="stable").tolist():
        if most[one] < incumbent.least_better:
            return
        incumbent.offer(np.append(chosen, left[one]))
