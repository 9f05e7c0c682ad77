"""Figures of the paper's case on one site, as the page shows them: no detector is needed to hold or to read them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.estimates import Interval, jackknife_reach, rank_correlation

MIN_DIFFERENCE = 0.005  # of coverage, below which two placements cover as much


@dataclass(frozen=True, eq=False)
class PlacementFigures:
    """What was measured of one placement with detectors.

    Parameters
    ----------
    name, sensor : str
    count : int
    coverage : float, 0 to 1
    enough : float, 0 to 1
        Share of the vehicles of the test frames with `ENOUGH_RETURNS` returns or more.
    returns : float
        From a vehicle of the test frames, in the middle (the median).
    precision : float, 0 to 1
        AP of runs drawn anew, learnt from such: the mean over the trainings.
    interval : (float, float) or None
        Of the first training's, over runs.
    without_each_run : (r,) float64 or None
        The first training's AP, without each of the test runs; None where these are too few.
    false_positives : float
        Per frame.
    copies : float
        AP of runs with fixed departures, learnt from such.
    unfamiliar : float
        AP of the same runs with fixed departures, learnt from those drawn anew.
    """

    name: str
    sensor: str
    count: int
    coverage: float
    enough: float
    returns: float
    precision: float
    interval: Interval | None
    without_each_run: Float | None
    false_positives: float
    copies: float
    unfamiliar: float


ENOUGH_RETURNS = 10


@dataclass(frozen=True)
class Reversal:
    """A placement that covers less than another and detects more.

    Parameters
    ----------
    gain : float
        In AP, with its 95 % interval over runs where there is one.
    more_returns : bool
        Whether more vehicles give `ENOUGH_RETURNS` with it than with the other.
    """

    better: PlacementFigures
    worse: PlacementFigures
    gain: float
    interval: Interval | None

    @property
    def stands(self) -> bool:
        """Whether the interval leaves it standing."""
        return self.interval is not None and self.interval[0] > 0.0

    @property
    def more_returns(self) -> bool:
        """Whether returns on vehicles tell the two apart the right way round."""
        return self.better.enough > self.worse.enough


def reversals(placements: Sequence[PlacementFigures]) -> tuple[Reversal, ...]:
    """Return the pairs of which that which covers less detects more, the largest gain first."""
    found = [
        Reversal(better, worse, better.precision - worse.precision, _interval(better, worse))
        for better, worse in reversed_pairs(placements, "precision")
    ]
    return tuple(sorted(found, key=lambda one: -one.gain))


def reversed_pairs(
    placements: Sequence[PlacementFigures], figure: str
) -> list[tuple[PlacementFigures, PlacementFigures]]:
    """Return the pairs of which the first covers less and has more of a figure: of one of the average precisions."""
    return [
        (better, worse)
        for better, worse in permutations(placements, 2)
        if better.coverage < worse.coverage - MIN_DIFFERENCE and getattr(better, figure) > getattr(worse, figure)
    ]


def _interval(better: PlacementFigures, worse: PlacementFigures) -> Interval | None:
    if better.without_each_run is None or worse.without_each_run is None:
        return None
    gain, reach = better.precision - worse.precision, jackknife_reach(better.without_each_run - worse.without_each_run)
    return gain - reach, gain + reach


def leaks(placements: Sequence[PlacementFigures]) -> Float:
    """Return how much AP near copies add to each placement: learnt from near copies less learnt from other runs."""
    return np.array([one.copies - one.unfamiliar for one in placements])


def agreement(placements: Sequence[PlacementFigures], figure: str) -> float:
    """Return the rank correlation of AP with a figure of the placements."""
    return rank_correlation([getattr(one, figure) for one in placements], [one.precision for one in placements])
