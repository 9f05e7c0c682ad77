"""Maximal covering: an optimal placement, or the best found with a bound."""

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ...arrays import Integer
from ...counts import counted
from ...progress import Progress, finish
from .bounds import MAX_ITERATIONS, MAX_LISTED_CHOICES, Bound, can_reach, lagrangian_bound
from .branch_and_bound import BestPlacements, is_worthwhile, merit
from .feasibility import starting_choice
from .greedy import (
    drop_redundant,
    drop_weakest,
    greedy_bound,
    greedy_steps,
    greedy_with_swaps,
    orders,
    swap_search,
)
from .integer_program import CoverProgram, is_affordable
from .local_search import composition_search
from .problem import TIE_TOLERANCE, Placement, PlacementProblem, assess
from .reduced_problem import Instance, common_unit, make_instance
from .search_limits import DEFAULT_LIMITS, MIN_PART, Clock, SolverLimits
from .solvers import check_solver

LISTED_SENSORS = 2  # sensors up to which branch and bound lists all choices in one step
QUICK_STEPS = 50  # bounding steps before tabu search: a few seconds at the largest sites, and often enough for a proof
BRANCHING_SHARE = 0.25  # of what is left of the limits, for a first branch and bound, which goes on after other methods

MAX_TIES = 2_000  # equally good placements that branch and bound compares
PROGRAM_SHARE = 0.5  # share for the integer program, in addition to branch and bound
MAX_RELAXATION_GAP = 0.01  # largest gap of the linear relaxation at which the program is tried besides branch and bound
MIN_GAP_PROGRESS = 0.02  # share of the gap that must close in the second half of the time for more time to be of use

Note = Callable[[float, float], None]
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class Proof:
    """A placement with its bound, and whether it is optimal.

    Parameters
    ----------
    chosen : (k,) int64
    bound : float
        Upper bound on the weight that any placement covers.
    halfway : float, optional
        Bound after half the time of the last search, if that ended without a proof.
    """

    chosen: Integer
    bound: float
    optimal: bool
    halfway: float | None = None


class _Standing:
    """Best placement and bound so far, shown with each step of a search.

    Parameters
    ----------
    unit : float
        Weight in the problem of one unit of weight in the instance.
    """

    def __init__(self, unit: float) -> None:
        self._unit = unit
        self._value, self._bound = 0.0, math.inf

    def note(self, value: float, bound: float) -> None:
        """Record an objective value that was reached and a bound that was proven; worse ones change nothing."""
        self._value, self._bound = max(self._value, value), min(self._bound, bound)

    def shown(self, steps: Generator[Progress, None, Result]) -> Generator[Progress, None, Result]:
        """Run a search and add the covered weight and the gap to the message of each step."""
        while True:
            try:
                step = next(steps)
            except StopIteration as stop:
                result: Result = stop.value
                return result
            yield replace(step, what=f"{step.what}; {self.describe()}") if self._value > 0 else step

    def describe(self) -> str:
        """Return weight and gap as a message."""
        gap = max(self._bound, self._value) / self._value - 1
        return f"covered so far: {self._value * self._unit:,.10g}, gap {gap:.1%}"


def solve(
    problem: PlacementProblem, limits: SolverLimits = DEFAULT_LIMITS, start: Integer | None = None
) -> Generator[Progress, None, Placement]:
    """Choose the placement of largest coverage.

    Of the optimal placements that branch and bound compares (up to `MAX_TIES`), the one with fewest sensors is
    returned, then the cheapest, then the one with the largest doubly covered weight, then the first in the canonical
    order of candidates (`merit`). Where another method proves the optimum, it is the placement found first, without
    sensors that cover nothing more. The result does not depend on the order of candidates and targets.

    Placements are equally good if they cover the same weight. Weights that are whole multiples of one unit are compared
    exactly, however large their sum (up to 2^53 units). For other weights, placements are equally good if they cover at
    most `TIE_TOLERANCE` (1e-9) of the weight that all candidates see together less than the best one.

    Exact reductions come first. A greedy choice improved by swaps and tabu search gives an incumbent, and a Lagrangian
    relaxation gives a bound; candidates that the bound rules out are dropped. The rest is searched by branch and bound.
    If that does not end soon, an integer program lowers the bound where it can, and branch and bound continues with the
    remaining time.

    Parameters
    ----------
    start : (k,) int64, optional
        Candidates of a known placement of the same problem, or of one with a different number of sensors. The result
        covers no less than the best placement found from it by dropping, adding and swapping sensors.

    Raises
    ------
    SeipError
        The constraints cannot be met together, no candidate sees any target, or the solver is not available.
    """
    return (yield from solve_within(problem, limits.solver, limits.clock(), start))


