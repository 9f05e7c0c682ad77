"""Frontier of a site: the best values of its criterion for amounts of money, as far as they are known."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from ...base.arrays import Float, Integer
from ..placement.problem import TIE_TOLERANCE

MOST_AMOUNTS = 400
"""Amounts of money that are told apart at a site at most; neighbouring ones are joined beyond that."""


@dataclass(frozen=True)
class SolvedBudget:
    """The best placement found within a budget at a site.

    Parameters
    ----------
    budget : float, dollars
    chosen : tuple of int
        Poses.
    price : float, dollars
    value : float
        Value of the criterion.
    bound : float
        No placement within the budget has a larger value.
    effort : float, units of counted work
        Limit of the search; see `SolverLimits`.
    """

    budget: float
    chosen: tuple[int, ...]
    price: float
    value: float
    bound: float
    effort: float


NOTHING = SolvedBudget(0.0, (), 0.0, 0.0, 0.0, math.inf)
"""Placement of no sensors, which costs nothing."""


@dataclass(frozen=True, eq=False)
class Options:
    """Alternatives of a site, of which exactly one is taken.

    Parameters
    ----------
    prices : (k,) float64, dollars
    values : (k,) float64
        Value of the criterion, or a bound on it.
    index : (k,) int64
        Number of each alternative where it comes from: a solved budget, or an amount.
    """

    prices: Float
    values: Float
    index: Integer


@dataclass(frozen=True, eq=False)
class Frontier:
    """Frontier of a site between what was found and what was proven.

    Parameters
    ----------
    amounts, ends : (k,) float64, dollars
        Amounts of money, rising from 0, as ranges that contain all possible prices of placements; see
        `possible_amounts`.
    ceiling : float
        Bound on the value for any money.
    solved : tuple of SolvedBudget
        Solved budgets, in the order in which they were solved.
    """

    amounts: Float
    ends: Float
    ceiling: float
    solved: tuple[SolvedBudget, ...] = ()

    def with_solved(self, *found: SolvedBudget) -> Frontier:
        """Return the frontier with further solved budgets."""
        return replace(self, solved=(*self.solved, *found))

    def bounds(self) -> Float:
        """Return a bound on the value for each amount, (k,) float64; bounds never fall."""
        bounds = np.full(len(self.amounts), self.ceiling)
        for one in self.solved:
            # What cannot be exceeded within a budget cannot be exceeded within less money either.
            within = self.ends <= one.budget * (1 + TIE_TOLERANCE)
            bounds[within] = np.minimum(bounds[within], one.bound)
        bounds[0] = NOTHING.value
        rising: Float = np.maximum.accumulate(bounds)
        return rising

    def bounding_options(self) -> Options:
        """Return the amounts at which the bound rises, with their bounds."""
        bounds = self.bounds()
        index = np.flatnonzero(np.diff(bounds, prepend=-math.inf) > 0)
        return Options(self.amounts[index], bounds[index], index)

    def found_options(self) -> Options:
        """Return the placements found, with their values; number 0 is the one without money."""
        found = self.found
        prices, values = (np.array([getattr(one, name) for one in found]) for name in ("price", "value"))
        order = np.lexsort((np.arange(len(found)), -values, prices))
        best = np.maximum.accumulate(values[order])
        better = np.diff(best, prepend=-math.inf) > 0  # placements that no cheaper one equals
        index = order[better]
        return Options(prices[index], values[index], index)

    @property
    def found(self) -> tuple[SolvedBudget, ...]:
        """Placements found, the one without money first."""
        return (NOTHING, *self.solved)

    def spent(self, budget: float) -> float:
        """Return the largest effort with which a budget was solved, 0 if it was not."""
        same = (one.effort for one in self.solved if math.isclose(one.budget, budget, rel_tol=TIE_TOLERANCE))
        return max(same, default=0.0)


def possible_amounts(prices: Float, positions: Integer, most_sensors: int, most: float) -> tuple[Float, Float]:
    """Return amounts of money that contain the price of every placement, from 0 on.

    Parameters
    ----------
    prices : (c,) float64, dollars
    positions : (c,) int64
        Position of each candidate; each position carries one sensor at most.
    most_sensors : int
        Largest number of sensors.
    most : float, dollars
        Largest total price.

    Returns
    -------
    amounts, ends : (k,) float64, dollars
        Smallest and largest price in each range of money. They are the same unless there are more than `MOST_AMOUNTS`
        different prices.
    """
    pairs = {(float(price), int(position)) for price, position in zip(prices, positions, strict=True)}
    places = Counter(price for price, _ in pairs)
    fewest = {0.0: 0}  # least number of sensors for each total price
    for price in sorted(places):
        for _ in range(min(places[price], most_sensors)):
            grown = {
                # rounding joins sums of the same prices in different orders
                round(total + price, 6): number + 1
                for total, number in fewest.items()
                if number < most_sensors and total + price <= most * (1 + TIE_TOLERANCE)
            }
            fewer = {total: number for total, number in grown.items() if number < fewest.get(total, most_sensors + 1)}
            if not fewer:
                break
            fewest |= fewer
    totals = np.array(sorted(fewest))
    if len(totals) <= MOST_AMOUNTS:
        return totals, totals
    # The amount 0 stays apart, as its value is known.
    parts = np.array_split(totals[1:], MOST_AMOUNTS - 1)
    return (
        np.array([0.0, *(part[0] for part in parts)]),
        np.array([0.0, *(part[-1] for part in parts)]),
    )
