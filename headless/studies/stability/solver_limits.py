"""Solvers under extreme weights and prices, near-ties, symmetry and short time limits."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from seip_addon.core.arrays import Boolean, Float, Integer
from seip_addon.core.choosing.placement.integer_program import reaching
from seip_addon.core.choosing.placement.problem import TIE_TOLERANCE, Placement, PlacementProblem
from seip_addon.core.choosing.placement.reduced_problem import make_instance
from seip_addon.core.choosing.placement.search_limits import Clock, SolverLimits
from seip_addon.core.choosing.placement.solver import solve, solve_greedy
from seip_addon.core.choosing.placement.solvers import is_available
from seip_addon.core.progress import Progress, finish

from .rows import Row
from .shares import Share

DECADES = (0, 3, 6, 9, 12, 15, 18)
"""Powers of ten between the lightest and the heaviest target, or the cheapest and the most expensive sensor."""

PERTURBATIONS = (1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
"""Relative perturbations of equal weights."""

SUM_TOLERANCE = 1e-12
"""Relative error of a covered weight summed in float64."""

PLANE_ORDERS = (2, 3, 5, 7, 11, 13, 17)
"""Orders of projective planes, which are highly symmetric instances with degenerate linear programs."""

GREEDY_COUNTS = (2, 3, 4, 5, 6, 8, 10)


@dataclass(frozen=True)
class SpanCheck:
    """Solutions of random instances compared with exhaustive search.

    Parameters
    ----------
    what : str
        ``weights`` or ``prices``.
    method : str
        ``solve``, or the name of the solver that solved only the integer program.
    decades : int
        Powers of ten that weights or prices span.
    worse : Share
        Solutions that cover less than the best placement, in exact arithmetic.
    lost : float
        Largest loss of a solution, as a share of the optimum.
    """

    what: str
    method: str
    decades: int
    worse: Share
    lost: float


@dataclass(frozen=True)
class TieCheck:
    """Change of the choice under perturbations of equal weights.

    Parameters
    ----------
    by : float
        Largest relative perturbation of each weight.
    changed : Share
        Instances whose choice changes.
    lost : float
        Largest loss of a changed choice, as a share of the unperturbed optimum; at most twice ``by`` is allowed.
    """

    by: float
    changed: Share
    lost: float


@dataclass(frozen=True)
class GreedyCheck:
    """Greedy selection on its worst-case instance.

    Parameters
    ----------
    count : int
        Number of sensors.
    greedy, best : float
        Shares of the weight covered by greedy and by the exact solver.
    least : float
        Lower bound on the share of greedy, 1 - (1 - 1/count)^count.
    proven : bool
        Whether the exact solver proved its solution optimal.
    """

    count: int
    greedy: float
    best: float
    least: float
    proven: bool


@dataclass(frozen=True)
class TimeCheck:
    """A hard instance under a time limit.

    Parameters
    ----------
    limit, seconds : float
        Time limit, and time taken.
    gap : float
        Certified gap: no placement covers more by a larger share.
    """

    name: str
    limit: float
    seconds: float
    gap: float
    proven: bool


@dataclass(frozen=True)
class SolverStudy:
    """Results of the checks of the solvers."""

    spans: tuple[SpanCheck, ...]
    ties: tuple[TieCheck, ...]
    greedy: tuple[GreedyCheck, ...]
    times: tuple[TimeCheck, ...]


def solver_study(instances: int = 60, seed: int = 0, limit: float = 1.0) -> Generator[Progress, None, SolverStudy]:
    """Find the limits of the solvers.

    Parameters
    ----------
    instances : int
        Number of random instances for each span and each perturbation.
    limit : float, seconds
        Time limit for the hard instances.
    """
    total = 2 * len(DECADES) + len(PERTURBATIONS) + 2
    spans, ties = [], []
    for number, decades in enumerate(DECADES):
        for kind, what in enumerate(("weights", "prices")):
            yield Progress(2 * number + kind, total, f"{what} over {decades} decades")
            spans += _check_span(what, decades, instances, np.random.default_rng((seed, decades, kind)))
    for number, by in enumerate(PERTURBATIONS):
        yield Progress(2 * len(DECADES) + number, total, f"weights perturbed by {by:g}")
        ties.append(_check_ties(by, instances, np.random.default_rng(seed)))
    yield Progress(total - 2, total, "greedy's worst case")
    greedy = tuple(_check_greedy(count) for count in GREEDY_COUNTS)
    yield Progress(total - 1, total, "symmetric instances with a time limit")
    times = [_check_time(f"projective plane of order {order}", plane(order), limit) for order in PLANE_ORDERS]
    uneven = _uneven(plane(PLANE_ORDERS[-1]), 1e-7, np.random.default_rng(seed))
    times.append(_check_time(f"projective plane of order {PLANE_ORDERS[-1]}, near-ties", uneven, limit))
    return SolverStudy(tuple(spans), tuple(ties), greedy, tuple(times))


def worst_for_greedy(count: int, push: float = 1e-3) -> PlacementProblem:
    """Return an instance on which greedy covers the share 1 - (1 - 1/count)^count of the best placement.

    ``count`` candidates see one column of targets each, and together all targets.
    The others see one row each, with slightly more weight than is left of a
    column (cf. Cornuéjols, Fisher and Nemhauser 1977, section 4).

    Parameters
    ----------
    push : float
        Relative surplus of the rows, which makes greedy take them.
    """
    left = (1 - 1 / count) ** np.arange(count + 1)
    rows = np.append(left[:-1] / count, left[-1])
    weights = np.repeat(np.round(rows * 1e6), count)
    weights[: count * count] *= 1 + push
    cell_row, cell_column = np.divmod(np.arange(count * (count + 1)), count)
    seen_rows = np.arange(count)[:, None] == cell_row
    seen_columns = np.arange(count)[:, None] == cell_column
    return plain_problem(np.concatenate([seen_rows, seen_columns]), np.round(weights), count)


def plane(order: int) -> PlacementProblem:
    """Return a problem with the lines of a projective plane of prime order as candidates and its points as targets."""
    points = [(1, a, b) for a in range(order) for b in range(order)] + [(0, 1, a) for a in range(order)] + [(0, 0, 1)]
    homogeneous = np.array(points)
    incident: Boolean = (homogeneous @ homogeneous.T) % order == 0
    return plain_problem(incident, np.ones(len(points)), order)


def plain_problem(visible: Boolean, weights: Float, count: int) -> PlacementProblem:
    """Return a problem with one pose at each position, all of the same price."""
    number = len(visible)
    return PlacementProblem(
        visible=visible,
        weights=weights,
        prices=np.ones(number),
        positions=np.arange(number),
        xyz=np.column_stack([np.arange(number), np.zeros((number, 2))]).astype(np.float64),
        labels=np.full(number, "probe"),
        count=count,
    )


def best_covered(problem: PlacementProblem) -> float:
    """Return the covered weight of the best placement, by exhaustive search."""
    return max(covered(problem, np.array(choice)) for choice in _allowed(problem))


def covered(problem: PlacementProblem, choice: Integer) -> float:
    """Return the covered weight of a placement."""
    return math.fsum(problem.weights[problem.visible[choice].any(axis=0)])


def _allowed(problem: PlacementProblem) -> list[tuple[int, ...]]:
    number, most = len(problem.visible), problem.count or len(problem.visible)
    budget = math.inf if problem.budget is None else problem.budget * (1 + SUM_TOLERANCE)
    return [
        choice
        for size in range(1, most + 1)
        for choice in combinations(range(number), size)
        if math.fsum(problem.prices[list(choice)]) <= budget
    ]


def _random_problem(random: np.random.Generator) -> PlacementProblem:
    visible = random.random((9, 12)) < 0.3
    visible[0, 0] = True
    return plain_problem(visible, np.ones(12), 3)


def _check_span(what: str, decades: int, instances: int, random: np.random.Generator) -> list[SpanCheck]:
    problems = []
    for _ in range(instances):
        problem = _random_problem(random)
        if what == "weights":
            problems.append(replace(problem, weights=10 ** (decades * (random.random(12) - 0.5))))
        else:
            prices = 10 ** (decades * (random.random(9) - 0.5))
            problems.append(replace(problem, prices=prices, budget=float(np.sort(prices)[random.integers(2, 9)])))
    checks = [_span_check(what, "solve", decades, problems, [finish(solve(p)).chosen for p in problems])]
    for solver in ("highs", "cbc"):
        if is_available(solver):
            few = problems[: max(1, instances // 3)]  # each starts a solver of its own
            checks.append(_span_check(what, solver, decades, few, [_by_program(p, solver) for p in few]))
    return checks


def _span_check(
    what: str, method: str, decades: int, problems: Sequence[PlacementProblem], choices: Sequence[Integer]
) -> SpanCheck:
    lost = []
    for problem, choice in zip(problems, choices, strict=True):
        best = best_covered(problem)
        lost.append((best - covered(problem, choice)) / best)
    worse = sum(share > SUM_TOLERANCE for share in lost)
    return SpanCheck(what, method, decades, Share(worse, len(lost)), max(lost))


def _by_program(problem: PlacementProblem, solver: str) -> Integer:
    """Return the choice of the integer program without the other methods of the solver."""
    instance, _ = make_instance(problem)
    outcome = finish(reaching(instance, 0.0).maximise_coverage(solver, Clock(10.0)))
    return np.zeros(0, dtype=np.int64) if outcome.chosen is None else instance.original[outcome.chosen]


def _check_ties(by: float, instances: int, random: np.random.Generator) -> TieCheck:
    changed, lost = 0, 0.0
    for _ in range(instances):
        problem = _random_problem(random)
        plain, other = finish(solve(problem)), finish(solve(_uneven(problem, by, random)))
        changed += set(plain.chosen.tolist()) != set(other.chosen.tolist())
        lost = max(lost, 1 - covered(problem, other.chosen) / plain.covered)
    return TieCheck(by, Share(changed, instances), lost)


def _uneven(problem: PlacementProblem, by: float, random: np.random.Generator) -> PlacementProblem:
    """Return a problem with weights perturbed by up to a relative amount."""
    return replace(problem, weights=problem.weights * (1 + by * random.uniform(-1, 1, len(problem.weights))))


def _check_greedy(count: int) -> GreedyCheck:
    problem = worst_for_greedy(count)
    whole = math.fsum(problem.weights)
    exact: Placement = finish(solve(problem, SolverLimits(time_limit=20.0)))
    return GreedyCheck(
        count=count,
        greedy=solve_greedy(problem).covered / whole,
        best=exact.covered / whole,
        least=1 - (1 - 1 / count) ** count,
        proven=exact.status == "optimal",
    )


def _check_time(name: str, problem: PlacementProblem, limit: float) -> TimeCheck:
    found: Placement = finish(solve(problem, SolverLimits(time_limit=limit)))
    return TimeCheck(name, limit, found.seconds, found.gap, found.status == "optimal")


def solver_rows(study: SolverStudy) -> list[Row]:
    """Return the rows on the limits of solvers."""
    rows = []
    methods = dict.fromkeys((check.what, check.method) for check in study.spans)
    for what, method in methods:
        own = [check for check in study.spans if (check.what, check.method) == (what, method)]
        worst = next((check for check in own if check.worse.count), None)
        trials = own[0].worse.trials
        rows.append(
            Row(
                method={"solve": "exact solver"}.get(method, f"integer program, {method}"),
                regime=f"{what} over many powers of ten",
                begins=f"no loss up to 1e{own[-1].decades}"
                if worst is None
                else f"at 1e{worst.decades}: {worst.worse.value:.0%} of solutions lose, at most {worst.lost:.1g}",
                how=f"{trials} random instances for each span, compared with exhaustive search",
                answer=f"differences below {TIE_TOLERANCE:g} of the "
                f"{'total' if what == 'weights' else 'largest price'} are ignored; a note if that leaves "
                "something without effect",
            )
        )
    free = max((check.by for check in study.ties if check.changed.count == 0), default=0.0)
    rows.append(
        Row(
            method="exact solver",
            regime="near-ties",
            begins=f"choice unchanged by perturbations up to {free:g} of the weights; with larger ones, a changed "
            f"choice loses at most {max(check.lost for check in study.ties):.1g} of the optimum",
            how=f"{study.ties[0].changed.trials} random instances with many ties, one perturbation each",
            answer=f"breaks ties within {TIE_TOLERANCE:g} by number, price, double coverage and order",
        )
    )
    last = study.greedy[-1]
    rows.append(
        Row(
            method="greedy",
            regime="its worst case",
            begins=f"covers {last.greedy:.1%} with {last.count} sensors, {last.best:.1%} is possible; "
            f"its guarantee is {last.least:.1%}",
            how="the worst-case instance of the guarantee, 2 to 10 sensors",
            answer="never the only method: swaps, branch and bound and the certificate follow",
        )
    )
    open_ones = [check for check in study.times if not check.proven]
    rows.append(
        Row(
            method="exact solver",
            regime=f"symmetry, {study.times[0].limit:g} s of time",
            begins=f"{open_ones[0].name}: gap {open_ones[0].gap:.1%}" if open_ones else "all proven",
            how=f"{len(study.times)} projective planes; at most {max(c.seconds for c in study.times):.2f} s taken",
            answer="returns the best placement found with its bound, and reports that the time limit was reached",
        )
    )
    return rows
