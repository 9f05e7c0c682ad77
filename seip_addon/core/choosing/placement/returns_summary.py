"""Summary of the expected returns of a placement from road users."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

FEW_RETURNS = 5.0
"""Number of returns from a pedestrian below which a warning names the crossing."""
FEW = f"fewer than {FEW_RETURNS:g} returns from a pedestrian"
"""Beginning of that warning."""

ENOUGH_RETURNS = {"car": 12.0, "cyclist": 8.0, "pedestrian": 8.0}
"""Returns from which on the shipped detector finds about nine in ten road users of each kind (docs/detection.md)."""
GOOD_SHARE, FAIR_SHARE = 0.95, 0.8
"""Shares of the places with enough returns from which a placement is called good, and fair."""

NOT_BY_DETECTION = (
    "the criterion is expected returns, not detection: at ten junctions with two OS1-128 the average precision of a "
    "detector with its best placement was 2 points lower for vehicles, 6 for two-wheelers and 5 for pedestrians than "
    "with the best of about 106 placements; a choice among finalists by detection measures it here"
)
"""Note on placements for returns that no detector has judged; docs/open-benchmark.md has its figures."""

SURFACE_SEEN = (
    "Seen means that the surface of the road itself is measured. People and vehicles reflect more light and are "
    "detected farther away."
)
"""Why the share of the road that is seen is lower than that on which road users are detected."""


def share_reached(value: float, best: float, *, of_returns: bool) -> float:
    """Return the share of the best placement's outcome that another placement reaches, from their objective values.

    Parameters
    ----------
    of_returns : bool
        Whether the values are means of ln(1 + returns); the share is then one of the geometric mean of 1 + returns.
        Otherwise the values are covered weights.
    """
    if of_returns:
        return math.exp(value - best)
    return value / best if best > 0.0 else 1.0


def returns_text(number: float) -> str:
    """Return a number of returns as text: two significant digits, or a whole number from 10 on."""
    return f"{number:,.0f}" if number >= 10 else f"{number:.2g}"


def _rounded_down(number: float) -> str:
    """Return a number below `FEW_RETURNS` as text that is below it too: 4.98 becomes 4.9, not 5."""
    text = returns_text(number)
    return text if float(text) < FEW_RETURNS else f"{math.floor(10 * number) / 10:.1f}"


@dataclass(frozen=True)
class CrossingReturns:
    """Expected returns of a pedestrian at the worst point of a crossing."""

    name: str
    least: float


@dataclass(frozen=True)
class ReturnsPoint:
    """The placement with the most returns found with at most ``count`` sensors.

    Parameters
    ----------
    returns : float
        Typical number of returns, as of `ReturnsSummary`.
    price : float, dollars
    gap : float or None
        Largest share by which the geometric mean of 1 + returns of another placement could be larger; 0 where this one
        is proven optimal, None where nothing is proven.
    """

    count: int
    returns: float
    price: float
    gap: float | None


@dataclass(frozen=True)
class ReturnsSummary:
    """Expected returns from road users of all sensors together in one revolution.

    Parameters
    ----------
    typical : float
        Geometric mean over road users of 1 + returns, less 1: the quantity that the placement maximises.
    of_each : mapping of str to float
        The same mean for each kind of road user.
    crossings : tuple of CrossingReturns
        Returns from a pedestrian at each crossing.
    enough : mapping of str to float
        Share of the places, by weight, where a road user of each kind in plain view returns at least `ENOUGH_RETURNS`;
        records of earlier versions lack it.
    front : tuple of ReturnsPoint
        Best placements found with fewer and more sensors, see `front_of`. Empty if they were not searched for.

    Examples
    --------
    >>> crossings = CrossingReturns("Rope Lane", 4.98), CrossingReturns("Main Street", 20.0)
    >>> returns = ReturnsSummary(36.2, {"car": 494.0, "pedestrian": 3.61}, crossings)
    >>> returns.describe()
    '494 returns from a car and 3.6 from a pedestrian'
    >>> returns.warnings()
    ('fewer than 5 returns from a pedestrian at the worst point of: Rope Lane (4.9)',)
    >>> ReturnsSummary(36.2, {}, (), enough={"car": 0.994, "pedestrian": 0.93}).verdict()
    'A car in plain view returns 12 points or more at 99% of its places, a pedestrian 8 or more at 93%: fair.'
    """

    typical: float
    of_each: Mapping[str, float]
    crossings: tuple[CrossingReturns, ...]
    front: tuple[ReturnsPoint, ...] = ()
    enough: Mapping[str, float] = field(default_factory=dict)

    def verdict(self) -> str:
        """Return where road users return enough points to be detected, and how good that is, as a sentence or ""."""
        if not self.enough:
            return ""
        (name, share), *others = self.enough.items()
        first = f"A {name} in plain view returns {ENOUGH_RETURNS[name]:g} points or more at {share:.0%} of its places"
        parts = [first, *(f"a {one} {ENOUGH_RETURNS[one]:g} or more at {share:.0%}" for one, share in others)]
        worst = min(self.enough.values())
        word = "good" if worst >= GOOD_SHARE else "fair" if worst >= FAIR_SHARE else "poor"
        return f"{', '.join(parts)}: {word}."

    def describe(self) -> str:
        """Return the number of returns from each kind of road user as text, with its unit."""
        return self.describe_each().replace(" from", " returns from", 1)

    def describe_each(self) -> str:
        """Return the numbers alone as text, such as "494 from a car and 36 from a pedestrian"."""
        parts = [f"{returns_text(number)} from a {name}" for name, number in self.of_each.items()]
        return " and ".join(filter(None, (", ".join(parts[:-1]), parts[-1])))

    def warnings(self) -> tuple[str, ...]:
        """Return a warning that names the crossings where a pedestrian may have few returns."""
        few = [one for one in self.crossings if one.least < FEW_RETURNS]
        if not few:
            return ()
        named = ", ".join(f"{one.name} ({_rounded_down(one.least)})" for one in few)
        return (f"{FEW} at the worst point of: {named}",)
