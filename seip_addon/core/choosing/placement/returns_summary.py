"""Returns from road users that a placement has, in figures for people."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from ...limits import COUNT, Limits

RETURNS = Limits(0.0, COUNT.most)
FEW_RETURNS = 5.0
"""Returns of a pedestrian below which a crossing is named."""


def share_reached(value: float, best: float, *, of_returns: bool) -> float:
    """Return the share of what the best placement has that another one has, from their objective values.

    Parameters
    ----------
    of_returns : bool
        Whether the values are means of ln(1 + returns), and the share is one of the geometric mean of 1 + returns;
        otherwise they are covered weight.
    """
    if of_returns:
        return math.exp(value - best)
    return value / best if best > 0.0 else 1.0


def returns_text(number: float) -> str:
    """Return a number of returns with two digits or, if large, none after the point."""
    return f"{number:,.0f}" if number >= 10 else f"{number:.2g}"


def _rounded_down(number: float) -> str:
    """Return a number of few returns as text that reads as few: 4.98 is 4.9 and not 5."""
    text = returns_text(number)
    return text if float(text) < FEW_RETURNS else f"{math.floor(10 * number) / 10:.1f}"


@dataclass(frozen=True)
class CrossingReturns:
    """Expected returns of a pedestrian at the worst point of a crossing."""

    name: str
    least: Annotated[float, RETURNS]


@dataclass(frozen=True)
class ReturnsSummary:
    """Expected returns from road users of all sensors together in one revolution.

    Parameters
    ----------
    typical : float
        Geometric mean over road users of 1 + returns, less 1: what the placement maximises.
    of_each : mapping of str to float
        The same for each kind of road user.
    crossings : tuple of CrossingReturns
    """

    typical: Annotated[float, RETURNS]
    of_each: Mapping[str, Annotated[float, RETURNS]]
    crossings: tuple[CrossingReturns, ...]

    def describe(self) -> str:
        """Return the returns from each kind of road user as part of a sentence."""
        parts = [f"{returns_text(number)} from a {name}" for name, number in self.of_each.items()]
        parts[0] = parts[0].replace(" from", " returns from", 1)
        return f"{', '.join(parts[:-1])} and {parts[-1]}"

    def warnings(self) -> tuple[str, ...]:
        """Name the crossings where a pedestrian may have few returns."""
        few = [one for one in self.crossings if one.least < FEW_RETURNS]
        if not few:
            return ()
        named = ", ".join(f"{one.name} ({_rounded_down(one.least)})" for one in few)
        return (f"fewer than {FEW_RETURNS:g} returns from a pedestrian at the worst point of: {named}",)
