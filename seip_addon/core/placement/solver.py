"""Maximal covering: an optimal placement, or the best found with a bound."""

import math
from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Integer
from ..progress import Progress, finish
from .bounds import Bound, can_reach, lagrangian_bound
from .branch_and_bound import BestPlacements, is_worthwhile
from .decomposition import decomposition_bound
from .feasibility import starting_choice
from .greedy import drop_redundant, greedy_bound, greedy_steps, greedy_with_swaps, orders, swap_search, tabu_search
from .integer_program import CoverProgram, check_solver
from .problem import TIE_TOLERANCE, Placement, PlacementProblem, assess
from .reduced_problem import Instance, common_unit, make_instance
from .search_limits import DEFAULT_LIMITS, Clock, SolverLimits
from .tie_breaking import MAX_SEARCHED_TIES, canonical_optimum

BRANCHING_SHARE = 0.15  # of what is left of the limits, for a first branch and bound, which goes on after other methods

TABU_SEARCH_SHARE, FIRST_DECOMPOSITION_SHARE, FULL_DECOMPOSITION_SHARE = 0.1, 0.05, 0.4
"""Shares for a tabu search of swaps, for a first bound by decomposition, and for a full one where the first gains."""

MIN_BOUND_GAIN = 0.05  # share of the gap that the first bound by decomposition must close for a full one to be worth it
PROGRAM_SHARE = 0.5  # share for the integer program, beside branch and bound
MAX_RELAXATION_GAP = 0.01  # gap of the linear relaxation up to which the program is tried, beside branch and bound
MIN_TIE_BREAKING_WORK = 2.0  # units of work for the choice among equally good placements, or as many as the proof took
MIN_GAP_PROGRESS = 0.02  # share of the gap that closes in the second half of the time where more time is of use
MAX_PROGRAM_ENTRIES = 1_000_000  # entries of V up to which the solver gets a program whole: PuLP takes 0.5 kB for each


@dataclass(frozen=True, eq=False)
class Proof:
    """A placement with its bound, its ties, and whether it is optimal.

    Parameters
    ----------
    chosen : (k,) int64
    bound : float
        No placement covers more.
    ties : tuple of (k,) int64, optional
        All placements that cover as much, but for those with idle sensors, where they are known.
    halfway : float, optional
        The bound when half the time of the last search was over, where that ended without a proof.
    """

    chosen: Integer
    bound: float
    optimal: bool
    ties: tuple[Integer, ...] | None = None
    halfway: float | None = None


def solve(problem: PlacementProblem, limits: SolverLimits = DEFAULT_LIMITS) -> Generator[Progress, None, Placement]:
    """Choose the placement that covers most.

    Among optimal placements the one with fewest sensors is returned, then the cheapest, then the one with the largest
    doubly covered weight, then the first in the canonical order of candidates: always the same one, however candidates
    and targets are ordered.

    Reductions that lose nothing come first; a greedy choice improved by swaps gives an incumbent, a Lagrangian
    relaxation a bound; candidates that the bound rules out are dropped. Among the rest branch and bound decides; where
    it does not soon, a tabu search improves the incumbent, decomposition and an integer program the bound where they
    can, and branch and bound goes on with the time that is left, its bound falling all the while.

    Raises
    ------
    SeipError
        The constraints cannot be met together, no candidate sees any target, or the solver is not available.
    """
    return (yield from solve_within(problem, limits.solver, limits.clock()))


