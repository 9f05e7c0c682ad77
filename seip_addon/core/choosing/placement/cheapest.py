"""The cheapest placement that reaches a coverage: partial set covering."""

import math
from collections.abc import Generator
from dataclasses import replace

import numpy as np

from ...arrays import Float, Integer
from ...errors import SeipError
from ...progress import Progress
from .bounds import bound_from, can_reach, lagrangian_bound, least_price
from .branch_and_bound import BestPlacements, is_worthwhile
from .feasibility import starting_choice
from .greedy import drop_redundant, drop_weakest, greedy, greedy_with_swaps, swap_search
from .integer_program import is_affordable, reaching
from .objective import SAME_PRICE
from .problem import TIE_TOLERANCE, Placement, PlacementProblem, assess
from .reduced_problem import Instance, common_unit, make_instance
from .search_limits import DEFAULT_LIMITS, Clock, SolverLimits
from .solver import prove, scale_notes, solve_within
from .solvers import check_solver

MIN_FINISHING_LIMIT = 1.0  # least limit, seconds or units of work, of the choice among equally cheap placements


def cheapest_for_coverage(
    problem: PlacementProblem, coverage: float, limits: SolverLimits = DEFAULT_LIMITS
) -> Generator[Progress, None, Placement]:
    """Choose the cheapest placement that covers a share of all weight.

    Among the cheapest placements the one of largest coverage is returned, and among those the one that `solve` prefers.
    If all prices are equal, zero included, the number of sensors replaces the price: the placement has the fewest
    sensors that suffice. The result's objective, bound and gap are prices.

    Parameters
    ----------
    problem : PlacementProblem
        Placement problem; its number of sensors and its budget, if given, limit the placement.
    coverage : float
        Share of the weight of all targets, above 0 and at most 1.

    Raises
    ------
    SeipError
        The coverage cannot be reached, with the highest one that can; or as for `solve`.
    """
    if not 0 < coverage <= 1:
        raise SeipError(f"the coverage to reach is {coverage:g}; give a share above 0 and at most 1")
    solver, clock = limits.solver, limits.clock()
    check_solver(solver)
    instance, factor = make_instance(problem)
    whole = math.fsum(problem.weights) * factor
    goal = instance.attainable(coverage * whole)
    chosen = yield from _reaching(problem, instance, goal, whole, solver, clock)
    chosen = drop_redundant(instance, chosen, goal)
    if problem.prices.any():
        cheapest, bound = yield from _cheapest(instance, chosen, goal, solver, clock)
    else:
        cheapest, proven = yield from _fewest(instance, chosen, goal, solver, clock)
        bound = 0.0 if proven else -math.inf
    finishing = clock.part(clock.elapsed, MIN_FINISHING_LIMIT)  # no longer than it took to find the price
    best = yield from solve_within(_no_dearer(problem, instance, cheapest), solver, finishing)
    reached = best.covered * factor >= goal - instance.slack
    chosen = best.chosen if reached else instance.original[cheapest]
    return _record(problem, chosen, bound, best, clock)


def _reaching(
    problem: PlacementProblem, instance: Instance, goal: float, whole: float, solver: str, clock: Clock
) -> Generator[Progress, None, Integer]:
    """Return some placement that reaches the goal."""
    start = yield from starting_choice(problem, instance, solver)
    chosen = greedy(instance, start, per_price=bool(instance.price.any()), enough=goal - instance.slack)
    if instance.value(chosen) >= goal - instance.slack:
        return chosen
    first = yield from greedy_with_swaps(instance, start)
    proof = yield from prove(instance, first, solver, clock)
    covered = instance.value(proof.chosen)
    if covered >= goal - instance.slack:
        return proof.chosen
    wanted = f"a coverage of {goal / whole:.2%}"
    if instance.attained(proof.bound) < goal - instance.slack:
        raise SeipError(
            f"{wanted} cannot be reached: no placement covers more than {proof.bound / whole:.2%}; "
            "ask for less, or allow more or better sensors"
        )
    raise SeipError(
        f"no placement with {wanted} was found in {clock.seconds:.0f} s: the best one covers {covered / whole:.2%}; "
        "ask for less or raise the time limit"
    )


