"""The near-optimal set: all placements whose coverage is within a share of the best."""

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Float, Integer
from ...counts import counted
from ...errors import SeipError
from ...progress import Progress
from .branch_and_bound import Search, is_worthwhile
from .problem import PlacementProblem
from .reduced_problem import Instance, make_instance
from .search_limits import Clock

MAX_LISTED = 10_000  # largest number of placements in the list
MAX_BRANCHES = 300  # largest number of branches: the result depends on no clock


@dataclass(frozen=True, eq=False)
class NearOptimalSet:
    """The placements near the best.

    Parameters
    ----------
    share : float
        Largest loss of coverage against the best placement, as a share of its coverage.
    placements : (n, k) int64
        Poses of each placement in the problem's numbering, ascending; rows of fewer sensors end with -1.
    covered : (n,) float64
        Weight that each placement covers.
    complete : bool
        Whether the list has all such placements, apart from poses that another one at the same position dominates.
        Otherwise it has those of the first branches of the search, and those that differ from the best in one sensor.
    in_common : (k + 1,) int64
        Number of placements that have 0, 1, … k positions in common with the best one.
    positions : int
        Number of different positions in these placements.
    """

    share: float
    placements: Integer
    covered: Float
    complete: bool
    in_common: Integer
    positions: int

    def __len__(self) -> int:
        return len(self.placements)

    @property
    def message(self) -> str:
        """Number and variety of the placements, as a message."""
        near = f"within {self.share:.0%} of the best"
        if self.complete and len(self) == 1:
            return f"no other placement covers {near}"
        if len(self) == 1:
            return f"whether other placements cover {near} is not known"
        least = "" if self.complete else "at least "
        fewest, sensors = int(np.flatnonzero(self.in_common)[0]), len(self.in_common) - 1
        own = counted(sensors, "position")
        shared = f"all share its {own}"
        if fewest < sensors:
            shared = f"some share only {fewest} of its {own}" if fewest else f"some share none of its {own}"
        return f"{least}{len(self):,} placements cover {near}; they use {self.positions:,} positions, {shared}"


def near_optimal_set(
    problem: PlacementProblem, chosen: Integer, share: float = 0.01
) -> Generator[Progress, None, NearOptimalSet | None]:
    """List the placements that cover within a share of an optimal one.

    Parameters
    ----------
    problem : PlacementProblem
        Problem of largest coverage.
    chosen : (k,) int64
        Optimal placement of the problem.
    share : float
        Largest loss of coverage, as a share: at least 0 and below 1.

    Returns
    -------
    NearOptimalSet or None
        The set, or None if there are too many sensors or candidates to search.

    Raises
    ------
    SeipError
        The share is out of its limits.
    """
    if not 0 <= share < 1:
        raise SeipError(f"the share below the best must be at least 0 and below 1, not {share:g}")
    instance, factor = make_instance(problem)
    if not is_worthwhile(instance, np.arange(len(instance))):
        return None
    best = problem.covered(chosen) * factor
    search = _NearOptimal(instance, (1 - share) * best)
    finished = yield from search.run(Clock(math.inf), math.inf, MAX_BRANCHES)
    if not finished:
        search.take_swaps(np.flatnonzero(np.isin(instance.original, chosen)))
    rows = _in_rows([np.sort(instance.original[list(found)]) for found in search.found], len(chosen))
    used = np.append(problem.positions, -1)[rows]
    in_common = np.isin(used, problem.positions[chosen]).sum(axis=1)
    return NearOptimalSet(
        share=share,
        placements=rows,
        covered=np.array(list(search.found.values())) / factor,
        complete=finished and not search.satisfied,
        in_common=np.bincount(in_common, minlength=len(chosen) + 1),
        positions=len(np.unique(used[used >= 0])),
    )


class _NearOptimal(Search):
    """Search that lists every placement that reaches the goal."""

    def __init__(self, instance: Instance, goal: float) -> None:
        super().__init__(instance, goal, depth_first=True)
        self.found: dict[tuple[int, ...], float] = {}

    def take_swaps(self, chosen: Integer) -> None:
        """Record a placement, and those that differ from it in one candidate."""
        self.offer(chosen)
        for kept in (np.delete(chosen, number) for number in range(len(chosen))):
            increments = self.instance.increments(self.instance.times(kept))
            values = self.instance.value(kept) + self.instance.gains(increments)
            for other in np.setdiff1d(np.flatnonzero(values >= self.goal), kept):
                self.offer(np.append(kept, other))

    def _take(self, placement: Integer) -> float:
        key, value = tuple(placement.tolist()), self.instance.value(placement)
        if value >= self.goal and key not in self.found and self.instance.feasible(placement):
            if len(self.found) == MAX_LISTED:
                self.satisfied = True
            else:
                self.found[key] = value
        return self.goal


def _in_rows(placements: Sequence[Integer], least: int) -> Integer:
    """Return placements as rows of one length, filled up with -1."""
    rows = np.full((len(placements), max([least, *map(len, placements)])), -1, dtype=np.int64)
    for row, placement in zip(rows, placements, strict=True):
        row[: len(placement)] = placement
    return rows
