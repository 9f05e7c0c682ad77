"""Solve a placement problem: a first placement, better ones, and a bound on all."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float, Integer
from ...base.counts import counted
from ...base.errors import SeipError
from ...base.progress import Progress, finish, within
from .branch_and_bound import BranchAndBound, GainSearch
from .concave import Steps, StepSum
from .feasibility import starting_choice
from .incumbent import Incumbent
from .instance import Instance, make_instance
from .integer_program import check_solver, is_affordable, prove_by_program
from .problem import Placement, PlacementProblem, assess
from .risk import NOMINAL, Risk
from .search import Search, without_idle
from .search_limits import DEFAULT_LIMITS, SolverLimits, Work

RESTART_SHARE, SHORT_SHARE = 0.6, 0.3
"""Shares of what is left for restarts; the second one over scenarios, whose placements begin from the nominal optimum,
and for few sensors, of which all placements can be searched."""
FEW_SENSORS, GAIN_SHARE = 5, 0.95
"""Sensors up to which a search by gains often ends with a proof, and its share of what is left."""
PROGRAM_SHARE = 0.5  # share of what is left then for an integer program
TIGHT_GAP = 0.01  # largest gap at which an integer program is tried without being asked for
MORE = 2  # sensors beyond those of a placement, up to which `front_of` goes
FRONT_EFFORT = 0.5  # units of work for each of its numbers of sensors
UNPROVEN = "the search ended before this placement was proven optimal: the gap is the most by which it may fall short"

Describe = Callable[[Integer, float], str]
"""Description for the user of candidates and their objective value."""


def solve(
    problem: PlacementProblem,
    limits: SolverLimits = DEFAULT_LIMITS,
    *,
    cases: Sequence[NDArray[Any]] | None = None,
    risk: Risk = NOMINAL,
    known: Integer | None = None,
    describe: Describe | None = None,
) -> Generator[Progress, None, Placement]:
    """Choose the placement of largest value.

    A greedy choice improved by swaps is there at once. Then follow a linear bound; restarts of the search for as long
    as they find better placements; for few sensors a search by gains, which proves many problems; and branch and bound
    on the linear bound, up to the limit of work. Of equally good placements the first one found is kept, unless a later
    one has fewer sensors or a lower price. The result does not depend on the order of candidates and targets.

    Values are equal if they differ by less than rounding: whole weights are compared exactly, other values to a
    billionth of the total weight.

    Parameters
    ----------
    cases : sequence of (c, t) arrays, optional
        Amounts in each scenario; by default the problem's are the only ones.
    risk : Risk
        Risk measure over the scenarios, and failure of a sensor.
    known : (k,) int64, optional
        Candidates of a placement of this problem, or of one with other limits, to begin from besides.
    describe : callable, optional
        Description of the best placement for reports on progress.

    Raises
    ------
    SeipError
        The constraints cannot be met together, no candidate adds anything, fewer sensors are allowed than the risk
        measure needs, or the solver is not available.
    """
    risk.require_sensors(problem.most_sensors)
    instance = make_instance(problem, cases, risk)
    return (yield from solve_instance(problem, instance, limits, known=known, describe=describe))


def solve_instance(
    problem: PlacementProblem,
    instance: Instance,
    limits: SolverLimits = DEFAULT_LIMITS,
    *,
    known: Integer | None = None,
    describe: Describe | None = None,
) -> Generator[Progress, None, Placement]:
    """Choose the placement of largest value of a reduced problem; see `solve`."""
    check_solver(limits.solver)
    incumbent = Incumbent(instance, limits.work(), describe)
    start = yield from starting_choice(problem, instance, limits.solver)
    solver = yield from search_and_prove(incumbent, start, limits.solver, known)
    return placement_of(problem, incumbent, solver)


def search_and_prove(
    incumbent: Incumbent, start: Integer, solver: str, known: Integer | None = None
) -> Generator[Progress, None, str]:
    """Improve a placement and its bound until they meet or the work is done; return the names of the methods used.

    Parameters
    ----------
    start : (s,) int64
        Candidates of the instance that serve all mandatory groups.
    known : (k,) int64, optional
        Candidates of the problem to begin from besides.
    """
    instance, work = incumbent.instance, incumbent.work
    search = Search(incumbent, start)
    yield from search.first()
    if known is not None:
        yield from search.adapt(np.flatnonzero(np.isin(instance.original, known)))
    block = instance.relaxed(_shares(incumbent))
    branches, name = BranchAndBound(incumbent, block), "branch and bound"
    promise = yield from branches.start()
    if incumbent.proven:
        return name
    few = instance.count <= FEW_SENSORS and math.isinf(instance.budget)
    by_gains = GainSearch(incumbent, block) if few and isinstance(block, StepSum) else None
    share = RESTART_SHARE if instance.is_plain and by_gains is None else SHORT_SHARE
    yield from search.restarts(share * work.left, promise)
    if by_gains is not None and (yield from by_gains.run(branches.left(), GAIN_SHARE)):
        return name
    rest, part = branches.left(), work.part(PROGRAM_SHARE * work.left)
    linear = instance.is_plain and isinstance(instance.blocks[0].g, Steps)
    if linear and (incumbent.gap <= TIGHT_GAP or solver != "auto") and is_affordable(instance.of(rest), part):
        name = f"{name}, {check_solver(solver)}"
        yield from prove_by_program(incumbent, rest, solver, part)
    if not incumbent.proven:
        yield from branches.run()
    return name


def _shares(incumbent: Incumbent) -> Float:
    """Return shares of the blocks for a bound on the risk measure, (K,) float64: the worst ones of the best placement.

    Any shares of at most 1/m that add up to 1 give a bound.
    """
    outcomes = np.array([block.value(incumbent.chosen) for block in incumbent.instance.blocks])
    worst = incumbent.instance.risk.worst(outcomes)
    shares = np.zeros(len(outcomes))
    shares[worst] = 1.0 / len(worst)
    return shares


def placement_of(problem: PlacementProblem, incumbent: Incumbent, solver: str) -> Placement:
    """Return the best placement of a search with its certificate."""
    instance = incumbent.instance
    optimal = incumbent.proven
    chosen = without_idle(incumbent)
    notes = [] if optimal else [UNPROVEN]
    if problem.count is not None and len(chosen) < problem.count:
        suffice = "suffices" if len(chosen) == 1 else "suffice"
        notes.append(
            f"{len(chosen)} of {counted(problem.count, 'sensor')} {suffice}: no further sensor that the constraints "
            "allow adds anything"
        )
    return assess(
        problem,
        instance.original[chosen],
        incumbent.value * instance.unit,
        max(incumbent.bound, incumbent.value) * instance.unit,
        optimal=optimal,
        solver=solver,
        notes=notes,
    )


def solve_greedy(problem: PlacementProblem, instance: Instance | None = None) -> Placement:
    """Choose greedily, without swaps and without a bound.

    Parameters
    ----------
    instance : Instance, optional
        The problem reduced by `make_instance`, if it is there already.

    Raises
    ------
    SeipError
        The constraints cannot be met together, or no candidate adds anything.
    """
    incumbent = Incumbent(make_instance(problem) if instance is None else instance, Work(math.inf))
    search = Search(incumbent, finish(starting_choice(problem, incumbent.instance, "auto")))
    for power in search.powers:
        incumbent.offer(finish(search.filled(search.start, power)))
    return replace(placement_of(problem, incumbent, "greedy"), notes=())


def front_of(
    problem: PlacementProblem, placement: Placement, certified: range, effort: float = FRONT_EFFORT
) -> Generator[Progress, None, dict[int, Placement]]:
    """Find the best placements of one sensor, two and so on, up to two more than a placement has.

    Constraints are those of the problem, without a budget. A bound for more sensors holds for fewer, and a placement of
    fewer sensors is one of at most more, so that more sensors never have the smaller value or bound.

    Parameters
    ----------
    placement : Placement
        Placement from which the searches start.
    certified : range
        Numbers of sensors for which its bound holds, and no other placement is searched.
    effort : float, units of work
        Limit for each number of sensors.

    Returns
    -------
    dict of int to Placement
        Placement by largest number of sensors, without numbers that the constraints do not allow. Its bound holds for
        all placements of at most that number.
    """
    chosen = placement.chosen
    most = min(len(chosen) + MORE, len(set(problem.positions[problem.allowed].tolist())))
    found: dict[int, Placement] = {}
    whole = make_instance(problem)
    for count in range(1, most + 1):
        step = Progress(count - 1, most, "fewer and more sensors", counted=False)
        yield step
        if count in certified:
            found[count] = placement
            continue
        try:
            limited = replace(problem, count=count, budget=None)
            instance = replace(whole, count=limited.most_sensors, budget=math.inf)
            steps = solve_instance(limited, instance, SolverLimits(effort=effort), known=chosen)
            found[count] = yield from within(step, steps)
        except SeipError:  # fewer than the constraints demand
            continue
    return {count: _best(count, problem, found) for count in found}


def _best(count: int, problem: PlacementProblem, found: dict[int, Placement]) -> Placement:
    """Return the best placement of at most ``count`` sensors, with the smallest bound of any larger number."""
    best = max((one for number, one in found.items() if number <= count), key=lambda one: one.objective)
    bound = max(best.objective, min(one.bound for number, one in found.items() if number >= count))
    return replace(best, bound=bound, gap=problem.g.gap(best.objective, bound, math.fsum(problem.weights)))