def solve_within(
    problem: PlacementProblem, solver: str, clock: Clock, known: Integer | None = None
) -> Generator[Progress, None, Placement]:
    """Solve as `solve` does, within the limits of a clock."""
    version = check_solver(solver)
    instance, factor = make_instance(problem)
    # The incumbent: greedy, then swaps, then tabu search; each starts from the result of the one before and is never
    # worse.
    start = yield from starting_choice(problem, instance, solver)
    standing = _Standing(1 / factor)
    steps = [*greedy_steps(instance, start)]
    standing.note(instance.value(steps[-1]), greedy_bound(instance, steps))
    first = yield from standing.shown(greedy_with_swaps(instance, start))
    standing.note(instance.value(first), math.inf)
    if not (yield from standing.shown(_can_be_listed(instance, first, clock))):
        first = yield from standing.shown(composition_search(instance, start, first, clock))
    if known is not None:
        adapted = yield from _adapted(instance, np.flatnonzero(np.isin(instance.original, known)))
        first = max(first, adapted, key=instance.value)
    standing.note(instance.value(first), math.inf)
    proof = yield from standing.shown(prove(instance, first, solver, clock, standing.note))
    notes = [*scale_notes(problem)]
    chosen = proof.chosen
    if not proof.optimal:
        chosen = drop_redundant(instance, chosen, instance.value(chosen))
        notes += [
            "the search ended before this placement was proven optimal: the gap is the most by which it may fall short",
            *_outlook(instance, proof),
        ]
    if problem.count is not None and len(chosen) < problem.count:
        notes.append(_surplus(problem.count, len(chosen)))
    original = instance.original[chosen]
    return assess(
        problem,
        original,
        proof.bound / factor,
        optimal=proof.optimal,
        solver=version,
        seconds=clock.seconds,
        notes=tuple(notes),
    )


