r"""Allocation of a budget to sites: the multiple-choice knapsack problem, solved through PuLP.

.. math::
    \max \sum_s w_s \sum_k v_{sk} x_{sk} \quad\text{subject to}\quad
    \sum_k x_{sk} = 1 \;\forall s, \quad \sum_s \sum_k p_{sk} x_{sk} \le C, \quad x_{sk} \in \{0, 1\},

with the weight w of each site, and the price p and value v of each of its alternatives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pulp

from ...base.arrays import Float
from ...base.errors import SeipError
from ..placement.integer_program import solver_name
from ..placement.problem import TIE_TOLERANCE
from .frontier import Options

_SCALE = 1e4  # of prices and values in the program: far above the solvers' absolute tolerances of 1e-6
_NO_SHARE = 1e-6  # of an alternative in a relaxation: the solvers' own tolerance


@dataclass(frozen=True)
class Allocation:
    """Alternative of each site, as an index into its options, with total price and weighted value."""

    taken: tuple[int, ...]
    price: float
    value: float


@dataclass(frozen=True)
class RelaxedAllocation:
    """Allocation that may mix alternatives of a site; in an optimal one at most one site has such a mixture.

    Parameters
    ----------
    taken : tuple of tuple of int
        Alternatives of each site that have a share, as indices into its options, by price.
    value : float
        Weighted value, which no allocation exceeds.
    """

    taken: tuple[tuple[int, ...], ...]
    value: float


def allocate(options: Sequence[Options], weights: Float, budget: float) -> Allocation:
    """Return the allocation of largest weighted value within a budget, the cheapest of those.

    Parameters
    ----------
    options : sequence of Options
        Alternatives of each site, one of which costs nothing.
    weights : (s,) float64
        Importance of each site.
    budget : float, dollars

    Raises
    ------
    SeipError
        The solver stopped with an error.
    """
    program = _Program(options, weights, budget)
    best = program.solve(program.value, pulp.LpMaximize)
    # Money that adds nothing is not spent: of all allocations of that value the cheapest one.
    program.model += program.value >= best.value * program.value_scale * (1 - TIE_TOLERANCE)
    cheapest = program.solve(program.price, pulp.LpMinimize)
    return best if cheapest.value < best.value * (1 - 2 * TIE_TOLERANCE) else cheapest


def relaxed_allocation(options: Sequence[Options], weights: Float, budget: float) -> RelaxedAllocation:
    """Return the optimum of the linear relaxation.

    Alternatives that the budget cannot pay are left out. The cheapest alternatives with a share are an allocation
    within the budget.

    Parameters
    ----------
    options, weights, budget
        As for `allocate`.

    Raises
    ------
    SeipError
        The solver stopped with an error.
    """
    affordable = [np.flatnonzero(each.prices <= budget * (1 + TIE_TOLERANCE)) for each in options]
    options = [Options(each.prices[own], each.values[own], own) for each, own in zip(options, affordable, strict=True)]
    program = _Program(options, weights, budget)
    shares = program.shares(program.value, pulp.LpMaximize, whole=False)
    taken = tuple(
        tuple(
            int(each.index[one]) for one in np.argsort(each.prices, kind="stable").tolist() if of_site[one] > _NO_SHARE
        )
        for of_site, each in zip(shares, options, strict=True)
    )
    value = math.fsum(
        weight * share * each.values[one]
        for of_site, each, weight in zip(shares, options, weights, strict=True)
        for one, share in enumerate(of_site)
    )
    return RelaxedAllocation(taken, value)


def allocation_of(options: Sequence[Options], weights: Float, taken: Sequence[int]) -> Allocation:
    """Return the allocation that takes given alternatives."""
    chosen = list(zip(options, weights, taken, strict=True))
    return Allocation(
        tuple(taken),
        math.fsum(each.prices[one] for each, _, one in chosen),
        math.fsum(weight * each.values[one] for each, weight, one in chosen),
    )


class _Program:
    """The integer program of an allocation."""

    def __init__(self, options: Sequence[Options], weights: Float, budget: float) -> None:
        self._options, self._weights = options, weights
        self.model = pulp.LpProblem("allocation", pulp.LpMaximize)
        most = math.fsum(weight * each.values.max() for each, weight in zip(options, weights, strict=True))
        self.value_scale = _SCALE / most if most > 0 else 1.0
        price_scale = _SCALE / budget if budget > 0 else 1.0
        self._x = [
            [self.model.add_variable(f"x{site}_{one}", cat=pulp.LpBinary) for one in range(len(each.prices))]
            for site, each in enumerate(options)
        ]
        pairs = [
            (x, weight * value * self.value_scale, price * price_scale)
            for of_site, each, weight in zip(self._x, options, weights, strict=True)
            for x, value, price in zip(of_site, each.values.tolist(), each.prices.tolist(), strict=True)
        ]
        self.value = pulp.LpAffineExpression([(x, float(value)) for x, value, _ in pairs])
        self.price = pulp.LpAffineExpression([(x, float(price)) for x, _, price in pairs])
        for of_site in self._x:
            self.model += pulp.lpSum(of_site) == 1
        self.model += self.price <= budget * price_scale * (1 + TIE_TOLERANCE)

    def solve(self, objective: pulp.LpAffineExpression, sense: int) -> Allocation:
        """Return the best allocation for an objective."""
        shares = self.shares(objective, sense)
        return allocation_of(self._options, self._weights, tuple(one.index(max(one)) for one in shares))

    def shares(self, objective: pulp.LpAffineExpression, sense: int, *, whole: bool = True) -> list[list[float]]:
        """Return the share of each alternative of each site in the optimum.

        Parameters
        ----------
        whole : bool
            Whether each share is 0 or 1; otherwise the linear relaxation is solved.
        """
        self.model.sense = sense
        self.model.setObjective(objective)
        engine = (
            pulp.HiGHS(msg=False, mip=whole, gapRel=0.0, threads=1, mip_abs_gap=1e-7)
            if solver_name("auto") == "highs"
            else pulp.PULP_CBC_CMD(msg=False, mip=whole, gapRel=0.0, threads=1)
        )
        try:
            self.model.solve(engine)
        except (pulp.PulpSolverError, OSError) as error:
            raise SeipError(f"the solver stopped with an error ({error}); choose another solver") from error
        if self.model.sol_status != pulp.LpSolutionOptimal:
            raise SeipError(
                f"the solver ended without an allocation ({pulp.LpSolution[self.model.sol_status]}): run it again"
            )
        return [[x.value() or 0.0 for x in of_site] for of_site in self._x]
