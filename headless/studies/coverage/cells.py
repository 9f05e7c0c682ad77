"""The cells of the study: the best placement for each type, height, number and central weight."""

from collections.abc import Generator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress, within
from seip_addon.core.choosing.placement.deployment import Deployment, deploy
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.problem import Placement
from seip_addon.core.choosing.placement.search_limits import DEFAULT_LIMITS, SolverLimits
from seip_addon.core.choosing.placement.solver import solve, solve_greedy
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.site.site import Site

COUNTS = (1, 2, 4)
CENTRAL_WEIGHTS = (2.0, 4.0, 8.0, 16.0)
CHARTED_WEIGHT = CENTRAL_WEIGHTS[1]  # central weight of the plans drawn next to the vanilla ones
Span = tuple[float, float]  # least and largest possible value of a figure that the solver may not have settled


@dataclass(frozen=True)
class Cell:
    """A cell of the study: type, height, number of sensors and central weight.

    Parameters
    ----------
    sensor : str
        Catalogue key of the only type allowed.
    height : float or None, metres
        Only height allowed; None for all heights.
    count : int
        N, the largest number of sensors.
    weight : float
        Weight of central targets; 1 is the vanilla problem.
    """

    sensor: str
    height: float | None
    count: int
    weight: float


@dataclass(frozen=True, eq=False)
class Case(Cell):
    """A solved cell.

    Parameters
    ----------
    placement, greedy : Placement
        Placement by the integer program and by the greedy algorithm.
    """

    placement: Placement
    greedy: Placement
    deployment: Deployment

    @property
    def span(self) -> Span:
        """Least and largest possible best objective; equal if the optimum is proven."""
        return self.placement.objective, max(self.placement.objective, self.placement.bound)


@dataclass(frozen=True)
class EmptyCell(Cell):
    """A cell that has no placement.

    Parameters
    ----------
    note : str
        Reason, as in the message for a single request of this placement.
    """

    note: str


@dataclass(frozen=True, eq=False)
class CoverageStudy:
    """All cells of the study on one site.

    Parameters
    ----------
    sensors : tuple of str
        Catalogue keys, from the simplest type to the best.
    cells : tuple of Case or EmptyCell
        All cells, in the order of their solution.
    targets : int
        Number of targets, the unit of vanilla objectives.
    """

    sensors: tuple[str, ...]
    heights: tuple[float, ...]
    cells: tuple[Case | EmptyCell, ...]
    targets: int

    @property
    def cases(self) -> tuple[Case, ...]:
        """The cells that have a placement."""
        return tuple(cell for cell in self.cells if isinstance(cell, Case))

    def find(self, sensor: str, count: int, height: float | None = None, weight: float = 1.0) -> Case | None:
        """Return one cell, or None if it has no placement."""
        key = (sensor, count, height, weight)
        return next((c for c in self.cases if (c.sensor, c.count, c.height, c.weight) == key), None)

    def possible(self, sensor: str, count: int, height: float | None = None) -> Span | None:
        """Return the least and largest possible best coverage of a vanilla cell, or None if it has no placement."""
        found = self.find(sensor, count, height)
        if found is None:
            return None
        low, high = found.span
        return low / self.targets, min(high / self.targets, 1.0)


def coverage_study(
    site: Site, models: Mapping[str, LidarModel], visible: NDArray[np.bool_], limits: SolverLimits = DEFAULT_LIMITS
) -> Generator[Progress, None, CoverageStudy]:
    """Solve every cell: each type, each single height and all heights, N = 1, 2, 4; then a sweep of central weights.

    A cell that has no placement (more sensors than positions, a type that sees
    nothing from one height) is recorded with the reason, and the study continues.

    Parameters
    ----------
    site : Site
        Site with poses of every type and height to be studied.
    visible : (c, t) bool

    Raises
    ------
    SeipError
        No cell has a placement; the message is the reason of the first cell.
    """
    sensors = tuple(dict.fromkeys(site.candidates.sensor.tolist()))
    heights = tuple(sorted(set(site.candidates.height.tolist())))
    plan = [Cell(s, h, n, 1.0) for s in sensors for h in (*heights, None) for n in COUNTS]
    if site.targets.central.any():
        plan += [Cell(s, None, n, w) for s in sensors for n in COUNTS for w in CENTRAL_WEIGHTS]
    cells: list[Case | EmptyCell] = []
    for done, cell in enumerate(plan):
        at = "any height" if cell.height is None else f"{cell.height:g} m"
        progress = Progress(done, len(plan), f"{cell.sensor}, {at}, N = {cell.count}, central weight {cell.weight:g}")
        yield progress
        try:
            steps = solve_cell(site, models, visible, cell, limits)
            cells.append((yield from within(progress, steps)))
        except SeipError as error:
            cells.append(EmptyCell(**vars(cell), note=str(error)))
    yield Progress(len(plan), len(plan), "all cells solved")
    if all(isinstance(cell, EmptyCell) for cell in cells):
        raise SeipError(next(cell.note for cell in cells if isinstance(cell, EmptyCell)))
    return CoverageStudy(sensors, heights, tuple(cells), len(site.targets))


def solve_cell(
    site: Site, models: Mapping[str, LidarModel], visible: NDArray[np.bool_], cell: Cell, limits: SolverLimits
) -> Generator[Progress, None, Case]:
    """Solve one cell; the arguments are those of `coverage_study`.

    Raises
    ------
    SeipError
        The cell has no placement.
    """
    allowed = site.candidates.sensor == cell.sensor
    if cell.height is not None:
        allowed &= site.candidates.height == cell.height
    objective = Objective(count=cell.count, central_weight=None if cell.weight == 1.0 else cell.weight)
    problem = replace(placement_problem(site, visible, models, objective), forbidden=~allowed)
    placement = yield from solve(problem, limits)
    deployment = deploy(site, models, visible[placement.chosen], placement.chosen)
    return Case(**vars(cell), placement=placement, greedy=solve_greedy(problem), deployment=deployment)
