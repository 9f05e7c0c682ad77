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

MAX_SEARCHED_TIES = 2_000  # ties that branch and bound lists; if there are more, it searches for the first in order
MAX_LISTED_TIES = 12  # ties that are listed by one program each; if there are more, each stage is a separate program
BLOCK_SIZE = 10  # candidates whose order is settled by one program: powers of two up to 512 are far above tolerances


def canonical_optimum(
    instance: Instance, chosen: Integer, goal: float, ties: tuple[Integer, ...] | None, solver: str, clock: Clock
) -> Generator[Progress, None, tuple[Integer, bool]]:
    """Return the canonical optimum: the first in order of all optimal placements.

    Parameters
    ----------
    chosen : (k,) int64
        An optimal placement.
    goal : float
        Largest weight that any placement covers. A placement that covers less by at most the instance's slack is
        equally good.
    ties : tuple of (k,) int64, optional
        All optimal placements except those with idle sensors, where they are known.

    Returns
    -------
    (k,) int64
        The canonical optimum, or the best so far where the time was too short.
    bool
        Whether every stage was completed.
    """
    # Without this, the placement returned would depend on the order in which the search met equal ones, and so on the
    # order of the candidates, on the solver and on its version.
    if ties is not None:
        return min(ties, key=lambda choice: merit(instance, choice)), True
    # First stage: the number of sensors. The later stages compare placements with this number only, so that it becomes
    # the limit, which makes bounds smaller and rules out more candidates.
    chosen, settled = yield from fewest(instance, drop_redundant(instance, chosen, goal), goal, solver, clock)
    if not settled:
        return chosen, False
    same_number = replace(instance, count=len(chosen))
    # The reduction keeps the candidates of all placements that are as good. Those of the chosen one are kept in any
    # case, so that the search has a placement to begin from.
    keep, _ = yield from lagrangian_bound(same_number, same_number.as_good(goal), clock)
    keep = np.union1d(keep, chosen)
    yield Progress(0, 0, f"breaking ties among {len(keep)} candidates")
    part, within = same_number.part(keep), np.searchsorted(keep, chosen)
    # Three ways to the remaining stages, the first that is affordable: branch and bound that compares all four criteria
    # at once; a list of all ties by integer programs; one integer program for each stage.
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


def _all_equal(
    part: Instance, chosen: Integer, goal: float, solver: str, clock: Clock
) -> Generator[Progress, None, tuple[list[Integer], bool]]:
    """Return up to `MAX_LISTED_TIES` placements that reach the goal, and whether these are all.

    Each is found by maximising coverage again with the previous ones forbidden. With coverage as the objective the
    solver prunes far better than with any other objective and the goal as a constraint.
    """
    program = reaching(part, goal)
    found = [chosen]
    while len(found) < MAX_LISTED_TIES:
        # All ties have the same number of sensors: at most all but one of the last tie's excludes that tie and no
        # other.
        program.require(program.number_among(found[-1]) <= len(chosen) - 1)
        outcome = yield from program.maximise_coverage(solver, clock)
        if outcome.chosen is None:
            return found, outcome.finished
        found.append(outcome.chosen)
    return found, False


class _Stages:
    """One program, solved for one objective after another; if a stage runs out of time, the later ones are skipped."""

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
    """Settle price, double coverage and order by one integer program each, where there are too many ties to list."""
    stages = _Stages(part, goal, chosen, solver, clock)
    program = stages.program
    # Lexicographic optimisation: the optimum of each stage becomes a constraint of the following ones. A stage that
    # cannot tell placements apart is skipped (equal prices; a single sensor covers nothing twice).
    if np.ptp(part.price) > 0:
        yield from stages.maximise(-1 * program.price)
        program.require_price(math.fsum(part.price[stages.chosen]))
    if len(chosen) > 1:
        yield from stages.maximise(program.doubly_covered)
        program.require_double_coverage(part.doubly(stages.chosen))
    for block in np.array_split(np.arange(len(part)), range(BLOCK_SIZE, len(part), BLOCK_SIZE)):
        # The first placement in order is the one whose indicator, read as a binary number with the first candidate as
        # its leading digit, is largest. Digits of all candidates at once would need coefficients beyond a solver's
        # tolerances: one block is maximised at a time, and its digits are fixed before the next one.
        yield from stages.maximise(program.number_among(block, 2.0 ** np.arange(len(block))[::-1]))
        for candidate in block:
            program.require(program.x[candidate] == int(candidate in stages.chosen))
        # all sensors are fixed: the remaining digits are zero
        if stages.chosen.max() <= block[-1]:
            break
    return stages.chosen, stages.settled
