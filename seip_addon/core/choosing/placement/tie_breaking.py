"""Tie-breaking: the canonical one among equally good placements.

Stages, each within the optima of those before: largest coverage, fewest sensors, lowest price, largest doubly covered
weight, and first in the canonical order of candidates.
"""

import math
from collections.abc import Generator
from dataclasses import replace

import numpy as np

from ...arrays import Integer
from ...progress import Progress
from .bounds import lagrangian_bound
from .branch_and_bound import BestPlacements, FirstInOrder, is_worthwhile, merit
from .greedy import drop_redundant, drop_weakest, swap_search
from .integer_program import Expression, is_affordable, reaching
from .reduced_problem import Instance
from .search_limits import Clock

MAX_SEARCHED_TIES = 2_000  # ties that branch and bound lists; of more it looks for the first in order
MAX_LISTED_TIES = 12  # ties that are listed by one program each; beyond, each stage is a program of its own
BLOCK_SIZE = 10  # candidates whose order is settled by one program: powers of two up to 512 are far above tolerances


def canonical_optimum(
    instance: Instance, chosen: Integer, goal: float, ties: tuple[Integer, ...] | None, solver: str, clock: Clock
) -> Generator[Progress, None, tuple[Integer, bool]]:
    """Return the canonical one of the placements that cover as much as an optimal one.

    Parameters
    ----------
    chosen : (k,) int64
        An optimal placement.
    goal : float
        No placement covers more; what falls short of it by the instance's slack at most is equally good.
    ties : tuple of (k,) int64, optional
        All optimal placements, but for those with idle sensors, where they are known.

    Returns
    -------
    (k,) int64
        The canonical optimum, or the best so far where the time was too short.
    bool
        Whether every stage came to its end.
    """
    if ties is not None:
        return min(ties, key=lambda choice: merit(instance, choice)), True
    chosen, settled = yield from fewest(instance, drop_redundant(instance, chosen, goal), goal, solver, clock)
    if not settled:
        return chosen, False
    same_number = replace(instance, count=len(chosen))
    keep, _ = yield from lagrangian_bound(same_number, same_number.as_good(goal), clock)
    keep = np.union1d(keep, chosen)
    yield Progress(0, 0, f"breaking ties among {len(keep)} candidates")
    part, within = same_number.part(keep), np.searchsorted(keep, chosen)
    if is_worthwhile(same_number, keep):
        search = FirstInOrder(part, goal)
        finished = yield from search.run(clock, clock.left)
        candidates = [within] if search.best is None else [within, search.best]
        return keep[min(candidates, key=lambda choice: merit(part, choice))], finished
    if not is_affordable(part, clock):
        return chosen, False
    equal, all_found = yield from _all_equal(part, within, goal, solver, clock)
    best = min(equal, key=lambda choice: merit(part, choice))
    if all_found or len(equal) < MAX_LISTED_TIES:
        return keep[best], all_found
    best, settled = yield from _settle(part, goal, best, solver, clock)
    return keep[best], settled


def fewest(
    instance: Instance, chosen: Integer, goal: float, solver: str, clock: Clock
) -> Generator[Progress, None, tuple[Integer, bool]]:
    """Return a placement of fewest sensors that reaches the goal, and whether that is proven."""
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


def _all_equal(
    part: Instance, chosen: Integer, goal: float, solver: str, clock: Clock
) -> Generator[Progress, None, tuple[list[Integer], bool]]:
    """Return the placements that reach the goal, `MAX_LISTED_TIES` at most, and whether these are all.

    Each is found by maximising coverage once more with those before forbidden:
    that prunes far better than any other objective under a coverage to reach.
    """
    program = reaching(part, goal)
    found = [chosen]
    while len(found) < MAX_LISTED_TIES:
        program.require(program.number_among(found[-1]) <= len(chosen) - 1)
        outcome = yield from program.maximise_coverage(solver, clock)
        if outcome.chosen is None:
            return found, outcome.finished
        found.append(outcome.chosen)
    return found, False


class _Stages:
    """One program, solved for one objective after another; a stage that runs out of time ends them all."""

    def __init__(self, part: Instance, goal: float, chosen: Integer, solver: str, clock: Clock) -> None:
        self.program = reaching(part, goal)
        self.chosen = chosen
        self.settled = True
        self._solver = solver
        self._clock = clock

    def maximise(self, objective: Expression) -> Generator[Progress, None, None]:
        if self.settled:
            outcome = yield from self.program.maximise(objective, self._solver, self._clock)
            self.settled = outcome.finished and outcome.chosen is not None
            if self.settled and outcome.chosen is not None:
                self.chosen = outcome.chosen


def _settle(
    part: Instance, goal: float, chosen: Integer, solver: str, clock: Clock
) -> Generator[Progress, None, tuple[Integer, bool]]:
    """Settle price, double coverage and order by integer programs: for ties too many to list."""
    stages = _Stages(part, goal, chosen, solver, clock)
    program = stages.program
    if np.ptp(part.price) > 0:
        yield from stages.maximise(-1 * program.price)
        program.require_price(math.fsum(part.price[stages.chosen]))
    if len(chosen) > 1:
        yield from stages.maximise(program.doubly_covered)
        program.require_double_coverage(part.doubly(stages.chosen))
    for block in np.array_split(np.arange(len(part)), range(BLOCK_SIZE, len(part), BLOCK_SIZE)):
        # the indicator of the choice, read as a binary number, a block of digits at a time
        yield from stages.maximise(program.number_among(block, 2.0 ** np.arange(len(block))[::-1]))
        for candidate in block:
            program.require(program.x[candidate] == int(candidate in stages.chosen))
        if stages.chosen.max() <= block[-1]:
            break
    return stages.chosen, stages.settled
