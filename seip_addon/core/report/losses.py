"""What a placement loses when a sensor fails, and what fewer or more sensors would see."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Boolean
from ..errors import SeipError
from ..placement import solve
from ..placement.search_limits import SolverLimits
from ..progress import Progress
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
        """What is left after the worst failure."""
        return min(self.left)

    @property
    def mean(self) -> float:
        """What is left on average, each sensor failing as often."""
        return sum(self.left) / len(self.left)


@dataclass(frozen=True)
class FrontPoint:
    """The best choice of at most so many sensors.

    Parameters
    ----------
    coverage : float
        Share of the weight that it covers.
    price : float, dollars
    missed : float
        Share of the weight that another choice could cover beyond that at most; 0 where it is proven the best.
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
    """Find the best choices of one sensor, two and so on, up to two more than were placed.

    Weights, rules and distances are those of the placement; no budget limits it.

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
    points = []
    for count in range(1, most + 1):
        yield Progress(count - 1, most, "solving for fewer and more sensors")
        try:
            best = yield from solve(replace(problem, count=count, budget=None), limits)
        except SeipError:  # fewer than the rules demand
            continue
        missed = 0.0 if best.status == "optimal" else max(0.0, best.bound - best.objective) / whole
        points.append(FrontPoint(count, best.covered / whole, best.price, missed))
    return tuple(points)
