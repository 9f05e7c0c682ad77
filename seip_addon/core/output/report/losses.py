"""Coverage after the failure of a sensor, and with fewer or more sensors."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Boolean, Integer
from ...choosing.placement.cheapest import SAME_PRICE
from ...choosing.placement.objective import CHOSEN_FOR, MOVED
from ...choosing.placement.problem import TIE_TOLERANCE, Placement, PlacementConstraints, PlacementProblem, assess
from ...choosing.placement.search_limits import SolverLimits
from ...choosing.placement.solver import solve
from ...errors import SeipError
from ...progress import Progress
from .evidence import Evidence

MORE = 2  # sensors beyond those that were placed, up to which the front goes


@dataclass(frozen=True)
class Failures:
    """Share of the targets that is still seen when each sensor fails.

    Parameters
    ----------
    left : tuple of float
        In the order of the sensors.
    """

    left: tuple[float, ...]

    @property
    def worst(self) -> float:
        """Coverage after the worst failure."""
        return min(self.left)

    @property
    def mean(self) -> float:
        """Mean coverage over the failures of each sensor."""
        return sum(self.left) / len(self.left)


@dataclass(frozen=True)
class FrontPoint:
    """The best placement found with at most ``count`` sensors.

    Parameters
    ----------
    coverage : float
        Share of the weight that it covers.
    price : float, dollars
    missed : float
        Largest share of the weight that another placement could cover in addition; 0 where this one is proven optimal.
    """

    count: int
    coverage: float
    price: float
    missed: float


def failures(seen: Boolean) -> Failures | None:
    """Return what is left when a sensor fails, None where there is none.

    Parameters
    ----------
    seen : (k, t) bool
        What each sensor sees.
    """
    if not len(seen):
        return None
    times = seen.sum(axis=0)
    return Failures(tuple(float(np.count_nonzero(times - row > 0)) / seen.shape[1] for row in seen))


def front(evidence: Evidence, effort: float) -> Generator[Progress, None, tuple[FrontPoint, ...]]:
    """Find the best placements of one sensor, two and so on, up to two more than were placed.

    Weights and rules are those of the placement, without a budget. Numbers of sensors that the placement's certificate
    holds for have its coverage and its bound; searches for other numbers start from it, and their bounds are held to
    the certificate, so that each number has one bound, and more sensors never have the smaller one.

    Parameters
    ----------
    effort : float, units of counted work
        For each number; none at all where it is 0.

    Returns
    -------
    tuple of FrontPoint
        Without numbers of sensors that the rules do not allow; empty where the grid is not at hand.
    """
    if evidence.grid is None or effort <= 0:
        return ()
    problem = evidence.site.with_visibility(evidence.grid)
    whole = math.fsum(problem.weights)
    most = min(len(evidence.sensors) + MORE, len(np.unique(problem.positions[problem.allowed])))
    limits = SolverLimits("auto", math.inf, effort)
    poses = np.array([one.pose for one in evidence.sensors if one.pose is not None], dtype=np.int64)
    known, caps = _recorded(evidence, problem, poses), _proven_limits(evidence, problem, whole)
    found: dict[int, Placement] = {}
    for count in range(1, most + 1):
        yield Progress(count - 1, most, "solving for fewer and more sensors", counted=False)
        try:
            limited = replace(problem, count=count, budget=None)
            found[count] = known.get(count) or (yield from solve(limited, limits, poses))
        except SeipError:  # fewer than the rules demand
            continue
    return tuple(_point(count, found, known, caps, whole) for count in found)


def equal_prices(problem: PlacementConstraints) -> bool:
    """Return whether all sensors cost the same, so that a price is a number of sensors."""
    prices = problem.prices[problem.allowed]
    return bool(len(prices) and np.ptp(prices) == 0)


def _recorded(evidence: Evidence, problem: PlacementProblem, poses: Integer) -> dict[int, Placement]:
    """Return the recorded placement for each number of sensors whose best coverage its certificate bounds."""
    record, goal = evidence.record, evidence.record.request.goal
    objective = record.objective
    if not _is_certified(evidence) or len(poses) < len(evidence.sensors):
        return {}
    if objective.cheapest:  # of equal prices: those of the lowest price are those of the fewest sensors
        if not equal_prices(problem) or any(note.startswith(SAME_PRICE) for note in record.notes):
            return {}
        bound, optimal, numbers = problem.covered(poses), True, range(len(poses), len(poses) + 1)
    else:
        bound, optimal = objective.bound or 0.0, objective.status == "optimal"
        numbers = range(len(poses), _most_allowed(evidence, problem, max(len(poses), goal.count or 0)) + 1)
    placement = assess(problem, poses, bound, optimal=optimal, solver=objective.solver, seconds=0.0)
    return dict.fromkeys(numbers, placement)


def _proven_limits(evidence: Evidence, problem: PlacementProblem, whole: float) -> dict[int, float]:
    """Return, for numbers of sensors, the weight that the record proves no such number to exceed."""
    record, goal = evidence.record, evidence.record.request.goal
    bound = record.objective.bound
    if not _is_certified(evidence) or bound is None:
        return {}
    most = goal.count or len(evidence.sensors) + MORE
    if not record.objective.cheapest:
        return dict.fromkeys(range(1, _most_allowed(evidence, problem, most) + 1), bound)
    dearest = float(problem.prices[problem.allowed].max())
    too_few = (number for number in range(1, most + 1) if number * dearest < bound * (1 - TIE_TOLERANCE))
    return dict.fromkeys(too_few, (goal.coverage or 1.0) * whole)  # what costs less does not reach the coverage


def _is_certified(evidence: Evidence) -> bool:
    """Return whether the record's bound is on nominal coverage, or on the price of it."""
    record = evidence.record
    by_hand = record.objective.bound is None or record.objective.status == MOVED
    return not (by_hand or any(note.startswith(CHOSEN_FOR) for note in record.notes))


def _most_allowed(evidence: Evidence, problem: PlacementProblem, most: int) -> int:
    """Return the largest number of sensors, up to ``most``, of which the budget allows any choice."""
    budget = evidence.record.request.goal.budget
    if budget is None:
        return most
    dearest = float(problem.prices[problem.allowed].max())
    return most if dearest == 0 else min(most, math.floor(budget * (1 + TIE_TOLERANCE) / dearest))


def _point(
    count: int, found: dict[int, Placement], known: dict[int, Placement], caps: dict[int, float], whole: float
) -> FrontPoint:
    """Return the best placement of at most ``count`` sensors, and what the bounds of all numbers leave open."""
    best = max((one for number, one in found.items() if number <= count), key=lambda one: one.covered)
    # a bound for more sensors holds for fewer, and the recorded one is never undercut by those for more
    bounds = [*((number, one.bound) for number, one in found.items()), *caps.items()]
    bound = min(bound for number, bound in bounds if number >= count)
    bound = max([bound, *(one.bound for number, one in known.items() if number <= count)])
    return FrontPoint(count, best.covered / whole, best.price, max(0.0, bound - best.covered) / whole)
