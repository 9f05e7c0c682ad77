"""Charts and tables of the detection study."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from headless.charts.error_view import save_error_view
from headless.detection.recordings import Simulator
from headless.detection.rules import MAIN_RULE, RULES, precisions
from headless.detection_results import error_view
from headless.studies.rank_correlation import rank_correlation

import numpy as np

from seip_addon.core.base.estimates import SHARE, Interval
from seip_addon.core.storage.csv_table import save_csv

from .case_study import DetectorOutcome, Traffic
from .claims import mean_interval
from .price_chart import PrecisionCell, save_price_chart

_NO_ENDS = (math.nan, math.nan)


@dataclass(frozen=True, eq=False)
class StudyResults:
    """Results of the study on one site."""

    name: str
    simulator: Simulator
    traffic: Traffic
    outcomes: tuple[DetectorOutcome, ...]

    @property
    def cells(self) -> tuple[PrecisionCell, ...]:
        """Each type and number of sensors with the average precision of all its seeds."""
        grouped: dict[str, list[DetectorOutcome]] = {}
        for outcome in self.outcomes:
            grouped.setdefault(outcome.configuration.name, []).append(outcome)
        cells = []
        for own in grouped.values():
            placed, values = own[0].configuration, tuple(one.evaluation.average_precision for one in own)
            interval = mean_interval(values, SHARE) if len(values) > 1 else None
            deployment = placed.deployment
            cells.append(
                PrecisionCell(placed.sensor, placed.count, deployment.price, deployment.coverage, values, interval)
            )
        return tuple(cells)


def save_charts(folder: Path, results: StudyResults) -> None:
    """Draw every chart of the study into a folder."""
    save_price_chart(folder / "ap_by_price.png", results.cells, results.name)
    first = [one for one in results.outcomes if one.seed == 1]
    for sensor in dict.fromkeys(one.configuration.sensor for one in first):
        own = [one for one in first if one.configuration.sensor == sensor]
        _save_errors(folder / f"errors_{sensor}.png", results, own)


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
            sensors=one.configuration.positions,
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
    result, by_rule = outcome.seed_result, precisions(outcome.frames)
    return {
        "sensor": result.sensor,
        "count": f"{result.count}",
        "seed": f"{result.seed}",
        "price_usd": f"{result.price:.2f}",
        "coverage": f"{result.coverage:.4f}",
        **{
            f"ap_{name}{end}": "" if math.isnan(value) else f"{value:.4f}"
            for name, found in by_rule.items()
            for end, value in zip(
                ("", "_low", "_high"), (found.average_precision, *(found.interval or _NO_ENDS)), strict=True
            )
        },
        **{f"road_users_{name}": f"{found.road_users}" for name, found in by_rule.items()},
        "score": f"{outcome.score:.4f}",
        "false_positives_per_frame": f"{result.false_positives:.4f}",
        "false_positives_in_sparse_places": "" if np.isnan(result.sparse) else f"{result.sparse:.4f}",
        "frames": f"{len(outcome.frames)}",
    }


def describe(results: StudyResults) -> Iterator[str]:
    """Yield lines for each configuration, and one on the correlation of coverage and average precision."""
    for cell in results.cells:
        yield (
            f"{cell.name}: AP {cell.mean:.1%}{_between(cell.interval)} of vehicles at an overlap of 0.7 in plan, "
            f"coverage {cell.coverage:.1%}, ${cell.price:,.0f}"
        )
        yield f"  {_by_rules(results, cell.name)}"
    coverage, precision = np.array([(cell.coverage, cell.mean) for cell in results.cells]).T
    yield f"rank correlation of coverage and AP: {rank_correlation(coverage, precision):.2f}"


def _by_rules(results: StudyResults, name: str) -> str:
    """Return the average precision of one configuration by the other rules, averaged over trainings, as a message."""
    tables = [precisions(one.frames) for one in results.outcomes if one.configuration.name == name]
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
