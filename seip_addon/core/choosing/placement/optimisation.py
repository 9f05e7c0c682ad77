"""Optimisation of nominal coverage on a site: the most coverage, or the least price for a coverage."""

from collections.abc import Generator, Mapping

import numpy as np
from numpy.typing import NDArray

from ...progress import Progress
from ...sensing.lidar.model import LidarModel
from ...site.site import Site
from .cheapest import cheapest_for_coverage
from .deployment import deploy
from .objective import Objective, Solution, placement_problem, with_count
from .search_limits import DEFAULT_LIMITS, SolverLimits
from .solver import solve, solve_greedy


def optimise(
    site: Site,
    visible: NDArray[np.bool_],
    models: Mapping[str, LidarModel],
    objective: Objective,
    limits: SolverLimits = DEFAULT_LIMITS,
) -> Generator[Progress, None, Solution]:
    """Optimise a placement on a site: the most coverage, or the least price for a coverage.

    Parameters
    ----------
    visible : (c, t) bool

    Raises
    ------
    SeipError
        Same as for `placement_problem`, `solve` and `cheapest_for_coverage`.
    """
    problem = placement_problem(site, visible, models, objective)
    if objective.coverage is not None:
        placement = yield from cheapest_for_coverage(problem, objective.coverage, limits)
        greedy = None
    else:
        placement = yield from solve(problem, limits)
        greedy = solve_greedy(problem)
    deployment = deploy(site, models, visible[placement.chosen], placement.chosen)
    return Solution(with_count(objective, site), placement, greedy, deployment)