def _cheapest(
    instance: Instance, chosen: Integer, goal: float, solver: str, clock: Clock
) -> Generator[Progress, None, tuple[Integer, float]]:
    """Return the cheapest placement that reaches the goal and a lower bound on the price of any."""
    price = math.fsum(instance.price[chosen])
    if price == 0:
        return chosen, price
    no_dearer = replace(instance, budget=min(price, instance.budget))
    keep, bound = yield from lagrangian_bound(no_dearer, goal, clock)
    least = min(price, max(least_price(instance.of(keep), bound, goal), float(instance.price.min())))
    if np.ptp(instance.price) == 0:
        chosen, proven = yield from _fewest(instance, chosen, goal, solver, clock)
        price = math.fsum(instance.price[chosen])
        single = float(instance.price[0])
        return chosen, price if proven else min(price, math.ceil(least / single * (1 - TIE_TOLERANCE)) * single)
    cheaper = replace(instance, budget=_below(price, instance.price)).of(keep)
    within = can_reach(cheaper, bound_from(cheaper, bound.targets, bound.groups), goal)
    keep, cheaper = keep[within], cheaper.part(within)
    if len(keep) == 0:
        return chosen, price
    yield Progress(0, 0, f"looking for a cheaper placement among {len(keep)} candidates")
    program = reaching(cheaper, goal)
    outcome = yield from program.maximise(-1 * program.price, solver, clock)
    if outcome.chosen is not None:
        chosen, price = keep[outcome.chosen], math.fsum(instance.price[keep[outcome.chosen]])
    if outcome.finished:
        return chosen, price
    return chosen, min(price, max(least, -outcome.bound / program.price_scale))


def _fewest(
    instance: Instance, chosen: Integer, goal: float, solver: str, clock: Clock
) -> Generator[Progress, None, tuple[Integer, bool]]:
    """Return a placement of fewest sensors that reaches the goal, and whether that is proven."""
    # Each round asks for one sensor less, by ever more expensive means: local search, the Lagrangian bound, branch and
    # bound, an integer program. A placement found at any of them starts the next round. A proof that there is none
    # ends the stage: the limit on the number includes all smaller numbers.
    while len(chosen) > 1:
        fewer = replace(instance, count=len(chosen) - 1)
        improved = yield from swap_search(fewer, drop_weakest(instance, chosen))
        if fewer.feasible(improved) and fewer.value(improved) >= goal - instance.slack:
            chosen = drop_redundant(fewer, improved, goal)
            continue
        keep, bound = yield from lagrangian_bound(fewer, fewer.as_good(goal), clock)
        if bound.value < goal - instance.slack or len(keep) == 0:
            break
        yield Progress(0, 0, f"looking for fewer than {len(chosen)} sensors among {len(keep)} candidates")
        if is_worthwhile(fewer, keep):
            search = BestPlacements(fewer.part(keep), goal, 1, goal)
            finished = yield from search.run(clock, clock.left / 2)
            if search.found:
                chosen = drop_redundant(fewer, keep[search.found[0]], goal)
                continue
            if finished:
                break
        part = fewer.part(keep)
        if not is_affordable(part, clock):
            return chosen, False
        outcome = yield from reaching(part, goal).maximise_coverage(solver, clock)
        if outcome.chosen is None:
            return chosen, outcome.finished
        chosen = drop_redundant(fewer, keep[outcome.chosen], goal)
    return chosen, True


def _below(price: float, prices: Float) -> float:
    """Return a budget that any lower total price meets, and that is as far below the price as it can be."""
    unit, whole = common_unit(prices[prices > 0])
    return price - unit / 2 if whole else price * (1 - 3 * TIE_TOLERANCE)


def _no_dearer(problem: PlacementProblem, instance: Instance, cheapest: Integer) -> PlacementProblem:
    """Return the problem of covering most for the price of the cheapest placement."""
    if np.ptp(instance.price) == 0 and (instance.price.any() or not problem.prices.any()):
        return replace(problem, count=len(cheapest))
    return replace(problem, budget=math.fsum(instance.price[cheapest]))


def _record(problem: PlacementProblem, chosen: Integer, bound: float, best: Placement, clock: Clock) -> Placement:
    price = math.fsum(problem.prices[chosen])
    optimal = bound >= price * (1 - 3 * TIE_TOLERANCE)
    notes = [*scale_notes(problem)]
    if not optimal:
        notes.append(
            "the search ended before this placement was proven the cheapest: the gap is the share of its price that "
            "another one may save"
        )
    if best.status != "optimal":
        more = max(0.0, best.bound - problem.covered(chosen)) / math.fsum(problem.weights)
        points = math.ceil(more * 1000 - 1e-9) / 10
        notes.append(f"{SAME_PRICE}another one may cover up to {points:.1f} percentage points more")
    return assess(
        problem,
        chosen,
        max(bound, 0.0),
        optimal=optimal,
        solver=best.solver,
        seconds=clock.seconds,
        notes=tuple(notes),
        objective=price,
    )
