"""Placement by expected returns: greedy choice, swaps, and branch and bound with a certificate."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field, replace
from heapq import heappop, heappush
from itertools import count

import numpy as np
from numpy.typing import NDArray

from ...arrays import Boolean, Float, Integer
from ...progress import Progress
from .feasibility import starting_choice
from .greedy import addable, orders
from .integer_program import fits
from .problem import TIE_TOLERANCE, Placement, PlacementProblem, assess
from .reduced_problem import make_instance
from .returns_bounds import OPERATIONS_PER_LOGARITHM, Completion, ReturnsBound
from .returns_instance import ReturnsInstance, make_returns_instance
from .returns_program import ReturnsProgram, entries_of
from .returns_summary import returns_text
from .search_limits import DEFAULT_LIMITS, Clock, SolverLimits
from .solvers import check_solver

STARTS = 6  # number of greedy choices, each from a different first candidate, that swaps improve
ROOT_STEPS, NODE_STEPS = 60, 6  # steps of the bound at the root, with all candidates, and at each other node
BRANCHING_SHARE = 0.5  # share of the limits for branch and bound before the integer program
PROGRAM_SHARE = 0.5  # share of what is left then for the integer program, where it is small enough
UNPROVEN = (
    "the limit was reached before this placement was proven the best: the gap is the most by which it may fall short; "
    "a higher limit may close it"
)


def solve_returns(
    problem: PlacementProblem, returns: NDArray[np.float32], limits: SolverLimits = DEFAULT_LIMITS
) -> Generator[Progress, None, Placement]:
    """Choose the placement of largest mean of ln(1 + expected returns) from road users.

    Placements are equally good where their values differ by at most `TIE_TOLERANCE`. Of these the first one found is
    returned, which does not depend on the order of candidates.

    Branch and bound runs first: on random problems of 120 candidates it took half as long as with the integer program
    (`returns_program`). The program has a share of the limits only if these name a solver other than ``auto``, branch
    and bound has no proof by then, and the program is small enough.

    Parameters
    ----------
    problem : PlacementProblem
        Problem whose weights are those of the m road users; ``visible`` is used for mandatory groups only.
    returns : (c, m) float
        Expected returns of each candidate from each road user.

    Returns
    -------
    Placement
        Placement whose objective and bound are means of ln(1 + returns). Its gap is the share by which the geometric
        mean of 1 + returns may be larger.

    Raises
    ------
    SeipError
        The constraints cannot be met together, or there are no returns.
    """
    clock = limits.clock()
    instance = make_returns_instance(problem, returns)
    start = yield from _starting_choice(problem, instance, limits.solver)
    standing = Standing(instance, start, clock)
    chosen = yield from improved_greedy(instance, start, clock, standing)
    search = _Search(instance, chosen, clock, standing)
    solver, by_program = "branch and bound", limits.solver != "auto"
    finished = yield from search.run(BRANCHING_SHARE if by_program else 1.0)
    if by_program and not finished and fits(entries_of(search.rest), clock, PROGRAM_SHARE):
        solver = f"{solver}, {check_solver(limits.solver)}"
        finished = yield from search.prove_by_program(limits.solver, clock.part(PROGRAM_SHARE * clock.left))
    # the program may have raised the best value, and so cut open nodes: the search continues with it
    finished = finished or (yield from search.run())
    placement = assess(
        problem,
        instance.original[search.best],
        search.bound,
        optimal=finished,
        solver=solver,
        seconds=clock.seconds,
        notes=() if finished else (UNPROVEN,),
        objective=search.value,
    )
    return replace(placement, gap=math.expm1(placement.bound - placement.objective))


class Standing:
    """Best value and bound of a search so far, for messages on its progress.

    Parameters
    ----------
    start : (s,) int64
        Candidates that serve the mandatory groups; the greedy choice from there has the first bound.
    """

    def __init__(self, instance: ReturnsInstance, start: Integer, clock: Clock) -> None:
        chosen = greedy(instance, start, clock)
        share = np.zeros(len(instance))
        share[chosen] = 1.0
        everything = Completion(instance, np.zeros(len(instance.weight)))
        first, _ = next(everything.falling_bounds(share, clock))
        self.value, self.bound = instance.value(chosen), first.value

    def note(self, value: float, bound: float = math.inf) -> None:
        """Record a value that was reached and a bound that was proven; worse ones change nothing."""
        self.value, self.bound = max(self.value, value), min(self.bound, bound)

    def describe(self, work: str) -> str:
        """Return a message: the work of a search, with its typical number of returns and its gap so far."""
        typical, gap = math.expm1(self.value), math.expm1(max(self.bound - self.value, 0.0))
        return f"{work}; returns so far: {returns_text(typical)}, gap {gap:.1%}"


def greedy_returns(problem: PlacementProblem, returns: NDArray[np.float32]) -> Generator[Progress, None, Placement]:
    """Choose greedily by expected returns, without a bound."""
    clock = Clock(math.inf)
    instance = make_returns_instance(problem, returns)
    start = yield from _starting_choice(problem, instance, "highs")
    choices = [greedy(instance, start, clock, per_price=per_price) for per_price in orders(instance)]
    chosen = max(choices, key=instance.value)
    return assess(
        problem,
        instance.original[chosen],
        math.inf,
        optimal=False,
        solver="greedy",
        seconds=clock.seconds,
        objective=instance.value(chosen),
    )


def _starting_choice(
    problem: PlacementProblem, instance: ReturnsInstance, solver: str
) -> Generator[Progress, None, Integer]:
    """Return candidates of the instance that serve all mandatory groups, (s,) int64."""
    if not len(instance.mandatory):
        return np.zeros(0, dtype=np.int64)
    covering, _ = make_instance(problem)
    chosen = yield from starting_choice(problem, covering, solver)
    # a candidate that the returns instance left out as dominated is replaced by the one that dominates it
    found = [_stand_in(instance, problem, int(covering.original[one])) for one in chosen]
    return np.sort(np.array(found, dtype=np.int64))


def _stand_in(instance: ReturnsInstance, problem: PlacementProblem, candidate: int) -> int:
    """Return a candidate of the instance, or the one at its position that serves the same groups and costs no more."""
    own = np.flatnonzero(instance.original == candidate)
    if len(own):
        return int(own[0])
    there = np.flatnonzero(problem.positions[instance.original] == problem.positions[candidate])
    serves = (instance.mandatory[:, there] >= problem.mandatory_groups[:, [candidate]]).all(axis=0)
    cheap = instance.price[there] <= problem.prices[candidate]
    return int(there[serves & cheap][0])


def _gains(instance: ReturnsInstance, base: Float, clock: Clock, among: Integer | None = None) -> Float:
    """Return `ReturnsInstance.added`, recorded as work."""
    clock.spend(OPERATIONS_PER_LOGARITHM * (len(instance) if among is None else len(among)) * len(base))
    return instance.added(base, among)


def greedy(instance: ReturnsInstance, start: Integer, clock: Clock, *, per_price: bool = False) -> Integer:
    """Add the candidate of largest gain, or gain per price, until none can be added; return the choice, ascending."""
    chosen = start
    while True:
        gain = np.where(addable(instance, chosen), _gains(instance, instance.together(chosen), clock), 0.0)
        score = gain / np.maximum(instance.price, TIE_TOLERANCE * instance.price.max()) if per_price else gain
        best = int(np.argmax(score))
        if gain[best] <= 0:
            return np.sort(chosen)
        chosen = np.append(chosen, best)


def improved_greedy(
    instance: ReturnsInstance, start: Integer, clock: Clock, standing: Standing
) -> Generator[Progress, None, Integer]:
    """Return the best of several greedy choices after swaps, ascending."""
    best = yield from swapped(instance, greedy(instance, start, clock), clock, standing)
    if True in orders(instance):
        other = yield from swapped(instance, greedy(instance, start, clock, per_price=True), clock, standing)
        best = max(best, other, key=instance.value)
    first = np.where(addable(instance, start), _gains(instance, instance.together(start), clock), 0.0)
    for candidate in np.argsort(-first, kind="stable")[1:STARTS]:
        if first[candidate] > 0:
            choice = greedy(instance, np.append(start, candidate), clock)
            other = yield from swapped(instance, choice, clock, standing)
            best = max(best, other, key=instance.value)
    return best


def swapped(
    instance: ReturnsInstance, chosen: Integer, clock: Clock, standing: Standing
) -> Generator[Progress, None, Integer]:
    """Replace one sensor by another, and add sensors, for as long as the value grows.

    Under a budget a swap may leave money for more sensors. These are added greedily, so that the numbers of sensors of
    each type change too.
    """
    value = instance.value(chosen)
    while True:
        standing.note(value)
        yield Progress(0, 0, standing.describe("swapping sensors"))
        best, chosen_then = value, chosen
        for gone in chosen:
            rest = chosen[chosen != gone]
            gain = np.where(addable(instance, rest), _gains(instance, instance.together(rest), clock), -np.inf)
            gain[gone] = -np.inf
            # The best replacement. Under a budget also the best one of each price, followed by what the rest of the
            # budget buys: one cheap sensor in place of an expensive one loses value unless a second one joins it.
            rivals = [np.append(rest, int(np.argmax(gain)))] if np.isfinite(gain).any() else []
            if math.isfinite(instance.budget):
                cheapest = _best_of_each_price(instance, gain)
                rivals += [greedy(instance, np.append(rest, one), clock) for one in cheapest]
            for rival in rivals:
                reached = instance.value(rival)
                if reached > best + TIE_TOLERANCE and instance.feasible(rival):
                    best, chosen_then = reached, np.sort(rival)
        if best == value:
            return chosen
        value, chosen = best, chosen_then


def _best_of_each_price(instance: ReturnsInstance, gain: Float) -> list[int]:
    """Return the candidate of largest gain among those of each price."""
    best = []
    for price in np.unique(instance.price):
        own = np.where(instance.price == price, gain, -np.inf)
        if np.isfinite(own).any():
            best.append(int(np.argmax(own)))
    return best


@dataclass(order=True)
class _Node:
    """Node of the search tree: all placements with the chosen candidates and any of those left.

    Parameters
    ----------
    rank : float
        Negative upper bound on the value of these placements: the heap gives the node of the largest bound first.
    number : int
        Serial number of the node, which settles equal bounds.
    chosen : (k,) int64
        Candidates that all these placements contain.
    left : (n,) int64
        Candidates that they may contain besides.
    share : (n,) float64, optional
        Fractional choice of the candidates left, from the parent, to begin the bound with.
    """

    rank: float
    number: int
    chosen: Integer = field(compare=False)
    left: Integer = field(compare=False)
    share: Float | None = field(compare=False, default=None)


class _Search:
    """Best-first branch and bound.

    The candidates left are sorted by their contributions to the bound of the node. Each child adds one of them and
    excludes those before it. The bounds of children fall along that order, so that all after the first that falls short
    are cut at once. A child gets a bound of its own when it is taken from the heap.

    Attributes
    ----------
    best : (k,) int64
        Best placement so far.
    value : float
        Value of the best placement.
    """

    def __init__(self, instance: ReturnsInstance, chosen: Integer, clock: Clock, standing: Standing) -> None:
        self.instance, self._clock, self._standing = instance, clock, standing
        self.best, self.value = np.sort(chosen), instance.value(chosen)
        self._numbers, self._proven = count(), math.inf
        root = _Node(-math.inf, next(self._numbers), np.zeros(0, dtype=np.int64), np.arange(len(instance)))
        self._open = [root]

    @property
    def bound(self) -> float:
        """Upper bound on the value of any placement."""
        # Placements are in nodes that were explored, where none is better than the best, or in open ones, of which the
        # first of the heap has the largest bound. The integer program may have proven less.
        return max(self.value, min(self._proven, -self._open[0].rank) if self._open else -math.inf)

    @property
    def rest(self) -> ReturnsInstance:
        """The instance reduced to the best placement so far and the candidates that a better one may contain."""
        return self.instance.of(self._left())

    def _left(self) -> Integer:
        """Return the candidates of the best placement and of all open nodes, ascending."""
        members = [part for node in self._open for part in (node.chosen, node.left)]
        left: Integer = np.unique(np.concatenate([self.best, *members]))
        return left

    def prove_by_program(self, solver: str, clock: Clock) -> Generator[Progress, None, bool]:
        """Improve the best placement and the bound by an integer program; return whether it is proven."""
        left = self._left()
        program = ReturnsProgram(self.instance.of(left))
        proof = yield from program.improve(np.searchsorted(left, self.best), solver, clock)
        self._offer(left[proof.chosen])
        self._proven = min(self._proven, proof.bound)
        return proof.optimal

    def run(self, share: float = 1.0) -> Generator[Progress, None, bool]:
        """Search until the best placement is proven, or a share of the limits is used; return whether it is proven."""
        # the part of the limits that must be left for later
        spare = (1.0 - share) * self._clock.left if share < 1.0 else 0.0
        while self._open and -self._open[0].rank > self._least:
            if self._clock.left <= spare:
                return False
            node = heappop(self._open)
            self._standing.note(self.value, max(self.value, -node.rank))
            yield Progress(0, 0, self._standing.describe("proving that no placement has more returns"))
            self._take(node)
        return True

    @property
    def _least(self) -> float:
        """Value above which a placement is better."""
        return self.value + TIE_TOLERANCE

    def _take(self, node: _Node) -> None:
        """Bound a node, offer the placement that its bound selects, and open its children."""
        whole = self.instance
        base = whole.together(node.chosen)
        # With one sensor to come its gain is exact: no bound is needed.
        left = node.left[_addable_later(whole, node.chosen, node.left)]
        if len(node.chosen) + 1 == whole.count or not len(left):
            self._complete(node.chosen, base, left)
            return
        reached = float(whole.weight @ np.log1p(base))
        rules = replace(
            whole.of(left),
            count=whole.count - len(node.chosen),
            budget=whole.budget - math.fsum(whole.price[node.chosen]),
        )
        part = Completion(rules, base)
        # The bound begins at the fractional choice of the parent, restricted to the candidates left. Where none of it
        # is left, at those of the largest gains. A start near the optimum gives a small bound after few steps.
        share = np.zeros(len(left)) if node.share is None else node.share[np.searchsorted(node.left, left)]
        if not share.any():
            gain = _gains(whole, base, self._clock, left)
            share[np.argsort(-gain, kind="stable")[: rules.count]] = 1.0
        # The root's bound sorts the whole tree and is worth many steps; its selection, and those of nodes, are
        # placements too, which often improve the best one.
        bound, share = self._bounded(part, reached, share, NODE_STEPS if len(node.chosen) else ROOT_STEPS)
        self._offer(np.append(node.chosen, left[bound.selection.picked]))
        self._branch(node, rules, left, reached, bound, share)

    def _bounded(self, part: Completion, reached: float, share: Float, steps: int) -> tuple[ReturnsBound, Float]:
        """Return the smallest of several bounds, and the fractional choice from which it was computed."""
        # The bounds of successive steps need not fall. The steps end early once the node can be cut.
        best: tuple[ReturnsBound, Float] | None = None
        for step, (bound, own) in enumerate(part.falling_bounds(share, self._clock)):
            if best is None or bound.value < best[0].value:
                best = bound, own
            if step + 1 == steps or reached + best[0].value <= self._least or self._clock.left <= 0:
                return best
        raise AssertionError

    def _branch(
        self, node: _Node, rules: ReturnsInstance, left: Integer, reached: float, bound: ReturnsBound, share: Float
    ) -> None:
        """Open the children of a node whose bounds are above the best value."""
        # The node's bound is linear in the candidates: a fixed part plus the net contributions of those selected. If
        # the first candidate of a placement in this order is at some rank, the others come after it, and the bound on
        # such placements is the fixed part plus the largest contributions from that rank on. It needs no new
        # evaluation.
        net = bound.selection.net
        order = np.argsort(-net, kind="stable")
        fixed = reached + bound.value - bound.selection.value
        for rank, (candidate, most, weakest) in enumerate(_best_after(rules, bound, order)):
            # a child is part of its parent, whose bound therefore holds for it too
            limit = min(fixed + most, -node.rank)
            if limit <= self._least:
                break
            # A later candidate is of use only if the bound with it is above the best value. With it, the weakest
            # candidate of the selection must go (or none, where there is room): those that fall short are left out of
            # the child, and so of the whole subtree.
            enough = order[rank + 1 :]
            after = np.sort(enough[fixed + most - weakest + net[enough] > self._least])
            chosen = np.append(node.chosen, left[candidate])
            heappush(self._open, _Node(-limit, next(self._numbers), chosen, left[after], share[after]))

    def _complete(self, chosen: Integer, base: Float, left: Integer) -> None:
        """Offer every placement of a node with one sensor to come."""
        self._offer(chosen)
        if not len(left):
            return
        gain = _gains(self.instance, base, self._clock, left)
        serves = self.instance.mandatory[:, chosen].any(axis=1)[:, None] | self.instance.mandatory[:, left]
        gain = np.where(serves.all(axis=0), gain, -np.inf)
        best = int(np.argmax(gain))
        if np.isfinite(gain[best]):
            self._offer(np.append(chosen, left[best]))

    def _offer(self, chosen: Integer) -> None:
        """Keep a placement if it is feasible and better than the best so far."""
        chosen = np.sort(chosen)
        if self.instance.feasible(chosen) and (value := self.instance.value(chosen)) > self._least:
            self.best, self.value = chosen, value


def _addable_later(instance: ReturnsInstance, chosen: Integer, left: Integer) -> Boolean:
    """Return which candidates left are affordable and have no conflict with those chosen, (k,) bool."""
    room: Boolean = ~instance.conflict[np.ix_(chosen, left)].any(axis=0)
    room &= instance.affordable(math.fsum(instance.price[chosen]) + instance.price[left])
    return room


def _best_after(rules: ReturnsInstance, bound: ReturnsBound, order: Integer) -> Iterator[tuple[int, float, float]]:
    """Yield each candidate of an order with the largest sum of contributions of it and of candidates after it.

    At most ``count`` candidates contribute, one of each clique; the budget is included by its multiplier. The sums fall
    along the order. The third value is the contribution that one more candidate would replace: the smallest of the sum,
    or 0 where there is room for one more.
    """
    selection = bound.selection
    net, clique = selection.net[order].tolist(), rules.clique[order].tolist()
    spare = selection.multiplier * rules.budget if selection.multiplier else 0.0
    for rank, own in enumerate(order.tolist()):
        total, seen, last = net[rank] + spare, {clique[rank]}, 0.0
        for later in range(rank + 1, len(net)):
            if len(seen) == rules.count or net[later] <= 0:
                break
            if clique[later] not in seen:
                seen.add(clique[later])
                total += net[later]
                last = net[later]
        yield own, total, last if len(seen) == rules.count else 0.0
