"""How flat the top is: all placements whose coverage comes near the best one's."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Float, Integer
from ..errors import SeipError
from ..progress import Progress
from .branch_and_bound import Search
from .clock import Clock
from .instance import Instance, make_instance
from .problem import PlacementProblem

MOST_LISTED = 200_000
"""Placements that are listed at most."""


@dataclass(frozen=True, eq=False)
class FlatTop:
    """The placements near the best.

    Parameters
    ----------
    share : float
        How much less than the best these may cover, as a share of it.
    placements : (n, k) int64
        Their poses in the problem's numbering, in ascending order; -1 where one has fewer sensors than another.
    covered : (n,) float64
        What each covers.
    complete : bool
        Whether these are all, but for poses that another at the same position outdoes; else there are more.
    in_common : (k + 1,) int64
        How many of them have 0, 1, … k positions in common with the best one.
    positions : int
        How many different positions they use.
    """

    share: float
    placements: Integer
    covered: Float
    complete: bool
    in_common: Integer
    positions: int

    def __len__(self) -> int:
        """Return how many were found."""
        return len(self.placements)

    @property
    def sentence(self) -> str:
        """How many there are, and how different."""
        many = f"{len(self):,}" if self.complete else f"more than {len(self):,}"
        fewest = int(np.flatnonzero(self.in_common)[0])
        return (
            f"{many} placements cover within {self.share:.0%} of the best; they use {self.positions} positions, "
            f"and some share only {fewest} of {len(self.in_common) - 1} with it"
        )


def near_best(
    problem: PlacementProblem, chosen: Integer, share: float = 0.01, time_limit: float = 60.0
) -> Generator[Progress, None, FlatTop]:
    """List the placements that cover within a share of an optimal one.

    Parameters
    ----------
    problem : PlacementProblem
        Of most coverage.
    chosen : (k,) int64
        Its optimal placement.
    share : float
        0 to 1.
    time_limit : float, seconds

    Yields
    ------
    Progress

    Returns
    -------
    FlatTop

    Raises
    ------
    SeipError
        The share is none.
    """
    if not 0 <= share < 1:
        raise SeipError(f"the share below the best must be at least 0 and below 1, not {share:g}")
    instance, factor = make_instance(problem)
    best = math.fsum(problem.weights[problem.visible[chosen].any(axis=0)]) * factor
    search = _NearBest(instance, (1 - share) * best)
    finished = yield from search.run(Clock(math.inf), time_limit)
    rows = _in_rows([np.sort(instance.original[list(found)]) for found in search.found], len(chosen))
    used = np.append(problem.positions, -1)[rows]
    in_common = np.isin(used, problem.positions[chosen]).sum(axis=1)
    return FlatTop(
        share=share,
        placements=rows,
        covered=np.array(search.values) / factor,
        complete=finished and not search.satisfied,
        in_common=np.bincount(in_common, minlength=len(chosen) + 1),
        positions=len(np.unique(used[used >= 0])),
    )


class _NearBest(Search):
    """Lists every placement that reaches the goal."""

    def __init__(self, instance: Instance, goal: float) -> None:
        super().__init__(instance, goal)
        self.found: list[tuple[int, ...]] = []
        self.values: list[float] = []

    def _take(self, chosen: tuple[int, ...], value: float) -> float:
        if self.instance.feasible(np.array(chosen)):
            if len(self.found) == MOST_LISTED:
                self.satisfied = True
            else:
                self.found.append(chosen)
                self.values.append(value)
        return self.goal

    def _is_hopeless(self, chosen: tuple[int, ...], followers: Integer) -> bool:  # noqa: ARG002 -- coverage is all
        return False


def _in_rows(placements: Sequence[Integer], least: int) -> Integer:
    """Return placements as rows of one length, filled up with -1."""
    rows = np.full((len(placements), max([least, *map(len, placements)])), -1, dtype=np.int64)
    for row, placement in zip(rows, placements, strict=True):
        row[: len(placement)] = placement
    return rows
