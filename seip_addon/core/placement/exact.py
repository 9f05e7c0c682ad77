"""The placement that covers most, proven optimal or with a bound."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Integer
from ..progress import Progress, finish
from .bounds import Bound, can_reach, lagrangian_bound
from .branch_and_bound import best_placements, is_worthwhile
from .clock import Clock
from .districts import district_bound
from .feasibility import starting_choice
from .greedy import exchange, greedy_and_exchange, greedy_choices, tabu_search, without_idle
from .instance import Instance, make_instance
from .integer_program import check_solver, reaching
from .problem import Placement, PlacementProblem, record_choice
from .scale_notes import scale_notes
from .ties import MANY, canonical_optimum

BRANCHING = 0.6
"""Share of the time for branch and bound, where that is worthwhile, before programs are tried."""

BRANCHING_ALONE = 0.9
"""The same where the whole program is too large for a solver."""

SEARCHING, BOUNDING = 0.15, 0.5
"""Shares of the time left for a search of exchanges and for a bound by districts, where branching does not decide."""

LARGEST = 1_000_000
"""Entries of V up to which the whole program is given to the solver: PuLP takes some 0.5 kB for each."""


@dataclass(frozen=True, eq=False)
class Proof:
    """What is proven about a placement.

    Parameters
    ----------
    chosen : (k,) int64
    bound : float
        No placement covers more.
    optimal : bool
    ties : tuple of (k,) int64, optional
        All placements that cover as much, but for those with idle sensors, where they are known.
    """

    chosen: Integer
    bound: float
    optimal: bool
    ties: tuple[Integer, ...] | None = None


def solve(
    problem: PlacementProblem, *, solver: str = "highs", time_limit: float = 60.0
) -> Generator[Progress, None, Placement]:
    """Choose the placement that covers most.

    Among optimal placements the one with fewest sensors is returned, then the
    cheapest, then the one with the largest doubly covered weight, then the
    first in the canonical order of candidates: always the same one, however
    candidates and targets are ordered.

    Reductions that lose nothing come first; a greedy choice improved by
    exchanges gives an incumbent, a Lagrangian relaxation a bound; candidates
    that the bound rules out are dropped. Among the rest branch and bound
    decides for few sensors. For many a tabu search improves the incumbent,
    districts the bound, and an integer program has what time is left.

    Parameters
    ----------
    problem : PlacementProblem
    solver : str
        ``highs``, ``cbc`` or ``gurobi``.
    time_limit : float, seconds
        After it the best placement found is returned with its bound and gap.

    Yields
    ------
    Progress

    Returns
    -------
    Placement

    Raises
    ------
    SeipError
        The constraints cannot be met together, no candidate sees any target,
        or the solver is not available.
    """
    clock = Clock(time_limit)
    version = check_solver(solver)
    instance, factor = make_instance(problem)
    start = yield from starting_choice(problem, instance, solver)
    first = yield from greedy_and_exchange(instance, start)
    proof = yield from prove(instance, first, solver, clock)
    chosen = without_idle(instance, proof.chosen, instance.covered(proof.chosen))
    notes = [*scale_notes(problem)]
    if proof.optimal:
        chosen, settled = yield from canonical_optimum(instance, chosen, proof.ties, solver, clock)
        if not settled:
            notes.append("the time was too short to break all ties: another placement may cover as much")
    else:
        notes.append(
            "the time was too short to prove this placement optimal: the gap says by how much it may fall short"
        )
    if problem.count is not None and len(chosen) < problem.count:
        notes.append(_surplus(problem.count, len(chosen)))
    original = instance.original[chosen]
    return record_choice(
        problem,
        original,
        proof.bound / factor,
        optimal=proof.optimal,
        solver=version,
        seconds=clock.elapsed,
        notes=tuple(notes),
    )


def solve_greedy(problem: PlacementProblem) -> Placement:
    """Choose greedily, with a certificate.

    With the number of sensors alone and one pose per position, greedy covers
    at least 1 - 1/e (63 %) of the optimum (Nemhauser, Wolsey and Fisher
    1978); with several poses per position at least a half (Fisher, Nemhauser
    and Wolsey 1978); the better of gain and gain per price, under a budget
    alone, at least (1 - 1/e)/2 (Khuller, Moss and Naor 1999). The bound of
    the result is computed from the data and is usually far closer.

    Parameters
    ----------
    problem : PlacementProblem

    Returns
    -------
    Placement

    Raises
    ------
    SeipError
        The constraints cannot be met together, or no candidate sees any target.
    """
    clock = Clock(math.inf)
    instance, factor = make_instance(problem)
    runs = greedy_choices(instance, finish(starting_choice(problem, instance, "highs")))
    chosen = max((choice for choice, _ in runs), key=instance.covered)
    bound = min(bound for _, bound in runs)
    optimal = bound < _better(instance, chosen) - instance.slack
    original = instance.original[chosen]
    return record_choice(
        problem,
        original,
        bound / factor,
        optimal=optimal,
        solver="greedy",
        seconds=clock.elapsed,
        notes=(_guarantee(problem, instance),),
    )


def prove(instance: Instance, chosen: Integer, solver: str, clock: Clock) -> Generator[Progress, None, Proof]:
    """Improve an incumbent and the bound on it until they meet or the time is up.

    Parameters
    ----------
    instance : Instance
    chosen : (k,) int64
        A placement to begin from.
    solver : str
    clock : Clock

    Yields
    ------
    Progress

    Returns
    -------
    Proof
    """
    keep, bound = yield from lagrangian_bound(instance, instance.covered(chosen), clock)
    proof = yield from _prove_among(instance.part(keep), np.searchsorted(keep, chosen), bound, solver, clock)
    ties = None if proof.ties is None else tuple(keep[choice] for choice in proof.ties)
    return replace(proof, chosen=keep[proof.chosen], bound=instance.attained(proof.bound), ties=ties)


def _prove_among(
    instance: Instance, chosen: Integer, bound: Bound, solver: str, clock: Clock
) -> Generator[Progress, None, Proof]:
    """Improve an incumbent among the candidates that a bound leaves, none better being among the others."""
    relaxed = yield from _from_relaxation(instance, bound, chosen)
    chosen = max(chosen, relaxed, key=instance.covered)
    as_good = np.union1d(can_reach(instance, bound, instance.covered(chosen)), chosen)
    if is_worthwhile(instance, as_good):
        part, value, most = instance.part(as_good), instance.covered(chosen), min(bound.value, instance.total)
        share = BRANCHING if np.count_nonzero(part.visible) <= LARGEST else BRANCHING_ALONE
        found = yield from best_placements(part, value, MANY, most, clock, share * clock.left)
        equal = [as_good[choice] for choice in found.placements]
        chosen = max([chosen, *equal[:1]], key=instance.covered)
        if found.finished:
            ties = (chosen, *equal) if found.complete else None
            return Proof(chosen, instance.covered(chosen), optimal=True, ties=ties)
    least = min(bound.value, instance.total)
    if least >= _better(instance, chosen) - instance.slack:
        for beginning in (chosen, relaxed):
            searched = yield from tabu_search(instance, beginning, clock, SEARCHING * clock.left)
            chosen = max(chosen, searched, key=instance.covered)
        by_districts = yield from district_bound(instance, _better(instance, chosen), clock, BOUNDING * clock.left)
        least = min(least, by_districts)
    keep = can_reach(instance, bound, _better(instance, chosen))
    if least < _better(instance, chosen) - instance.slack or len(keep) == 0:
        return Proof(chosen, instance.covered(chosen), optimal=True)
    if clock.left <= 0 or np.count_nonzero(instance.visible[keep]) > LARGEST:
        return Proof(chosen, least, optimal=False)
    yield Progress(0, 0, f"proving with {len(keep)} of {len(instance)} candidates")
    return (yield from _decide(instance, keep, least, chosen, solver, clock))


def _better(instance: Instance, chosen: Integer) -> float:
    """Return the covered weight that a strictly better placement reaches at least."""
    return instance.covered(chosen) + instance.step


def _from_relaxation(instance: Instance, bound: Bound, chosen: Integer) -> Generator[Progress, None, Integer]:
    """Return a placement made from the relaxation's own selection, where that meets the constraints."""
    picked = np.sort(bound.selection.picked)
    if not instance.feasible(picked):
        return chosen
    return (yield from exchange(instance, picked))


def _decide(
    instance: Instance, keep: Integer, bound: float, chosen: Integer, solver: str, clock: Clock
) -> Generator[Progress, None, Proof]:
    """Look for a better placement among the candidates that one may contain; that there is none is the proof."""
    program = reaching(instance.part(keep), _better(instance, chosen))
    outcome = yield from program.maximise_coverage(solver, clock.left)
    chosen = chosen if outcome.chosen is None else keep[outcome.chosen]
    value = instance.covered(chosen)
    bound = value if outcome.finished else max(value, min(bound, outcome.bound))
    return Proof(chosen, bound, optimal=bound < _better(instance, chosen) - instance.slack)


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
