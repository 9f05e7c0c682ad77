r"""Placement by concave values of expected returns as an integer program.

With :math:`R_{ij}` the expected returns of candidate i from road user j and g concave, the problem of
`returns_instance`,

.. math::
    \max_{x \in X} \sum_j w_j \, g\Big(\sum_i R_{ij} x_i\Big),

has g replaced by the minimum of lines :math:`a_k + b_k s`, tangents of g, that exceed it by at most ε:

.. math::
    \max \sum_j w_j v_j \quad\text{subject to}\quad
    s_j = \sum_i R_{ij} x_i, \quad
    v_j \le a_{jk} + b_{jk} s_j \;\; \forall k, \quad
    \sum_i x_i \le N, \quad \sum_i p_i x_i \le C, \quad x_i \in \{0, 1\},

with the further constraints of `PlacementProblem`. As tangents are nowhere below g, the largest value of the program is
an upper bound; as the weights add up to 1, it is at most ε above the best value of a placement. That is ε of
:math:`\ln(1 + s)`, or a share of :math:`e^ε - 1` of the geometric mean of 1 + s.

`ReturnsProgram.improve` closes what is left (outer approximation: Duran and Grossmann 1986). It requires more than the
best value known. The placement that a solver finds is evaluated exactly and excluded, and the tangents at its returns
are added. When the program has no solution any longer, no placement is better.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
import pulp

from ...arrays import Float, Integer
from ...progress import Progress
from .concave_value import ConcaveValue, LogReturns
from .integer_program import TOLERANCE, TOTAL_WEIGHT, PlacementProgram
from .problem import TIE_TOLERANCE
from .returns_instance import ReturnsInstance
from .search_limits import Clock

MAX_TIES = 10  # placements that a solver cannot tell from the best one, to be evaluated before that is taken for a tie
ERROR = 0.01
"""Largest error of the tangents that a program begins with, in ln(1 + s): 1 % of the geometric mean of 1 + s."""


def entries_of(instance: ReturnsInstance, error: float = ERROR) -> int:
    """Return about the number of a program's coefficients: returns, and two for each line of each road user."""
    most = float(instance.returns.sum(axis=0, dtype=np.float64).max())
    return int(
        np.count_nonzero(instance.returns) + 2 * len(instance.weight) * len(LogReturns().lines(most, error).slope)
    )


@dataclass(frozen=True, eq=False)
class ProgramProof:
    """The best placement that a program found or was given, and the bound on all.

    Parameters
    ----------
    chosen : (k,) int64
    value : float
        Its exact value.
    bound : float
        Upper bound on the value of any placement, within a solver's tolerances.
    optimal : bool
        Whether none is better by more than `TIE_TOLERANCE`. Among many ties this stays open, and the bound ends a few
        millionths above the value, which is as close as a solver's tolerances allow.
    """

    chosen: Integer
    value: float
    bound: float
    optimal: bool


class ReturnsProgram(PlacementProgram):
    """The integer program of a placement by expected returns.

    Parameters
    ----------
    instance : ReturnsInstance
    g : ConcaveValue
        Value of a road user by its returns.
    error : float
        ε, by which the tangents exceed g at most before any is added.
    """

    def __init__(self, instance: ReturnsInstance, g: ConcaveValue | None = None, error: float = ERROR) -> None:
        super().__init__(instance, np.count_nonzero(instance.returns))
        self.instance, self._g = instance, LogReturns() if g is None else g
        returns = instance.returns.astype(np.float64)
        ordered = np.sort(returns, axis=0)[::-1]
        most: Float = ordered[: instance.count].sum(axis=0)  # returns that each road user can have at most
        self._s = [self.model.add_variable(f"s{j}", 0, top) for j, top in enumerate(most.tolist())]
        self._v = [self.model.add_variable(f"v{j}", 0) for j in range(len(most))]
        lines = self._g.lines(float(most.max()), error)
        for v, s, column, top in zip(self._v, self._s, returns.T, most.tolist(), strict=True):
            seen = np.flatnonzero(column)
            self.model += s == self.number_among(seen, column[seen])
            own = lines.up_to(top)
            for intercept, slope in zip(own.intercept.tolist(), own.slope.tolist(), strict=True):
                self.model += v <= intercept + slope * s
        largest = float(instance.weight @ self._g(most))
        self.scale, self._margin = TOTAL_WEIGHT / largest, TOLERANCE * largest
        self.objective = pulp.LpAffineExpression(zip(self._v, (instance.weight * self.scale).tolist(), strict=True))

    def value(self, chosen: Integer) -> float:
        """Return the exact value of a choice."""
        return float(self.instance.weight @ self._g(self.instance.together(chosen)))

    def improve(self, chosen: Integer, solver: str, clock: Clock) -> Generator[Progress, None, ProgramProof]:
        """Find better placements than a given one until there is none, or the limits are reached.

        Parameters
        ----------
        chosen : (k,) int64
            A placement that the constraints allow.
        solver : str
            ``auto``, ``highs``, ``cbc`` or ``gurobi``.
        """
        value, bound, ties = self.value(chosen), np.inf, 0
        self._require(value)
        while bound > value + TIE_TOLERANCE:
            outcome = yield from self.maximise(self.objective, solver, clock)
            if outcome.chosen is None and outcome.finished:
                return ProgramProof(chosen, value, value, optimal=True)
            bound = min(bound, outcome.bound / self.scale + self._margin)
            ties += bound <= value + 3 * self._margin
            if outcome.chosen is None or ties > MAX_TIES:
                return ProgramProof(chosen, value, max(value, bound), optimal=False)
            self.exclude(outcome.chosen)
            self._add_tangents(outcome.chosen)
            found = self.value(outcome.chosen)
            if found > value + TIE_TOLERANCE:
                chosen, value = outcome.chosen, found
                self._require(value)
        return ProgramProof(chosen, value, value, optimal=True)

    def _require(self, value: float) -> None:
        """Require more than a value, lowered by what a solver may miss it by."""
        self.model += self.objective >= (value + TIE_TOLERANCE - self._margin) * self.scale

    def _add_tangents(self, chosen: Integer) -> None:
        """Add the tangents at the returns of a choice, where the program has its value exactly from then on."""
        for v, s, there in zip(self._v, self._s, self.instance.together(chosen).tolist(), strict=True):
            intercept, slope = self._g.tangent(there)
            self.model += v <= intercept + slope * s