def _can_be_listed(instance: Instance, chosen: Integer, clock: Clock) -> Generator[Progress, None, bool]:
    """Return whether branch and bound soon lists all choices: of one or two sensors, or of few candidates.

    Then tabu search, which takes longer, cannot add anything. Few bounding steps show whether few candidates are left;
    their work is not counted, so that what is left for the other searches does not depend on them.
    """
    if instance.count <= LISTED_SENSORS and is_worthwhile(instance, np.arange(len(instance))):
        return True
    apart = Clock(max(clock.seconds_left, MIN_PART), acceptance=clock.acceptance)
    goal = instance.as_good(instance.value(chosen))
    keep, _ = yield from lagrangian_bound(instance, goal, apart, iterations=QUICK_STEPS)
    return math.comb(len(keep), min(instance.count, len(keep) // 2)) <= MAX_LISTED_CHOICES


def _adapted(instance: Instance, chosen: Integer) -> Generator[Progress, None, Integer]:
    """Adapt the placement of a similar instance to an instance; the result is empty if the constraints forbid that."""
    while len(chosen) > instance.count:
        chosen = drop_weakest(instance, chosen)
    if not instance.feasible(chosen):
        return np.zeros(0, dtype=np.int64)
    return (yield from swap_search(instance, chosen))


def solve_greedy(problem: PlacementProblem) -> Placement:
    """Choose greedily, with a certificate.

    Greedy covers at least these shares of the optimum: 1 - 1/e (63 %) if only the number of sensors is limited and each
    position has one pose (Nemhauser, Wolsey and Fisher 1978); one half with several poses per position (Fisher,
    Nemhauser and Wolsey 1978); (1 - 1/e)/2 for the better of gain and gain per price if only a budget is given
    (Khuller, Moss and Naor 1999). The bound of the result is computed from the data and is usually far closer.

    Raises
    ------
    SeipError
        The constraints cannot be met together, or no candidate sees any target.
    """
    clock = Clock(math.inf)
    instance, factor = make_instance(problem)
    start = finish(starting_choice(problem, instance, "highs"))
    runs = [[*greedy_steps(instance, start, per_price=per_price)] for per_price in orders(instance)]
    chosen = max((np.sort(steps[-1]) for steps in runs), key=instance.value)
    bound = min(greedy_bound(instance, steps) for steps in runs)
    optimal = instance.attained(bound) < _better(instance, chosen)
    original = instance.original[chosen]
    return assess(
        problem,
        original,
        bound / factor,
        optimal=optimal,
        solver="greedy",
        seconds=clock.seconds,
        notes=(_guarantee(problem, instance),),
    )


def prove(
    instance: Instance, chosen: Integer, solver: str, clock: Clock, note: Note = lambda _value, _bound: None
) -> Generator[Progress, None, Proof]:
    """Improve an incumbent and the bound on it until they meet or the time is up.

    Parameters
    ----------
    chosen : (k,) int64
        Placement to begin from.
    note : callable, optional
        Function that is called with the objective value reached and the bound proven whenever one may have improved.
    """
    # First reduction: only candidates that an equally good or better placement may contain, and the incumbent's own.
    # For one or two sensors branch and bound needs few: it must get its turn before the limits are reached.
    steps = QUICK_STEPS if instance.count <= LISTED_SENSORS else MAX_ITERATIONS
    goal = instance.as_good(instance.value(chosen))
    keep, bound = yield from lagrangian_bound(instance, goal, clock, iterations=steps)
    note(instance.value(chosen), bound.value)
    proof = yield from _prove_among(instance.part(keep), np.searchsorted(keep, chosen), bound, solver, clock, note)
    return replace(proof, chosen=keep[proof.chosen], bound=instance.attained(proof.bound))


def _prove_among(  # incumbent and bound, the limits, and the callback
    instance: Instance, chosen: Integer, bound: Bound, solver: str, clock: Clock, note: Note
) -> Generator[Progress, None, Proof]:
    """Improve an incumbent and its bound among the candidates that a bound has not ruled out."""
    # The methods run in the order of their cost, and each gets what the ones before have found: the smallest bound
    # (`least`), the best placement, and the candidates that can still matter.
    relaxed = yield from _from_relaxation(instance, bound, chosen)
    chosen = max(chosen, relaxed, key=instance.value)
    least = min(bound.value, instance.total)
    # Branch and bound searches for ties too, so that it needs the candidates of all equally good placements. The later
    # methods only look for better ones (`keep`), which leaves fewer candidates.
    as_good = np.union1d(can_reach(instance, bound, instance.as_good(instance.value(chosen))), chosen)
    search = None
    if is_worthwhile(instance, as_good):
        search = BestPlacements(instance.part(as_good), instance.value(chosen), MAX_TIES, least)
        finished = yield from search.run(clock, BRANCHING_SHARE * clock.left)
        chosen = max([chosen, *_found(search, as_good)], key=instance.value)
        if finished:
            return _finished(instance, search, as_good, chosen)
        least = min(least, search.bound)
    note(instance.value(chosen), least)
    keep = can_reach(instance, bound, _better(instance, chosen))
    if least < _better(instance, chosen) - instance.margin or len(keep) == 0:
        return _proven(instance, chosen)
    # An integer program is quick where the linear relaxation is tight. Where it is not, it is the last resort of
    # instances too large for branch and bound.
    tight = bound.value - instance.value(chosen) <= MAX_RELAXATION_GAP * instance.value(chosen)
    share = 1.0 if search is None else PROGRAM_SHARE
    if (tight or search is None) and is_affordable(instance.of(keep), clock, share):
        yield Progress(0, 0, f"proving with {len(keep)} of {len(instance)} candidates")
        known = Proof(chosen, least, optimal=False)
        proof = yield from _decide(instance, keep, known, solver, clock, share)
        if proof.optimal:
            return proof
        chosen, least = proof.chosen, proof.bound
    if search is None or clock.left <= 0:
        return Proof(chosen, least, optimal=False)
    return (yield from _search_on(instance, search, as_good, least, chosen, clock))


def _search_on(  # the search, its results so far, and the limits
    instance: Instance, search: BestPlacements, among: Integer, least: float, chosen: Integer, clock: Clock
) -> Generator[Progress, None, Proof]:
    """Continue a branch and bound until it ends or the limits are reached."""
    # a better placement found by another method raises the goal of the search, which then prunes more
    if np.isin(chosen, among).all():
        search.offer(np.searchsorted(among, chosen))
    halfway = None
    for share in (0.5, 1.0):
        finished = yield from search.run(clock, share * clock.left)
        chosen = max([chosen, *_found(search, among)], key=instance.value)
        if finished:
            return _finished(instance, search, among, chosen)
        least = min(least, search.bound)
        halfway = least if halfway is None else halfway
    optimal = instance.attained(least) < _better(instance, chosen)
    return Proof(chosen, max(least, instance.value(chosen)), optimal=optimal, halfway=halfway)


def _found(search: BestPlacements, among: Integer) -> list[Integer]:
    return [among[choice] for choice in search.found]


def _finished(instance: Instance, search: BestPlacements, among: Integer, chosen: Integer) -> Proof:
    """Return the proof given by a search that has ended, with the first by `merit` of the best placements it met."""
    first = min([chosen, *_found(search, among)], key=lambda choice: merit(instance, choice))
    return Proof(first, instance.value(chosen), optimal=True)


def _better(instance: Instance, chosen: Integer) -> float:
    """Return the least covered weight of a strictly better placement."""
    return instance.value(chosen) + instance.step


def _from_relaxation(instance: Instance, bound: Bound, chosen: Integer) -> Generator[Progress, None, Integer]:
    """Return a placement from the relaxation's selection if that meets the constraints, else the chosen one."""
    picked = np.sort(bound.selection.picked)
    if not instance.feasible(picked):
        return chosen
    return (yield from swap_search(instance, picked))


def _decide(  # the proof so far, and the limits
    instance: Instance, keep: Integer, known: Proof, solver: str, clock: Clock, share: float
) -> Generator[Progress, None, Proof]:
    """Search for better placements by an integer program until there is none, which is the proof.

    Solvers have tolerances: of two placements that differ by less they may return either. So a solver's optimum is only
    taken as a better placement, and the program is solved again until it has no solution.
    """
    program, chosen, bound = CoverProgram(instance.part(keep)), known.chosen, known.bound
    ends = clock.elapsed + share * clock.left
    while True:
        program.require_better(instance.value(chosen))
        part = min(max((ends - clock.elapsed) / clock.left, 0.0), 1.0) if clock.left > 0 else 0.0
        outcome = yield from program.maximise_coverage(solver, clock, part)
        if outcome.chosen is None:
            break
        chosen = keep[outcome.chosen]
    if not outcome.finished:
        bound = max(instance.value(chosen), min(bound, outcome.bound))
    if outcome.finished or instance.attained(bound) < _better(instance, chosen):
        return _proven(instance, chosen)
    return Proof(chosen, bound, optimal=False)


def _proven(instance: Instance, chosen: Integer) -> Proof:
    """Return the proof that no placement covers more than the chosen one by the instance's step, less idle sensors."""
    value = instance.value(chosen)
    return Proof(
        drop_redundant(instance, chosen, value), value if instance.step == 1 else value + instance.step, optimal=True
    )


def _outlook(instance: Instance, proof: Proof) -> list[str]:
    """Return notes on what more time would gain."""
    value = instance.value(proof.chosen)
    if proof.halfway is None or value <= 0:
        return []
    before, now = (bound / value - 1 for bound in (proof.halfway, proof.bound))
    if before - now < MIN_GAP_PROGRESS * before:
        slow = (
            "the gap has hardly closed in the second half of the search: a proof may take many times longer; use fewer "
            "candidates (a larger spacing, fewer heights) or fewer sensors to make it easier"
        )
        return [slow]
    return [
        f"the gap was {before:.2%} halfway through the search and is {now:.2%} now: a higher limit may close it further"
    ]


def _surplus(most: int, used: int) -> str:
    suffice = "suffices" if used == 1 else "suffice"
    return f"{used} of {counted(most, 'sensor')} {suffice}: no further sensor that the constraints allow adds coverage"


def _guarantee(problem: PlacementProblem, instance: Instance) -> str:
    single = len(np.unique(instance.clique)) == len(instance)
    both = problem.count is not None and problem.budget is not None
    if len(instance.mandatory) or problem.min_distance > 0 or both or (problem.budget is not None and not single):
        return "greedy has no guarantee under these constraints beyond the bound given"
    if problem.budget is not None:
        return "greedy covers at least (1 - 1/e)/2 (32 %) of the optimum"
    return f"greedy covers at least {'1 - 1/e (63 %)' if single else 'one half'} of the optimum"


def scale_notes(problem: PlacementProblem) -> tuple[str, ...]:
    """Return notes on weights and prices that are too small next to others to affect the choice.

    Returns
    -------
    tuple of str
        Up to two notes: one on weights and one on prices.
    """
    notes = []
    weights = problem.weights[problem.weights > 0]
    light = int(np.count_nonzero(weights < TIE_TOLERANCE * weights.sum()))
    if light and not common_unit(weights)[1]:
        notes.append(
            f"{light:,} of {len(weights):,} targets weigh less than {TIE_TOLERANCE:g} of all weight each, too little "
            "to affect the choice; bring the weights closer together"
        )
    prices = problem.prices[problem.allowed & (problem.prices > 0)]
    cheap = int(np.count_nonzero(prices < TIE_TOLERANCE * prices.max(initial=0.0)))
    if cheap:
        notes.append(
            f"{cheap:,} candidates cost less than {TIE_TOLERANCE:g} of the most expensive one, too little to affect "
            "the choice; give all prices in the same currency"
        )
    return tuple(notes)
