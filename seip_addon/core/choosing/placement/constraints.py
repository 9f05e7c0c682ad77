"""Constraints of a reduced placement problem, whatever its objective."""

import math

import numpy as np

from ...arrays import Boolean, Float, Integer
from .problem import TIE_TOLERANCE


class Constrained:
    """A problem with c candidates and g mandatory groups, of which `Instance` and `ReturnsInstance` are kinds.

    Attributes
    ----------
    price : (c,) float64, dollars
    conflict : (c, c) bool
        Pairs that exclude each other. The diagonal is false.
    clique : (c,) int64
        A partition of the candidates into sets of which one at most can be chosen.
    mandatory : (g, c) bool
    count : int
        Largest number of sensors.
    budget : float, dollars
        Largest total price; infinite where there is no budget.
    """

    price: Float
    conflict: Boolean
    clique: Integer
    mandatory: Boolean
    count: int
    budget: float

    def __len__(self) -> int:
        """Return the number of candidates."""
        return len(self.price)

    def affordable(self, price: Float | float) -> Boolean | bool:
        """Return whether a total price is within the budget, except for rounding."""
        return price <= self.budget * (1 + TIE_TOLERANCE)

    def feasible(self, chosen: Integer) -> bool:
        """Return whether the chosen candidates meet every constraint."""
        return bool(
            len(chosen) <= self.count
            and self.affordable(math.fsum(self.price[chosen]))
            and not self.conflict[np.ix_(chosen, chosen)].any()
            and self.mandatory[:, chosen].any(axis=1).all()
        )