def solve_within(problem: PlacementProblem, solver: str, clock: Clock) -> Generator[Progress, None, Placement]:
    """Do the work of `solve` within given limits."""
    version = check_solver(solver)
    instance, factor = make_instance(problem)
    start = yield from starting_choice(problem, instance, solver)
    first = yield from greedy_with_swaps(instance, start)
    proof = yield from prove(instance, first, solver, clock)
    chosen = drop_redundant(instance, proof.chosen, instance.value(proof.chosen))
    notes = [*scale_notes(problem)]
    if proof.optimal:
        part = clock.counted_part(max(clock.work, MIN_TIE_BREAKING_WORK))
        chosen, settled = yield from canonical_optimum(instance, chosen, proof.ties, solver, part)
        if not settled:
            notes.append(
                "not all ties were broken: another placement may cover as much with fewer or cheaper sensors, or see "
                "more targets twice"
            )
    else:
        notes += [
            "the time was too short to prove this placement optimal: the gap says by how much it may fall short",
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


def solve_greedy(problem: PlacementProblem) -> Placement:
    """Choose greedily, with a certificate.

    With the number of sensors alone and one pose per position, greedy covers at least 1 - 1/e (63 %) of the optimum
    (Nemhauser, Wolsey and Fisher 1978); with several poses per position at least a half (Fisher, Nemhauser and Wolsey
    1978); the better of gain and gain per price, under a budget alone, at least (1 - 1/e)/2 (Khuller, Moss and Naor
    1999). The bound of the result is computed from the data and is usually far closer.

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


def prove(instance: Instance, chosen: Integer, solver: str, clock: Clock) -> Generator[Progress, None, Proof]:
    """Improve an incumbent and the bound on it until they meet or the time is up.

    Parameters
    ----------
    chosen : (k,) int64
        A placement to begin from.
    """
    keep, bound = yield from lagrangian_bound(instance, instance.value(chosen), clock)
    proof = yield from _prove_among(instance.part(keep), np.searchsorted(keep, chosen), bound, solver, clock)
    ties = None if proof.ties is None else tuple(keep[choice] for choice in proof.ties)
    return replace(proof, chosen=keep[proof.chosen], bound=instance.attained(proof.bound), ties=ties)


def _prove_among(
    instance: Instance, chosen: Integer, bound: Bound, solver: str, clock: Clock
) -> Generator[Progress, None, Proof]:
    """Improve an incumbent among the candidates that a bound leaves, none better being among the others."""
    relaxed = yield from _from_relaxation(instance, bound, chosen)
    chosen = max(chosen, relaxed, key=instance.value)
    least = min(bound.value, instance.total)
    as_good = np.union1d(can_reach(instance, bound, instance.value(chosen)), chosen)
    search = None
    if is_worthwhile(instance, as_good):
        search = BestPlacements(instance.part(as_good), instance.value(chosen), MAX_SEARCHED_TIES, least)
        finished = yield from search.run(clock, BRANCHING_SHARE * clock.left)
        chosen = max([chosen, *_found(search, as_good)], key=instance.value)
        if finished:
            return _finished(instance, search, as_good, chosen)
        least = min(least, search.bound)
    if least >= _better(instance, chosen) - instance.margin:
        for beginning in (chosen, relaxed):
            searched = yield from tabu_search(instance, beginning, clock, TABU_SEARCH_SHARE * clock.left)
            chosen = max(chosen, searched, key=instance.value)
        least = min(least, (yield from _decomposition_bound(instance, least, chosen, clock)))
    keep = can_reach(instance, bound, _better(instance, chosen))
    if least < _better(instance, chosen) - instance.margin or len(keep) == 0:
        return Proof(chosen, instance.value(chosen), optimal=True)
    tight = bound.value - instance.value(chosen) <= MAX_RELAXATION_GAP * instance.value(chosen)
    if clock.left > 0 and (tight or search is None) and np.count_nonzero(instance.visible[keep]) <= MAX_PROGRAM_ENTRIES:
        yield Progress(0, 0, f"proving with {len(keep)} of {len(instance)} candidates")
        known, share = Proof(chosen, least, optimal=False), 1.0 if search is None else PROGRAM_SHARE
        proof = yield from _decide(instance, keep, known, solver, clock, share)
        if proof.optimal:
            return proof
        chosen, least = proof.chosen, proof.bound
    if search is None or clock.left <= 0:
        return Proof(chosen, least, optimal=False)
    return (yield from _search_on(instance, search, as_good, least, chosen, clock))


def _search_on(  # what is known, and how far to go
    instance: Instance, search: BestPlacements, among: Integer, least: float, chosen: Integer, clock: Clock
) -> Generator[Progress, None, Proof]:
    """Go on with a branch and bound until it ends or the limits are reached."""
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
    """Return the proof that a search has come to its end gives."""
    ties = None if search.overflowed else (chosen, *_found(search, among))
    return Proof(chosen, instance.value(chosen), optimal=True, ties=ties)


def _decomposition_bound(
    instance: Instance, least: float, chosen: Integer, clock: Clock
) -> Generator[Progress, None, float]:
    """Bound by parts of the candidates: shortly first, and with more time where that closes part of the gap."""
    better = _better(instance, chosen)
    first = yield from decomposition_bound(instance, better, clock, FIRST_DECOMPOSITION_SHARE * clock.left)
    if first < better or least - first < MIN_BOUND_GAIN * (least - better):
        return first
    return (yield from decomposition_bound(instance, better, clock, FULL_DECOMPOSITION_SHARE * clock.left))


def _better(instance: Instance, chosen: Integer) -> float:
    """Return the covered weight that a strictly better placement reaches at least."""
    return instance.value(chosen) + instance.step


def _from_relaxation(instance: Instance, bound: Bound, chosen: Integer) -> Generator[Progress, None, Integer]:
    """Return a placement made from the relaxation's own selection, where that meets the constraints."""
    picked = np.sort(bound.selection.picked)
    if not instance.feasible(picked):
        return chosen
    return (yield from swap_search(instance, picked))


def _decide(  # what is known, and how far to go
    instance: Instance, keep: Integer, known: Proof, solver: str, clock: Clock, share: float
) -> Generator[Progress, None, Proof]:
    """Look for better placements among the candidates that one may contain; that there is none is the proof.

    Solvers have tolerances: of two placements that differ by less they may return either. So what they call the best
    is only a better one, until they find none.
    """
    program, chosen, bound = CoverProgram(instance.part(keep)), known.chosen, known.bound
    ends = clock.elapsed + share * clock.left
    while True:
        program.require_coverage(_better(instance, chosen))
        part = min(max((ends - clock.elapsed) / clock.left, 0.0), 1.0) if clock.left > 0 else 0.0
        outcome = yield from program.maximise_coverage(solver, clock, part)
        if outcome.chosen is None:
            break
        chosen = keep[outcome.chosen]
    value = instance.value(chosen)
    if not outcome.finished:
        bound = max(value, min(bound, outcome.bound))
    optimal = outcome.finished or instance.attained(bound) < _better(instance, chosen)
    return Proof(chosen, value if optimal else bound, optimal=optimal)


def _outlook(instance: Instance, proof: Proof) -> list[str]:
    """Return notes on what more time would gain."""
    value = instance.value(proof.chosen)
    if proof.halfway is None or value <= 0:
        return []
    before, now = (bound / value - 1 for bound in (proof.halfway, proof.bound))
    if before - now < MIN_GAP_PROGRESS * before:
        slow = (
            "the gap has hardly closed in the second half of the time: a proof may take many times as long; fewer "
            "candidates (a larger spacing, fewer heights) or fewer sensors make it easier"
        )
        return [slow]
    return [f"the gap was {before:.2%} at half the time and is {now:.2%} now: a longer time limit may close more of it"]


def _surplus(asked: int, used: int) -> str:
    return f"asked for {asked} sensors, {used} suffice: no further sensor that the constraints allow adds coverage"


def _guarantee(problem: PlacementProblem, instance: Instance) -> str:
    single = len(np.unique(instance.clique)) == len(instance)
    both = problem.count is not None and problem.budget is not None
    if len(instance.mandatory) or problem.min_distance > 0 or both or (problem.budget is not None and not single):
        return "greedy has no guarantee under these constraints beyond the bound given"
    if problem.budget is not None:
        return "greedy covers at least (1 - 1/e)/2 (32 %) of the optimum"
    return f"greedy covers at least {'1 - 1/e (63 %)' if single else 'one half'} of the optimum"


def scale_notes(problem: PlacementProblem) -> tuple[str, ...]:
    """Return notes on targets and prices too small, beside others, to affect the choice.

    Returns
    -------
    tuple of str
        One sentence for weights and one for prices, where there is anything to say.
    """
    notes = []
    weights = problem.weights[problem.weights > 0]
    light = int(np.count_nonzero(weights < TIE_TOLERANCE * weights.sum()))
    if light and not common_unit(weights)[1]:
        notes.append(
            f"{light:,} of {len(weights):,} targets weigh less than {TIE_TOLERANCE:g} of all weight each: beside the "
            "others they cannot decide; bring the weights closer together"
        )
    prices = problem.prices[problem.allowed & (problem.prices > 0)]
    cheap = int(np.count_nonzero(prices < TIE_TOLERANCE * prices.max(initial=0.0)))
    if cheap:
        notes.append(
            f"{cheap:,} candidates cost less than {TIE_TOLERANCE:g} of the dearest: beside it their prices cannot "
            "decide; give all prices in the same currency"
        )
    return tuple(notes)
