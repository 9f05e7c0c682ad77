"""An early answer: a placement on a few candidate poses, while the grids of all of them are still to be computed."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from ..base.arrays import Integer
from ..base.errors import SeipError
from ..base.progress import Progress, altered
from ..choosing.placement.objective import Objective, criterion_of, placement_constraints, placement_problem
from ..choosing.placement.problem import Placement
from ..choosing.placement.search_limits import SolverLimits
from ..choosing.placement.solver import solve
from ..sensing.returns.returns_grid import compute_returns
from ..sensing.returns.road_users import road_users
from ..sensing.visibility.grid import compute_visibility, read_visibility
from .returns import SurveyReturns
from .survey import Layout

Result = TypeVar("Result")

EARLY = "early answer"
EARLY_POSES = 64  # about a tenth of the poses of a junction, and a few seconds of work
EARLY_EFFORT = 0.5  # units of work of the search among them
GOLDEN_RATIO = (math.sqrt(5.0) - 1.0) / 2.0


def early_answer(
    layout: Layout, objective: Objective, grid_file: Path, threads: int | None = None
) -> Generator[Progress, None, Progress]:
    """Return a good placement on a few poses, as the progress of a search: its value and its poses.

    Its sensors can be mounted, and its value is exact, but it is chosen from `EARLY_POSES` poses only. The search for
    the placement neither uses it nor depends on it.

    Parameters
    ----------
    grid_file : path
        File of the visibility grid. If it is that of the layout, the search begins at once, and there is no early
        answer.
    threads : int, optional
        Maximum number of threads.

    Returns
    -------
    Progress
        Without a value if there is no early answer: also for a coverage or a risk measure to be met, and if these poses
        do not allow what the objective demands.
    """
    none, settings = Progress(0, 0, EARLY), layout.settings
    if objective.cheapest or objective.measure is not None:
        return none
    if read_visibility(grid_file, layout.site, layout.models, settings.visibility, settings.engine) is not None:
        return none
    poses = few_poses(layout, objective)
    few = replace(layout, site=replace(layout.site, candidates=layout.site.candidates.only(poses)))
    try:
        # without the gap, which is that of the few poses
        steps = altered(_best(few, objective, threads), lambda step: replace(step, what=EARLY, gap=None))
        value, placement = yield from steps
    except SeipError:  # the search on all poses says why, if they do not allow it either
        return none
    return replace(none, best=value, poses=tuple(poses[placement.chosen].tolist()))


def _best(few: Layout, objective: Objective, threads: int | None) -> Generator[Progress, None, tuple[str, Placement]]:
    """Return the best placement found on all poses of a layout, after its value."""
    settings, limits = few.settings, SolverLimits(effort=EARLY_EFFORT)
    if criterion_of(objective, few.models) == "returns":
        users = road_users(few.geometry)
        grid = yield from compute_returns(few.site, users, few.models, settings.engine, threads)
        returns = SurveyReturns(few, objective, users, grid)
        placement = yield from solve(returns.problem(), limits)
        return returns.describe(placement.chosen, placement.objective), placement
    seen = yield from compute_visibility(few.site, few.models, settings.visibility, settings.engine, threads=threads)
    problem = placement_problem(few.site, seen.visible, few.models, objective)
    placement = yield from solve(problem, limits)
    return problem.describe_road(placement.chosen, placement.objective), placement


def few_poses(layout: Layout, objective: Objective) -> Integer:
    """Return poses for an early answer, (k,) int64: some spread evenly, and all at required positions.

    Multiples of the golden ratio, modulo 1, are spread evenly over the poses in their order, and do not favour a height
    or a type, as every eighth pose would.
    """
    count = len(layout.site.candidates)
    spread = np.unique((np.arange(EARLY_POSES) * GOLDEN_RATIO % 1.0 * count).astype(np.int64))
    groups = placement_constraints(layout.site, layout.models, objective).mandatory
    return spread if groups is None else np.union1d(spread, np.flatnonzero(groups.any(axis=0)))


def after_early_answer(early: Progress, steps: Generator[Progress, None, Result]) -> Generator[Progress, None, Result]:
    """Run work, and report an early answer until the work itself has a best value."""
    found = False

    def alter(step: Progress) -> Progress:
        nonlocal found
        found = found or bool(step.best)
        return step if found else replace(step, best=early.best, poses=early.poses)

    return altered(steps, alter)
