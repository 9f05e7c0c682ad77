"""Charts, tables and records of the detection study."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from headless.charts.detection import (
    Bin,
    BinnedFigure,
    save_parts_chart,
    save_precision_recall_chart,
    save_training_chart,
)
from headless.charts.error_view import save_error_view
from headless.detection.breakdown import DISTANCE_EDGES, POINT_EDGES, average_precision_by, recall_by
from headless.detection.recordings import Simulator
from headless.detection.rules import MAIN_RULE, RULES
from headless.detection.training import LearningCurve, TrainedDetector
from headless.detection_results import curve, error_view
from headless.studies.claims import Claim
from headless.studies.false_positives import DENSITY_EDGES, false_by
from headless.studies.mean_over_seeds import mean_interval
from headless.studies.precision_charts import PrecisionCell, save_count_chart, save_coverage_chart, save_price_chart
from headless.studies.rank_correlation import rank_correlation, rank_correlation_interval

import numpy as np

from seip_addon.core.estimates import SHARE, Interval
from seip_addon.core.storage.csv_table import save_csv
from seip_addon.core.storage.files import save_json

from .case_study import DetectorOutcome, ModelConfiguration, Traffic, still_rises
from .claims import SeedResult

SCHEMA = "seip-evaluation/2"
VISIBILITY_EDGES = (0.0, 0.1, 0.25, 0.5, 0.75, 0.95, np.inf)

_NO_ENDS = (math.nan, math.nan)


@dataclass(frozen=True, eq=False)
class StudyResults:
    """Results of the study on one site; models and their learning curves are in the same order."""

    name: str
    simulator: Simulator
    traffic: Traffic
    models: tuple[ModelConfiguration, ...]
    outcomes: tuple[DetectorOutcome, ...]
    curves: tuple[LearningCurve, ...]

    @property
    def seed_results(self) -> list[SeedResult]:
        """Figures of all types and numbers of sensors, each with whether its training was still improving."""
        rising = {model.name: still_rises(curve) for model, curve in zip(self.models, self.curves, strict=True)}
        return [
            replace(one.seed_result, still_rising=rising[one.model.name])
            for one in self.outcomes
            if not one.configuration.read
        ]

    @property
    def masked(self) -> list[DetectorOutcome]:
        """Outcomes without the ablation."""
        return [outcome for outcome in self.outcomes if not outcome.model.network.padded]

    @property
    def first(self) -> list[DetectorOutcome]:
        """Outcomes of the first training for each configuration, for charts that show only one."""
        found: dict[str, DetectorOutcome] = {}
        for outcome in self.masked:
            found.setdefault(outcome.configuration.name, outcome)
        return list(found.values())

    @property
    def correlation(self) -> tuple[float, Interval | None]:
        """Rank correlation of coverage and average precision over the configurations, with its interval."""
        points = cells([outcome.seed_result for outcome in self.masked])
        coverage, precision = [cell.coverage for cell in points], [cell.mean for cell in points]
        return rank_correlation(coverage, precision), rank_correlation_interval(coverage, precision, seed=0)


def save_charts(folder: Path, results: StudyResults, trained: Sequence[TrainedDetector]) -> None:
    """Draw every chart of the study into a folder."""
    points = cells([outcome.seed_result for outcome in results.masked])
    save_count_chart(folder / "ap_by_count.png", points, results.name)
    save_price_chart(folder / "ap_by_price.png", points, results.name)
    save_coverage_chart(folder / "ap_by_coverage.png", points, *results.correlation, results.name)
    curves = [curve(one.configuration.sensor, one.configuration.count, one.evaluation) for one in results.first]
    save_precision_recall_chart(folder / "precision_recall.png", curves, results.name)
    for sensor in dict.fromkeys(one.configuration.sensor for one in results.first):
        own = [one for one in results.first if one.configuration.sensor == sensor]
        save_parts_chart(folder / f"where_{sensor}.png", _parts(own), f"{results.name}, {sensor}")
        _save_errors(folder / f"errors_{sensor}.png", results, own)
    for model, one in zip(results.models, trained, strict=True):
        save_training_chart(folder / f"{model.name}.png", one.curve.loss, one.curve.validation, model.name)


def _parts(outcomes: Sequence[DetectorOutcome]) -> list[BinnedFigure]:
    """Return the panels of detected road users and false detections by distance, returns, visibility and density."""

    def panel(what: str, figure: str, bins: Callable[[DetectorOutcome], Sequence[Bin]]) -> BinnedFigure:
        return what, figure, {one.configuration.name: bins(one) for one in outcomes}

    return [
        panel(
            "distance to the nearest sensor (m)",
            "average precision",
            lambda one: average_precision_by(one.evaluation, "distance", DISTANCE_EDGES),
        ),
        panel(
            "returns from the road user",
            "average precision",
            lambda one: average_precision_by(one.evaluation, "points", POINT_EDGES),
        ),
        panel(
            "share of the road user that is not hidden",
            "recall",
            lambda one: recall_by(one.evaluation, "visibility", VISIBILITY_EDGES, one.score),
        ),
        panel(
            "returns per square metre around it",
            "false positives per frame",
            lambda one: false_by(one.evaluation, "density", DENSITY_EDGES, one.score),
        ),
    ]


def _save_errors(path: Path, results: StudyResults, outcomes: Sequence[DetectorOutcome]) -> None:
    """Draw the test frame with the most road users, with the detections of each configuration."""
    run = results.traffic.test[0]
    inside = [int(frame.truth.inside.sum()) for frame in outcomes[0].frames[: len(run.times)]]
    number = int(np.argmax(inside))
    views = [
        error_view(
            f"{one.configuration.name}: AP {one.evaluation.average_precision:.2f} over all frames",
            one.frames[number],
            MAIN_RULE,
            score=one.score,
            cloud=results.simulator.frame(one.configuration, run, number).points,
            region=results.simulator.static.region,
            sensors=one.configuration.places,
        )
        for one in outcomes
    ]
    where = f"{results.name}, {run.name} at {run.times[number]:.1f} s"
    save_error_view(path, views, where, results.simulator.static.attribution)


def save_table(path: Path, results: StudyResults) -> None:
    """Write one row for each detector and configuration as CSV."""
    rows = [_row(outcome) for outcome in results.outcomes]
    save_csv(path, list(rows[0]), [list(row.values()) for row in rows])


def _row(outcome: DetectorOutcome) -> dict[str, str]:
    seed_result = outcome.seed_result
    return {
        "detector": outcome.model.name,
        "sensor": seed_result.sensor,
        "count": f"{seed_result.count}",
        "seed": f"{seed_result.seed}",
        "padded": f"{seed_result.padded}".lower(),
        "price_usd": f"{seed_result.price:.2f}",
        "coverage": f"{seed_result.coverage:.4f}",
        **{
            f"ap_{name}{end}": "" if math.isnan(value) else f"{value:.4f}"
            for name, found in outcome.precisions.items()
            for end, value in zip(
                ("", "_low", "_high"), (found.average_precision, *(found.interval or _NO_ENDS)), strict=True
            )
        },
        **{f"road_users_{name}": f"{found.road_users}" for name, found in outcome.precisions.items()},
        "score": f"{outcome.score:.4f}",
        "false_positives_per_frame": f"{seed_result.false_positives:.4f}",
        "false_positives_in_sparse_places": "" if np.isnan(seed_result.sparse) else f"{seed_result.sparse:.4f}",
        "frames": f"{len(outcome.frames)}",
    }


def save_record(
    path: Path, results: StudyResults, claims: Sequence[Claim], settings: Mapping[str, Any], versions: Mapping[str, str]
) -> None:
    """Write settings, sensors, figures and claims as JSON."""
    correlation, interval = results.correlation
    configurations = {one.configuration.name: one.configuration for one in results.outcomes}
    save_json(
        path,
        {
            "schema": SCHEMA,
            "settings": settings,
            "versions": dict(versions),
            "traffic": {
                what: [{"name": run.name, "key": run.key, "frames": len(run.times)} for run in runs]
                for what, runs in vars(results.traffic).items()
            },
            "detectors": [
                {
                    "name": one.name,
                    "network": asdict(one.network),
                    "training": asdict(one.training),
                    "validation": {str(step): value for step, value in curve.validation.items()},
                    "still_rising": still_rises(curve),
                }
                for one, curve in zip(results.models, results.curves, strict=True)
            ],
            "configurations": [
                {
                    "name": name,
                    "coverage": one.deployment.coverage,
                    "status": one.status,
                    "gap": one.gap if math.isfinite(one.gap) else None,
                    "price_usd": one.deployment.price,
                    "sensors": [
                        {"model": sensor.model.key, "xyz": sensor.xyz.tolist(), "position": sensor.position_name}
                        for sensor in one.deployment.sensors
                    ],
                }
                for name, one in configurations.items()
            ],
            "figures": [_row(outcome) for outcome in results.outcomes],
            "coverage_and_ap": {
                "rank_correlation": None if np.isnan(correlation) else correlation,
                "interval": interval,
            },
            "claims": [asdict(claim) for claim in claims],
        },
    )


def describe(results: StudyResults) -> Iterator[str]:
    """Yield lines for each configuration, and one on the correlation of coverage and average precision."""
    for cell in cells([outcome.seed_result for outcome in results.masked]):
        yield (
            f"{cell.name}: AP {cell.mean:.1%}{_between(cell.interval)} of vehicles at an overlap of 0.7 in plan, "
            f"coverage {cell.coverage:.1%}, ${cell.price:,.0f}"
        )
        yield f"  {_by_rules(results, cell.name)}"
    correlation, interval = results.correlation
    between = "" if interval is None else f" ({interval[0]:.2f} to {interval[1]:.2f})"
    found = f"{correlation:.2f}{between}" if math.isfinite(correlation) else "undefined, as all values are equal"
    yield f"rank correlation of coverage and AP: {found}"


def _by_rules(results: StudyResults, name: str) -> str:
    """Return the average precision of one configuration by the other rules, averaged over trainings, as a message."""
    tables = [one.precisions for one in results.masked if one.configuration.name == name]
    words = []
    for rule in RULES:
        values = [table[rule].average_precision for table in tables]
        if RULES[rule] is not MAIN_RULE and tables[0][rule].road_users:
            interval = mean_interval(values, SHARE) if len(values) > 1 else None
            words.append(f"{rule} {np.mean(values):.1%}{_between(interval)}")
    over_traffic = tables[0][next(iter(RULES))].interval
    if over_traffic is not None:
        words.append(f"of the first training over other traffic {over_traffic[0]:.1%} to {over_traffic[1]:.1%}")
    return ", ".join(words)


def _between(interval: Interval | None) -> str:
    return "" if interval is None else f" ({interval[0]:.1%} to {interval[1]:.1%})"


def cells(trials: Sequence[SeedResult]) -> tuple[PrecisionCell, ...]:
    """Return each type and number of sensors with the average precision of all its seeds."""
    grouped: dict[tuple[str, int], list[SeedResult]] = {}
    for trial in trials:
        grouped.setdefault((trial.sensor, trial.count), []).append(trial)
    made = []
    for (sensor, count), own in grouped.items():
        values = tuple(trial.average_precision for trial in own)
        interval = mean_interval(values, SHARE) if len(values) > 1 else None
        made.append(PrecisionCell(sensor, count, own[0].price, own[0].coverage, values, interval))
    return tuple(made)
