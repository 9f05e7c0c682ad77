"""Verdicts on the paper's claims about detection, 5 to 8, for one site.

Gains are in points of average precision. All figures are means over the seeds of the training with Student's 95 %
interval; seeds are compared in pairs. A claim holds if the interval lies within the claimed range, does not hold if it
lies outside, and is undecided otherwise. "About" a published figure means from half to twice the figure. All claims are
undecided if the average precision is below `LEAST_PRECISION`, or if it was still rising when the training ended.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from headless.studies.claims import UNDECIDED, Claim, verdict_above, verdict_within, worst_verdict
from headless.studies.coverage.cells import COUNTS
from headless.studies.mean_over_seeds import ANYTHING, CHANGE_OF_SHARE, COUNT, mean_interval

import numpy as np

from seip_addon.core.counts import counted
from seip_addon.core.estimates import SHARE, Interval

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
        Results with several seeds for each type; types in order from the simplest to the best.
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
    reached = (_mean(_by_seed(results, *cell, lambda one: one.average_precision)).value for cell in cells)
    best = max(reached, default=0.0)
    if best < LEAST_PRECISION:
        yield (
            f"the detectors reach an AP of {best:.1%} with the best of these placements, and below "
            f"{LEAST_PRECISION:.0%} they support no conclusion about sensors"
        )
    trainings = {one.seed for one in results}
    rising = {one.seed for one in results if one.still_rising}
    if rising:
        yield (
            f"validation AP was still rising when {len(rising)} of {len(trainings)} trainings ended: train longer, "
            "with --steps"
        )


def _gains(number: int, results: Sequence[SeedResult], sensor: str, published: tuple[float, float]) -> Claim:
    steps = ((FEW, SOME), (SOME, MANY))
    gains = [_mean(_gain(results, sensor, *step), CHANGE_OF_SHARE) for step in steps]
    verdicts = [_about(gain, expected) for gain, expected in zip(gains, published, strict=True)]
    figures = [f"{a} to {b}: {gain.points()}" for (a, b), gain in zip(steps, gains, strict=True)]
    return Claim(
        number,
        f"{sensor}: AP rises by about {100 * published[0]:g} points from N = {FEW} to {SOME} and by about "
        f"{100 * published[1]:g} from {SOME} to {MANY}",
        worst_verdict(verdicts),
        f"{'; '.join(figures)}; {_seeds(gains)}",
    )


def _simple_sensors_gain_more(results: Sequence[SeedResult], sensors: Sequence[str]) -> Claim:
    simple, *better = sensors
    gains = {sensor: _gain(results, sensor, FEW, MANY) for sensor in sensors}
    leads = [_mean(_differences(gains[simple], gains[other])) for other in better]
    rows = [
        f"{sensor} {_mean(gains[sensor], CHANGE_OF_SHARE).points()}{_per_price(results, sensor)}" for sensor in sensors
    ]
    ahead = [f"{lead.points()} more than {other}" for other, lead in zip(better, leads, strict=True)]
    return Claim(
        7,
        f"adding {simple} sensors gains more AP than adding {' or '.join(better)}",
        worst_verdict([_above(lead) for lead in leads]),
        f"N = {FEW} to {MANY}: {'; '.join(rows)}; {simple} gains {', '.join(ahead)}",
    )


def _false_where_sparse(results: Sequence[SeedResult], sensor: str) -> Claim:
    false = {count: _by_seed(results, sensor, count, lambda result: result.false_positives) for count in COUNTS}
    more = [_mean(_differences(false[count], false[MANY])) for count in (FEW, SOME)]
    sparse = [_mean(_by_seed(results, sensor, count, lambda result: result.sparse), SHARE) for count in (FEW, SOME)]
    rows = [f"N = {count} {_mean(false[count], COUNT).plain()}" for count in COUNTS]
    shares = [f"N = {count} {share.share()}" for count, share in zip((FEW, SOME), sparse, strict=True)]
    return Claim(
        8,
        f"{sensor}: N = {FEW} and {SOME} give more false positives than N = {MANY}, mostly where the cloud is sparse",
        worst_verdict([*map(_above, more), *(_above(share, 0.5) for share in sparse)]),
        f"per frame: {'; '.join(rows)}; of them in the sparser half: {'; '.join(shares)}",
    )


@dataclass(frozen=True)
class _Mean:
    """Mean over seeds; its interval is None with fewer than `MIN_SEEDS`."""

    value: float
    seeds: int
    interval: Interval | None

    def points(self) -> str:
        return self._written(lambda value: f"{100 * value:+.1f}", " points")

    def share(self) -> str:
        return self._written(lambda value: f"{100 * value:.0f}", " %")

    def plain(self) -> str:
        return self._written(lambda value: f"{value:.2f}", "")

    def _written(self, figure: Callable[[float], str], unit: str) -> str:
        if not self.seeds:
            return "not measured"
        between = "" if self.interval is None else f" ({figure(self.interval[0])} to {figure(self.interval[1])})"
        return f"{figure(self.value)}{unit}{between}"


BySeed = dict[int, float]


def _mean(of: BySeed, possible: Interval = ANYTHING) -> _Mean:
    values = list(of.values())
    if not values:
        return _Mean(np.nan, 0, None)
    interval = mean_interval(values, possible) if len(values) >= MIN_SEEDS else None
    return _Mean(float(np.mean(values)), len(values), interval)


def _by_seed(results: Sequence[SeedResult], sensor: str, count: int, figure: Callable[[SeedResult], float]) -> BySeed:
    """Return a figure of one cell by seed, without seeds for which it is NaN."""
    cell = {result.seed: figure(result) for result in results if (result.sensor, result.count) == (sensor, count)}
    return {seed: value for seed, value in cell.items() if not np.isnan(value)}


def _gain(results: Sequence[SeedResult], sensor: str, few: int, more: int) -> BySeed:
    before, after = (_by_seed(results, sensor, n, lambda result: result.average_precision) for n in (few, more))
    return _differences(after, before)


def _differences(more: BySeed, less: BySeed) -> BySeed:
    return {seed: more[seed] - less[seed] for seed in more if seed in less}


def _per_price(results: Sequence[SeedResult], sensor: str) -> str:
    """Return the gain for each thousand dollars of price of the added sensors, as a message."""
    price = {count: _mean(_by_seed(results, sensor, count, lambda result: result.price)).value for count in (FEW, MANY)}
    spent = (price[MANY] - price[FEW]) / 1000
    if not spent > 0:
        return ""
    return f", {100 * _mean(_gain(results, sensor, FEW, MANY)).value / spent:+.2f} for each $1,000"


def _seeds(gains: Sequence[_Mean]) -> str:
    fewest = min(gain.seeds for gain in gains)
    return counted(fewest, "seed")


def _about(mean: _Mean, expected: float) -> str:
    return UNDECIDED if mean.interval is None else verdict_within(mean.interval, expected / FACTOR, expected * FACTOR)


def _above(mean: _Mean, least: float = 0.0) -> str:
    return UNDECIDED if mean.interval is None else verdict_above(mean.interval, least)
