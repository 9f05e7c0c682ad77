"""Placement problem of one site of a network, which is solved for many budgets, and its file."""

from __future__ import annotations

import math
import os
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Boolean, Float, Integer, Text
from ...base.errors import SeipError
from ...base.progress import Progress
from ...storage.array_file import ArrayFile
from ..placement.concave import COVERAGE, LOG_RETURNS
from ..placement.problem import PlacementProblem
from ..placement.search_limits import SolverLimits
from ..placement.solver import solve
from .frontier import Frontier, SolvedBudget, possible_amounts

FILE = ArrayFile(
    "seip.site-problem",
    1,
    "placement problem of a site",
    "delete it and compute it again",
    {
        "packed": "u1",
        "returns": "f4",
        "user_weights": "f8",
        "prices": "f8",
        "positions": "i8",
        "xyz": "f8",
        "heights": "f8",
        "latlon": "f8",
        "labels": "U",
        "names": "U",
    },
)


@dataclass(frozen=True, eq=False)
class SiteProblem:
    """Placement problem of a site for any budget, with what results state about its poses.

    Parameters
    ----------
    criterion : {"road", "returns"}
        Criterion that is maximised: the share of the targets seen, or the mean of ln(1 + expected returns).
    visible : (c, t) bool
        Whether pose i sees target j.
    returns : (c, m) float32
        Expected returns of each pose from each road user; m is 0 for the criterion ``road``.
    user_weights : (m,) float64
        Importance of each road user.
    prices : (c,) float64, dollars
    positions : (c,) int64
        Position of each pose.
    xyz : (c, 3) float64, metres
        Optical centre of each pose, local site axes.
    heights : (c,) float64, metres
        Height of each sensor above the ground.
    latlon : (c, 2) float64, degrees
        Latitude and longitude of each pose.
    labels, names : (c,) str
        Sensor type, and name of the position of each pose.
    most_sensors : int
        Largest number of sensors at the site.
    """

    criterion: Literal["road", "returns"]
    visible: Boolean
    returns: NDArray[np.float32]
    user_weights: Float
    prices: Float
    positions: Integer
    xyz: Float
    heights: Float
    latlon: Float
    labels: Text
    names: Text
    most_sensors: int

    def value(self, chosen: Sequence[int]) -> float:
        """Return the value of the criterion for chosen poses."""
        if not len(chosen):
            return 0.0
        rows = np.asarray(chosen, dtype=np.int64)
        if self.criterion == "road":
            return self.coverage(chosen)
        together = self.returns[rows].sum(axis=0, dtype=np.float64)
        return float(np.average(np.log1p(together), weights=self.user_weights))

    def coverage(self, chosen: Sequence[int]) -> float:
        """Return the share of the targets that chosen poses see, 0 to 1."""
        return float(self.visible[np.asarray(chosen, dtype=np.int64)].any(axis=0).mean()) if len(chosen) else 0.0

    def frontier(self, budget: float) -> Frontier:
        """Return the frontier of the site before anything is solved.

        Parameters
        ----------
        budget : float, dollars
            Largest amount of money.
        """
        amounts, ends = possible_amounts(self.prices, self.positions, self.most_sensors, budget)
        return Frontier(amounts, ends, self.value(range(len(self.prices))))

    def solve(self, budget: float, effort: float) -> Generator[Progress, None, SolvedBudget]:
        """Find the best placement within a budget.

        Parameters
        ----------
        budget : float, dollars
        effort : float, units of counted work
            Limit of the search.
        """
        problem = self._problem(budget)
        placement = yield from solve(problem, SolverLimits(effort=effort))
        chosen = tuple(placement.chosen.tolist())
        value = self.value(chosen)
        price = math.fsum(self.prices[list(chosen)])
        # A search that ends early may have no bound of its own; all poses together are one.
        most = self.value(range(len(self.prices)))
        bound = min(placement.bound / math.fsum(problem.weights), most)
        bound = value if placement.status == "optimal" else max(value, bound)
        return SolvedBudget(budget, chosen, price, value, bound, effort)

    def _problem(self, budget: float) -> PlacementProblem:
        """Return the problem of a budget."""
        poses = len(self.prices)
        of_returns = self.criterion == "returns"
        return PlacementProblem(
            amounts=self.returns if of_returns else self.visible,
            g=LOG_RETURNS if of_returns else COVERAGE,
            weights=self.user_weights if of_returns else np.ones(self.visible.shape[1]),
            prices=self.prices,
            positions=self.positions,
            xyz=self.xyz,
            labels=self.labels,
            mandatory=np.zeros((0, poses), dtype=bool),
            forbidden=np.zeros(poses, dtype=bool),
            count=min(self.most_sensors, len(np.unique(self.positions))),
            budget=budget,
        )

    def save(self, path: str | os.PathLike[str], header: dict[str, Any]) -> None:
        """Write the problem with further entries of a header as npz."""
        arrays = {name: getattr(self, name) for name in FILE.arrays if name != "packed"}
        FILE.save(
            path,
            {**header, "criterion": self.criterion, "targets": self.visible.shape[1], "most": self.most_sensors},
            {**arrays, "packed": np.packbits(self.visible, axis=1)},
        )

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> tuple[SiteProblem, dict[str, Any]]:
        """Read a problem and the header that `save` wrote.

        Raises
        ------
        SeipError
            The file is missing, damaged or not such a problem.
        """
        with FILE.reading(path) as (header, arrays):
            visible = np.unpackbits(arrays.pop("packed"), axis=1, count=int(header["targets"])).astype(bool)
            problem = cls(criterion=header["criterion"], visible=visible, most_sensors=int(header["most"]), **arrays)
            return problem, header


def check_problem(problem: SiteProblem) -> None:
    """Raise SeipError if a sensor costs nothing, or no pose adds anything to the value of a site."""
    if not problem.prices.all():
        raise SeipError(
            f"{problem.labels[problem.prices == 0][0]} costs nothing, so that no budget limits its number: give its "
            "model a price"
        )
    if problem.frontier(math.inf).ceiling <= 0.0:
        raise SeipError("no candidate sees anything here: try other heights or sensor types, or remove obstacles")
