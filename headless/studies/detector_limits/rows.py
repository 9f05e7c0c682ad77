"""Limits of the detector, as rows of the stability page."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from headless.charts.detection import Bin
from headless.detection.suitability import MAX_OVERFULL_SHARE
from headless.studies.stability.rows import Row

import numpy as np

from seip_addon.core.estimates import IntervalEstimate

from .disturbances import (
    CappedPillars,
    ClockOffset,
    DropOff,
    OfOneSensor,
    OtherSizes,
    PositionError,
    Rain,
    RangeNoise,
    SensorFailure,
    Thinned,
    TiltError,
    YawError,
)
from .study import (
    AT_HOME,
    BorderResults,
    DisturbanceCurve,
    DisturbanceEffect,
    LimitsStudy,
    PillarFilling,
    SeedSpread,
    TransferResult,
)

METHOD = "detector"

_CATALOGUE = "scans and trainings use {} of the catalogue: enter the value of your sensor and evaluate again"
_CALIBRATION = (
    "a single cloud does not show it: calibrate each sensor to better than that, and again after work on its pole"
)
_RAIN = (
    "not detected: returns from drops near the sensors harm before the loss of light does, so let the sensors filter "
    "them; for the loss of light, evaluate again with --weather, which placements, scans and trainings then use"
)
REMEDIES: Mapping[str, str] = {
    RangeNoise.name: _CATALOGUE.format("range_noise_std_m"),
    DropOff.name: _CATALOGUE.format("dropoff_general_rate"),
    Rain.name: _RAIN,
    PositionError.name: _CALIBRATION,
    YawError.name: _CALIBRATION,
    TiltError.name: _CALIBRATION,
    ClockOffset.name: "a single cloud does not show it: synchronise the sensors' clocks to better than that",
    SensorFailure.name: "`seip place --failures mean` optimises for the loss of any one sensor",
    OtherSizes.name: "training with varied bodies: headless.studies.random_sites.varied_bodies",
    Thinned.name: "none needed: thinner traffic hides less",
    CappedPillars.name: f"a warning if more than {MAX_OVERFULL_SHARE:.0%} of the pillars with points are over-full",
}


def limit_rows(study: LimitsStudy) -> tuple[Row, ...]:
    """Return the rows: seeds, disturbances, other types and sites, the region's borders, pillars, and padding."""
    return (
        _of_spreads(study.spreads),
        *(_of_curve(curve, study) for curve in study.curves),
        *(_transfer_row(one) for one in study.transfers),
        *(row for borders in study.borders[:1] for row in _of_borders(borders)),
        _of_pillars(study.pillars),
        *(_of_padding(one) for one in study.padding),
    )


def format_points(change: IntervalEstimate) -> str:
    """Return a change of average precision with its interval in percentage points, as a message."""
    value, low, high = (100 * end for end in (change.value, change.low, change.high))
    return f"{value:+.1f} points [{low:+.1f}, {high:+.1f}]"


def _of_spreads(spreads: Sequence[SeedSpread]) -> Row:
    each = (
        f"{one.configuration}: {one.precision.describe(1)}, seeds from {min(one.values):.1%} to {max(one.values):.1%}"
        for one in spreads
    )
    return Row(
        METHOD,
        "seeds of the training",
        "; ".join(each),
        f"{len(spreads[0].values)} trainings that differ only in their seeds, the same test frames",
        "`seip study detection` trains with several seeds and gives the interval over them",
    )


def _of_curve(curve: DisturbanceCurve, study: LimitsStudy) -> Row:
    wrong = curve.points[0].disturbance
    whose = ""
    if isinstance(wrong, OfOneSensor) and not isinstance(wrong, SensorFailure):
        whose = f" (S{wrong.sensor + 1}, whose loss costs most)"
    detectors = len(study.spreads[0].values)
    return Row(
        METHOD,
        f"{curve.name}{whose} with {curve.configuration}",
        _each_loss(curve) if isinstance(wrong, SensorFailure) else _begins(curve),
        f"{detectors} detectors on the same {study.frames} frames with and without; 95 % interval of the paired "
        "difference, over runs of traffic (jackknife) and trainings (Student)",
        REMEDIES[curve.name],
    )


