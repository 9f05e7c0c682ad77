"""Results of a study of placements: sentences, tables, record and charts."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from headless.studies.criteria.charts import CriterionBar, PlacementMark, save_criteria_chart, save_placements_chart
from headless.studies.detection.case_study import Traffic

import numpy as np

from seip_addon.core.estimates import IntervalEstimate
from seip_addon.core.storage.csv_table import save_csv
from seip_addon.core.storage.files import save_json

from .agreement import (
    AssessedCriterion,
    Correlation,
    NoiseCeiling,
    assess,
    correlate,
    near_optimum,
    noise_ceiling,
    upper_half,
)
from .criteria import Criterion
from .drawing import NEAR, OPTIMAL, RANDOM, DrawnPlacements, PlacementsStudySettings
from .precision import Precisions

SCHEMA = "seip-placements-study/1"
LEAST_PRECISION = 0.1  # AP below which a detector supports no conclusion
POINT = 0.01  # of average precision: what a criterion has to gain to be worth its trouble


@dataclass(frozen=True, eq=False)
class PlacementsStudy:
    """Average precision and criteria of placements of one type and number on one site.

    Parameters
    ----------
    sensor : str
        Catalogue key of the type.
    criteria : tuple of Criterion
        Coverage first.
    """

    site: str
    settings: PlacementsStudySettings
    sensor: str
    drawn: DrawnPlacements
    precise: Precisions
    criteria: tuple[Criterion, ...]

    @cached_property
    def assessed(self) -> tuple[AssessedCriterion, ...]:
        """The criteria beside coverage."""
        return assess(self.criteria, self.precise)

    @cached_property
    def ceiling(self) -> NoiseCeiling:
        """How well a criterion could do."""
        return noise_ceiling(self.precise)

    @cached_property
    def parts(self) -> dict[str, Correlation]:
        """How coverage does over some of the placements, by what these are."""
        coverage = self.criteria[0]
        which = {
            "the random placements alone": np.array([kind == RANDOM for kind in self.drawn.kind]),
            f"the upper half of coverage, {np.median(coverage.values):.1%} and more": upper_half(coverage),
            f"placements within {100 * NEAR:g} points of the optimal coverage": near_optimum(coverage),
        }
        return {name: correlate(coverage, self.precise, some) for name, some in which.items()}

    @property
    def title(self) -> str:
        """Name of the study in charts."""
        return f"{self.site}: {len(self.criteria[0].values)} placements of {self.settings.count} × {self.sensor}"

    def sentences(self) -> Iterator[str]:
        """Yield what the figures say."""
        values = self.precise.values
        optimal = self.precise.interval(0)
        between = "" if optimal is None else f" ({optimal[0]:.1%} to {optimal[1]:.1%})"
        yield (
            f"{self.title}: AP@0.7 from {values.min():.1%} to {values.max():.1%}, {values[0]:.1%}{between} where "
            "coverage is optimal"
        )
        coverage, *others = self.assessed
        yield (
            f"coverage and AP@0.7: Spearman {_written(coverage.correlation.spearman)}, "
            f"Kendall {_written(coverage.correlation.kendall)}"
        )
        yield self._of_ceiling()
        for name, part in self.parts.items():
            yield f"over {name} ({part.placements}): Spearman {_written(part.spearman)}; {_predicts(part)}"
        for one in others:
            yield (
                f"{one.criterion.name}: Spearman {_written(one.correlation.spearman)}, against coverage "
                f"{_written(one.difference, signed=True)}; AP of the placement that it likes best, against that of "
                f"coverage: {_points(one.gain)}"
            )
        if values.max() < LEAST_PRECISION:
            yield (
                f"this supports no conclusion: the AP@0.7 of the detector is below {LEAST_PRECISION:.0%} "
                "everywhere, so train it for more steps"
            )
            return
        yield self._of_correlations()
        yield self._of_gains()

    def _of_ceiling(self) -> str:
        ceiling = self.ceiling
        trainings = (
            "of one training, so that trainings are taken to agree"
            if ceiling.trainings is None
            else f"two trainings {_written(ceiling.trainings)}"
        )
        return (
            f"two halves of the test runs agree with Spearman {_written(ceiling.halves)}, {trainings}: a criterion "
            f"without error would reach {_written(ceiling.ceiling)}"
        )

    @property
    def _beforehand(self) -> list[AssessedCriterion]:
        return [one for one in self.assessed[1:] if one.criterion.beforehand]

    def _of_correlations(self) -> str:
        better = [one for one in self._beforehand if 0 < one.difference.low < math.inf]
        if better:
            named = " and ".join(f"{one.criterion.name} ({_written(one.difference, signed=True)})" for one in better)
            return f"better than coverage, of {len(self._beforehand)} criteria that can be had beforehand: {named}"
        most = max(self._beforehand, key=lambda one: one.difference.value)
        return (
            "no criterion that can be had beforehand correlates better than coverage beyond doubt; the best of "
            f"{len(self._beforehand)} is {most.criterion.name}, {_written(most.difference, signed=True)}"
        )

    def _of_gains(self) -> str:
        standing = [one for one in self._beforehand if POINT <= one.gain.low < math.inf]
        if standing:
            named = " and ".join(f"{one.criterion.name} ({_points(one.gain)})" for one in standing)
            return f"a point or more of AP that the interval leaves standing is gained by {named}"
        most = max(self._beforehand, key=lambda one: one.gain.value)
        if most.gain.value <= 0:
            return (
                "no criterion that can be had beforehand gains anything: none likes a placement best that detects more "
                "than the one that coverage likes best"
            )
        return (
            "no criterion that can be had beforehand gains a point of AP that its interval leaves standing; the most "
            f"has {most.criterion.name}: {_points(most.gain)}"
        )


def save_study(
    folder: Path,
    study: PlacementsStudy,
    settings: Mapping[str, Any],
    traffic: Traffic,
    versions: Mapping[str, str],
) -> None:
    """Write ``placements.csv``, ``placements.json`` and the charts into a folder."""
    rows = [_row(study, number) for number in range(len(study.drawn.evaluated))]
    save_csv(folder / "placements.csv", list(rows[0]), [list(row.values()) for row in rows])
    save_json(folder / "placements.json", _record(study, settings, traffic, versions))
    values, coverage = study.precise.values, study.criteria[0].values
    marks = [
        PlacementMark(kind, float(coverage[number]), float(values[number]), study.precise.interval(number))
        for number, kind in enumerate(study.drawn.kind)
    ]
    found = study.assessed[0].correlation.spearman
    save_placements_chart(folder / "coverage_and_ap.png", marks, f"Spearman ρ = {_written(found)}", study.title)
    bars = [
        CriterionBar(one.criterion.name, one.correlation.spearman, one.criterion.beforehand) for one in study.assessed
    ]
    save_criteria_chart(folder / "criteria.png", bars, study.ceiling.ceiling, study.title)


def _row(study: PlacementsStudy, number: int) -> dict[str, str]:
    placement, interval = study.drawn.evaluated[number], study.precise.interval(number)
    low, high = ("", "") if interval is None else (f"{end:.4f}" for end in interval)
    sensors = placement.deployment.sensors
    return {
        "placement": OPTIMAL if number == 0 else placement.name,
        "kind": study.drawn.kind[number],
        "poses": " ".join(f"{sensor.pose}" for sensor in sensors),
        "positions": "; ".join(f"{sensor.position_name} at {sensor.height:g} m" for sensor in sensors),
        "ap": f"{study.precise.values[number]:.4f}",
        "ap_low": low,
        "ap_high": high,
        **{f"ap_{seed}": f"{own[number]:.4f}" for seed, own in enumerate(study.precise.by_training, start=1)},
        **{
            f"ap_{name.replace('-', '_')}": f"{values[number]:.4f}" for name, values in study.precise.of_classes.items()
        },
        **{one.key: f"{one.values[number]:.4f}" for one in study.criteria},
    }


def _record(
    study: PlacementsStudy, settings: Mapping[str, Any], traffic: Traffic, versions: Mapping[str, str]
) -> dict[str, Any]:
    ceiling = study.ceiling
    return {
        "schema": SCHEMA,
        "site": study.site,
        "sensor": study.sensor,
        "settings": {**settings, **asdict(study.settings)},
        "versions": dict(versions),
        "traffic": {
            what: [{"name": run.name, "key": run.key, "frames": len(run.times)} for run in runs]
            for what, runs in vars(traffic).items()
        },
        "placements": [
            {
                "name": row["placement"],
                "kind": row["kind"],
                "sensors": [
                    {"pose": sensor.pose, "position": sensor.position_name, "xyz": sensor.xyz.tolist()}
                    for sensor in placement.deployment.sensors
                ],
                "average_precision": float(study.precise.values[number]),
                "interval": study.precise.interval(number),
                "by_training": study.precise.by_training[:, number].tolist(),
                "of_classes": {name: _finite(values[number]) for name, values in study.precise.of_classes.items()},
                "criteria": {one.key: float(one.values[number]) for one in study.criteria},
            }
            for number, placement in enumerate(study.drawn.evaluated)
            for row in [_row(study, number)]
        ],
        "training_placements": [
            [sensor.pose for sensor in placement.deployment.sensors] for placement in study.drawn.training
        ],
        "criteria": [
            {
                "key": one.criterion.key,
                "name": one.criterion.name,
                "beforehand": one.criterion.beforehand,
                "spearman": _estimate(one.correlation.spearman),
                "kendall": _estimate(one.correlation.kendall),
                "spearman_less_that_of_coverage": _estimate(one.difference),
                "best_placement": study.drawn.evaluated[one.best].name if one.best else OPTIMAL,
                "gain": _estimate(one.gain),
            }
            for one in study.assessed
        ],
        "coverage_over": [
            {"what": name, "placements": part.placements, "spearman": _estimate(part.spearman)}
            for name, part in study.parts.items()
        ],
        "noise_ceiling": {
            "halves_of_test_runs": _estimate(ceiling.halves),
            "trainings": None if ceiling.trainings is None else _estimate(ceiling.trainings),
            "reliability": _estimate(ceiling.reliability),
            "ceiling": _estimate(ceiling.ceiling),
        },
        "sentences": list(study.sentences()),
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _estimate(estimate: IntervalEstimate) -> dict[str, Any]:
    value, low, high = estimate.value, estimate.low, estimate.high
    return {
        "value": _finite(value),
        "interval": [low, high] if math.isfinite(high - low) else None,
    }


def _written(estimate: IntervalEstimate, *, signed: bool = False) -> str:
    """Return a correlation with its interval, in words."""
    if math.isnan(estimate.value):
        return "none, where all are equal"
    form = "+.2f" if signed else ".2f"
    between = f" [{estimate.low:{form}}, {estimate.high:{form}}]" if math.isfinite(estimate.high - estimate.low) else ""
    return f"{estimate.value:{form}}{between}"


def _points(estimate: IntervalEstimate) -> str:
    value, low, high = (100 * part for part in (estimate.value, estimate.low, estimate.high))
    between = f" [{low:+.1f}, {high:+.1f}]" if math.isfinite(high - low) else ""
    return f"{value:+.1f} points{between}"


def _predicts(part: Correlation) -> str:
    if not math.isfinite(part.spearman.low):
        return "too few to test whether coverage predicts detection"
    if part.spearman.low > 0:
        return "coverage predicts detection here as well"
    return "no significant correlation there"
