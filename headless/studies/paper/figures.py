"""Figures of the paper's case on one site, as shown on the page; this module does not need PyTorch."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

from headless.detection.average_precision import jackknife_reach
from headless.studies.rank_correlation import rank_correlation

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.estimates import Interval

MIN_DIFFERENCE = 0.005  # difference of coverage below which two placements count as equal


@dataclass(frozen=True, eq=False)
class PlacementFigures:
    """Figures of one placement, measured with detectors.

    Parameters
    ----------
    name, sensor : str
    count : int
    coverage : float, 0 to 1
    enough : float, 0 to 1
        Share of the vehicles of the test frames with `ENOUGH_RETURNS` returns or more.
    returns : float
        Median number of returns from a vehicle of the test frames.
    precision : float, 0 to 1
        AP on randomly drawn runs after training on such runs; the mean over the trainings.
    interval : (float, float) or None
        Interval of the first training's AP over runs.
    without_each_run : (r,) float64 or None
        AP of the first training without each of the test runs; None with too few runs.
    false_positives : float
        False positives per frame.
    copies : float
        AP on runs with fixed departures after training on such runs.
    unfamiliar : float
        AP on the same runs with fixed departures after training on randomly drawn runs.
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
        Gain in AP; ``interval`` is its 95 % interval over runs, or None.
    more_returns : bool
        Whether more vehicles give `ENOUGH_RETURNS` with it than with the other.
    """

    better: PlacementFigures
    worse: PlacementFigures
    gain: float
    interval: Interval | None

    @property
    def stands(self) -> bool:
        """Whether the gain is significant by its interval."""
        return self.interval is not None and self.interval[0] > 0.0

    @property
    def more_returns(self) -> bool:
        """Whether the placement with more AP also has more vehicles with enough returns."""
        return self.better.enough > self.worse.enough


def reversals(placements: Sequence[PlacementFigures]) -> tuple[Reversal, ...]:
    """Return the pairs of placements in which the one that covers less detects more, the largest gain first."""
    found = [
        Reversal(better, worse, better.precision - worse.precision, _interval(better, worse))
        for better, worse in reversed_pairs(placements, "precision")
    ]
    return tuple(sorted(found, key=lambda one: -one.gain))


def reversed_pairs(
    placements: Sequence[PlacementFigures], figure: str
) -> list[tuple[PlacementFigures, PlacementFigures]]:
    """Return the pairs in which the first placement covers less and has a larger figure, one of the APs."""
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
    """Return the leak of each placement: AP on near copies after training on near copies, less after other runs."""
    return np.array([one.copies - one.unfamiliar for one in placements])


def agreement(placements: Sequence[PlacementFigures], figure: str) -> float:
    """Return the rank correlation of AP with a figure of the placements."""
    return rank_correlation([getattr(one, figure) for one in placements], [one.precision for one in placements])
