"""Verdicts on the paper's claims about detection, 5 to 8, for one site.

Gains are in points of average precision. All figures are means over the seeds of the training with Student's 95 %
interval; seeds are compared in pairs. A claim holds if the interval lies within the claimed range, does not hold if it
lies outside, and is undecided otherwise. "About" a published figure means from half to twice the figure. All claims are
undecided if the average precision is below `LEAST_PRECISION`, or if it was still rising when the training ended.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from headless.studies.claims import UNDECIDED, Claim, verdict_above, verdict_within, worst_verdict
from headless.studies.coverage.cells import COUNTS

import numpy as np

from seip_addon.core.base.arrays import Float
from seip_addon.core.base.counts import counted
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.estimates import SHARE, Interval, student_reach

ANYTHING: Interval = (-math.inf, math.inf)  # range of a figure without bounds
COUNT: Interval = (0.0, math.inf)
CHANGE_OF_SHARE: Interval = (-1.0, 1.0)

FACTOR = 2.0  # largest ratio of two figures that are "about" the same
MIN_SEEDS = 3  # seeds below which nothing is decided
LEAST_PRECISION = 0.3  # average precision that the detectors must reach with the best of a claim's placements

PUBLISHED_GAINS = ((0.20, 0.07), (0.10, 0.05))
"""Published gains from one to two and from two to four sensors, of the simplest type and the next."""

FEW, SOME, MANY = COUNTS


@dataclass(frozen=True)
class SeedResult:
    """Figures of one training with one sensor configuration.

    Parameters
    ----------
    sensor : str
        Catalogue key.
    count : int
        N, the largest number of sensors allowed.
    average_precision : float, 0 to 1
        Average precision for vehicles at an intersection over union of 0.7 in plan.
    price : float, US dollars
    coverage : float, 0 to 1
        Share of targets that the placement sees.
    false_positives : float
        False positives per frame, at a score that all results of a training share.
    sparse : float, 0 to 1
        Share of the false positives where the cloud is sparser than around half of the hits; NaN without any.
    still_rising : bool
        Whether the average precision on validation frames was still rising when the training ended.
    """

    sensor: str
    count: int
    seed: int
    average_precision: float
    price: float
    coverage: float
    false_positives: float
    sparse: float
    still_rising: bool = False


def detection_claims(results: Sequence[SeedResult]) -> tuple[Claim, ...]:
    """Evaluate claims 5 to 8 of the paper on the measurements.

    Claims for which a type is missing are left out.

    Parameters
    ----------
    results : sequence of SeedResult
        Results of every seed for each type and number of sensors; types in order from the simplest to the best.
    """
    sensors = list(dict.fromkeys(result.sensor for result in results))
    claims = [
        _decided(_gains(number, results, sensor, published), _of(results, sensor))
        for number, sensor, published in zip((5, 6), sensors, PUBLISHED_GAINS, strict=False)  # a study may have one
    ]
    if len(sensors) > 1:
        claims.append(_decided(_simple_sensors_gain_more(results, sensors), results))
    if sensors:
        claims.append(_decided(_false_where_sparse(results, sensors[0]), _of(results, sensors[0])))
    return tuple(claims)


def _of(results: Sequence[SeedResult], sensor: str) -> list[SeedResult]:
    return [result for result in results if result.sensor == sensor]


def _decided(claim: Claim, results: Sequence[SeedResult]) -> Claim:
    """Return the claim, or if its trainings are not conclusive, the undecided claim with the reason."""
    doubts = list(_doubts(results))
    if not doubts:
        return claim
    return replace(claim, verdict=UNDECIDED, evidence=f"no verdict, as {' and '.join(doubts)}; {claim.evidence}")


def _doubts(results: Sequence[SeedResult]) -> Iterator[str]:
    cells = {(one.sensor, one.count) for one in results}
    best = max(float(_figures(results, *cell, "average_precision").mean()) for cell in cells)
    if best < LEAST_PRECISION:
        yield (
            f"the detectors reach an AP of {best:.1%} with the best of these placements, and below "
            f"{LEAST_PRECISION:.0%} they support no conclusion about sensors"
        )
    rising = {one.seed for one in results if one.still_rising}
    if rising:
        yield (
            f"validation AP was still rising when {len(rising)} of {len({one.seed for one in results})} trainings "
            "ended: train longer, with --steps"
        )


def _gains(number: int, results: Sequence[SeedResult], sensor: str, published: tuple[float, float]) -> Claim:
    steps = ((FEW, SOME), (SOME, MANY))
    gains = [_Mean.of(_gain(results, sensor, *step), CHANGE_OF_SHARE) for step in steps]
    verdicts = [gain.about(expected) for gain, expected in zip(gains, published, strict=True)]
    figures = [f"{a} to {b}: {gain.points()}" for (a, b), gain in zip(steps, gains, strict=True)]
    return Claim(
        number,
        f"{sensor}: AP rises by about {100 * published[0]:g} points from N = {FEW} to {SOME} and by about "
        f"{100 * published[1]:g} from {SOME} to {MANY}",
        worst_verdict(verdicts),
        f"{'; '.join(figures)}; {counted(len(_gain(results, sensor, FEW, SOME)), 'seed')}",
    )


def _simple_sensors_gain_more(results: Sequence[SeedResult], sensors: Sequence[str]) -> Claim:
    simple, *better = sensors
    gains = {sensor: _gain(results, sensor, FEW, MANY) for sensor in sensors}
    leads = [_Mean.of(gains[simple] - gains[other]) for other in better]
    rows = []
    for sensor, gain in gains.items():
        spent = (_figures(results, sensor, MANY, "price")[0] - _figures(results, sensor, FEW, "price")[0]) / 1000
        per_price = f", {100 * gain.mean() / spent:+.2f} for each $1,000" if spent > 0 else ""
        rows.append(f"{sensor} {_Mean.of(gain, CHANGE_OF_SHARE).points()}{per_price}")
    ahead = [f"{lead.points()} more than {other}" for other, lead in zip(better, leads, strict=True)]
    return Claim(
        7,
        f"adding {simple} sensors gains more AP than adding {' or '.join(better)}",
        worst_verdict([lead.above() for lead in leads]),
        f"N = {FEW} to {MANY}: {'; '.join(rows)}; {simple} gains {', '.join(ahead)}",
    )


def _false_where_sparse(results: Sequence[SeedResult], sensor: str) -> Claim:
    false = {count: _figures(results, sensor, count, "false_positives") for count in COUNTS}
    more = [_Mean.of(false[count] - false[MANY]) for count in (FEW, SOME)]
    sparse = [_Mean.of(_figures(results, sensor, count, "sparse"), SHARE) for count in (FEW, SOME)]
    rows = [f"N = {count} {_Mean.of(false[count], COUNT).plain()}" for count in COUNTS]
    shares = [f"N = {count} {share.share()}" for count, share in zip((FEW, SOME), sparse, strict=True)]
    return Claim(
        8,
        f"{sensor}: N = {FEW} and {SOME} give more false positives than N = {MANY}, mostly where the cloud is sparse",
        worst_verdict([*(one.above() for one in more), *(share.above(0.5) for share in sparse)]),
        f"per frame: {'; '.join(rows)}; of them in the sparser half: {'; '.join(shares)}",
    )


def _figures(results: Sequence[SeedResult], sensor: str, count: int, figure: str) -> Float:
    """Return a figure of one type and number of sensors for each seed, (s,)."""
    cell = sorted((one for one in results if (one.sensor, one.count) == (sensor, count)), key=lambda one: one.seed)
    return np.array([getattr(one, figure) for one in cell])


def _gain(results: Sequence[SeedResult], sensor: str, few: int, more: int) -> Float:
    before, after = (_figures(results, sensor, count, "average_precision") for count in (few, more))
    return after - before


@dataclass(frozen=True)
class _Mean:
    """Mean over seeds; NaN without any, and with fewer than `MIN_SEEDS` the interval is None."""

    value: float
    interval: Interval | None

    @classmethod
    def of(cls, values: Float, possible: Interval = ANYTHING) -> "_Mean":
        """Return the mean of the known values."""
        known = values[~np.isnan(values)].tolist()
        interval = mean_interval(known, possible) if len(known) >= MIN_SEEDS else None
        return cls(float(np.mean(known)) if known else np.nan, interval)

    def about(self, expected: float) -> str:
        """Return the verdict on the claim that the mean is about a published figure."""
        low, high = expected / FACTOR, expected * FACTOR
        return UNDECIDED if self.interval is None else verdict_within(self.interval, low, high)

    def above(self, least: float = 0.0) -> str:
        """Return the verdict on the claim that the mean is above a value."""
        return UNDECIDED if self.interval is None else verdict_above(self.interval, least)

    def points(self) -> str:
        return self._written(lambda value: f"{100 * value:+.1f}", " points")

    def share(self) -> str:
        return self._written(lambda value: f"{100 * value:.0f}", " %")

    def plain(self) -> str:
        return self._written(lambda value: f"{value:.2f}", "")

    def _written(self, figure: Callable[[float], str], unit: str) -> str:
        if np.isnan(self.value):
            return "not measured"
        between = "" if self.interval is None else f" ({figure(self.interval[0])} to {figure(self.interval[1])})"
        return f"{figure(self.value)}{unit}{between}"


def mean_interval(values: Sequence[float], possible: Interval = ANYTHING) -> Interval:
    """Return the 95 % interval of the mean over repetitions (seeds); see `student_reach`.

    Impossible values are cut off, which does not change the probability that the interval contains the mean.

    Parameters
    ----------
    values : sequence of float
        Values of the repetitions.
    possible : (float, float)
        Least and largest possible value of the figure.

    Raises
    ------
    SeipError
        There are fewer than two values.
    """
    if len(values) < 2:
        raise SeipError(
            f"{len(values)} seed gives no interval: repeat the study with at least two, better three or more"
        )
    mean, reach = float(np.mean(values)), student_reach(values)
    return max(mean - reach, possible[0]), min(mean + reach, possible[1])