def _begins(curve: DisturbanceCurve) -> str:
    begins, last = curve.begins, curve.points[-1]
    if begins is None:
        return f"not up to {_size(last)}: {format_points(last.change)} on {curve.undisturbed.value:.1%}"
    words = f"at {_size(begins)}: {format_points(begins.change)} on {curve.undisturbed.value:.1%}"
    milder = curve.points[: curve.points.index(begins)]
    if milder:
        words += f"; at {_size(milder[-1])} not significant, {format_points(milder[-1].change)}"
    if last is not begins:
        words += f"; at {_size(last)} {format_points(last.change)}"
    return words


def _size(point: DisturbanceEffect) -> str:
    disturbance = point.disturbance
    space = "" if disturbance.unit == "°" else " "
    return f"{disturbance.size:g}{space}{disturbance.unit}"


def _each_loss(curve: DisturbanceCurve) -> str:
    each = (f"S{point.disturbance.size:g} {format_points(point.change)}" for point in curve.points)
    return f"lost: {', '.join(each)} on {curve.undisturbed.value:.1%}"


def _transfer_row(one: TransferResult) -> Row:
    return Row(
        METHOD,
        f"trained on {one.trained_on}, used on {one.tested_on}",
        f"{format_points(one.change)} against {one.against}: {one.precision.describe(1)}",
        "the same frames, paired" if one.against != AT_HOME else "different frames: not paired",
        "a detector's file names the sensor types and sites of its training; other types, or another site than the "
        "only one of the training, cause a warning",
    )


def _of_borders(borders: BorderResults) -> Iterator[Row]:
    how = f"the first detector with {borders.configuration}, detections with a score of {borders.score:.2f} or more"
    recall = borders.recall
    yield Row(
        METHOD,
        "few returns from a road user",
        _below_half(recall["points"], "returns"),
        how,
        "ap_bev_0.7_from_5_points next to the average precision of all; charts by returns",
    )
    for quantity, what in (("sensor", "from the nearest sensor"), ("border", "from the border of the region")):
        yield Row(
            METHOD,
            f"distance {what}",
            f"recall {_bins(recall[quantity], lambda value: f'{value:.0%}')}; false positives per frame "
            + _bins(borders.false[quantity], lambda value: f"{value:.2f}", recall[quantity]),
            how,
            "charts by distance; a region of interest that covers the area to be watched, not the whole drawing",
        )


def _below_half(bins: Sequence[Bin], what: str) -> str:
    """Return the bins in which fewer than half of the road users are found, as a message."""
    known = [one for one in bins if one.wanted]
    fails = [one for one in known if one.value < 0.5]
    words = _bins(known, lambda value: f"{value:.0%}")
    return f"fewer than half found below {fails[-1].high:g} {what}: {words}" if fails else f"nowhere: {words}"


def _bins(bins: Sequence[Bin], formatted: Callable[[float], str], like: Sequence[Bin] | None = None) -> str:
    road_users = [one.wanted for one in like or bins]
    return ", ".join(
        f"{formatted(one.value)} ({one.low:g} to {one.high:g})"
        for one, count in zip(bins, road_users, strict=True)
        if count and np.isfinite(one.value)
    )


def _of_pillars(pillars: Sequence[PillarFilling]) -> Row:
    own = [(one.configuration, next(iter(one.filling.items()))) for one in pillars]
    each = (
        f"{name}: {full.empty:.0%} empty, {full.over_full:.1%} of the others over-full, {full.left_out:.0%} of the "
        "points left out"
        for name, (_, full) in own
    )
    return Row(
        METHOD,
        f"empty and over-full pillars ({own[0][1][0]} points kept)",
        "; ".join(each),
        "counted in undisturbed test frames",
        "empty pillars cost nothing, as only points are processed; " + REMEDIES[CappedPillars.name],
    )


def _of_padding(one: TransferResult) -> Row:
    return Row(
        METHOD,
        f"pillars padded with zeros, {one.tested_on}",
        f"{format_points(one.change)}: {one.precision.describe(1)}",
        "the same training steps and seeds, the same frames, paired",
        "pillars are not padded: the network processes only measured points",
    )
