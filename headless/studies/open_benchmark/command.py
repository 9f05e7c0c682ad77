"""Open benchmark of placement criteria, on ten junctions.

seip study open-benchmark --build --extracts osm/ -o out/benchmark
seip study open-benchmark --criterion mine.csv
seip study open-benchmark --placement borough placed.blend -o out/benchmark
seip study open-benchmark --chart borough -o out/benchmark

docs/open-benchmark.md describes the benchmark. --criterion needs only the table; the other actions need torch and SUMO
(make detection sumo). An interrupted build resumes.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from headless import runtime
from headless.options import new_parser
from headless.studies.open_benchmark.choices import choice_losses, measure_seconds, save_speed_accuracy_chart
from headless.studies.open_benchmark.sites import BenchmarkSite, build_benchmark_site, read_sites
from headless.studies.open_benchmark.table import (
    AP,
    CRITERIA,
    CriterionScore,
    Placements,
    criterion_column,
    read_criterion,
    read_table,
    save_table,
    score,
    table_rows,
)

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.estimates import IntervalEstimate
from seip_addon.core.storage.csv_table import save_csv

SENSOR, COUNT, PLACEMENTS, EVERY = "os1_128", 2, 100, 10.0
"""Type and number of sensors of each placement, number of random placements per site, and seconds between frames."""
TABLE = Path(__file__).resolve().parents[3] / "docs" / "open-benchmark" / "placements.csv"
SCORE_COLUMNS = ("criterion", "road_users", "sites", "spearman", "low", "high", "loss", "loss_low", "loss_high")
CRITERIA_FOLDER, TABLE_FILE = "criteria", "placements.csv"
CHOICE_COLUMNS = ("choice", "loss", "loss_low", "loss_high", "seconds")

TABLE_DETECTOR = "1492989c9f7a925fc2cf1239dc4a1cee90cefd2b76cdd55a300bc3d6da290bc4"
"""Digest of the detector with which the shipped table was measured; update it with the table."""


def main(argv: list[str]) -> None:
    """Build the benchmark, score a criterion or a placement on it, or chart the loss of choices against their time."""
    options = _parser().parse_args(argv)
    if options.criterion is not None:
        table = read_table(options.table)
        scores = score(options.table, table, read_criterion(options.criterion, table))
        _print_scores({options.criterion.stem: scores, **_known_scores(options.table, table)})
        return
    if options.output is None:
        raise SeipError("name the folder of the benchmark with -o")
    runtime.check_folder(options.output)
    if options.placement is not None:
        _score_placement(options)
    elif options.chart is not None:
        _chart(options)
    else:
        _build(options)


def _build(options: argparse.Namespace) -> None:
    """Build the sites, evaluate their placements, and write the tables of placements and of scores."""
    from headless.studies.criteria import command as criteria  # noqa: PLC0415 -- needs torch

    if options.extracts is None:
        raise SeipError("name the folder with the extracts of the real sites with --extracts")
    rows: list[Sequence[object]] = []
    for site in _chosen(options.site):
        folder = options.output / site.name
        runtime.LOG.info("%s: %s", site.name, site.about)
        scene = runtime.finish_with_bar(build_benchmark_site(site, folder, options.extracts))
        study = ["--sensor", SENSOR, "--count", str(COUNT), "--placements", str(PLACEMENTS), "--every", str(EVERY)]
        criteria.main([str(scene), *study, "-o", str(folder / CRITERIA_FOLDER)])
        record = json.loads((folder / CRITERIA_FOLDER / "criteria.json").read_text(encoding="utf-8"))
        rows += table_rows(site.name, record["types"][0]["placements"])
    path = options.output / TABLE_FILE
    save_table(path, rows)
    scores = _known_scores(path, read_table(path))
    figures = [
        (name, one.road_users, one.sites, *_parts(one.spearman, 1.0), *_parts(one.loss, 100.0))
        for name, own in scores.items()
        for one in own
    ]
    save_csv(options.output / "scores.csv", SCORE_COLUMNS, figures)
    _print_scores(scores)
    runtime.print_line(f"written to {options.output}/: {TABLE_FILE} and scores.csv")


def _score_placement(options: argparse.Namespace) -> None:
    """Evaluate the sensors of a scene at a built site, and print their rank among the placements in the table."""
    from headless.detection.detector import SHIPPED_DETECTOR, Detector  # noqa: PLC0415 -- needs torch
    from headless.studies.open_benchmark.placement import placement_precision  # noqa: PLC0415 -- needs torch

    name, scene = options.placement
    (site,) = _chosen([name])
    others = read_table(options.table).get(site.name, [])
    precisions, sensors = runtime.finish_with_bar(
        placement_precision(options.output / site.name, Path(scene), EVERY, options.output)
    )
    for road_users, precision in precisions.items():
        column = AP[road_users]
        table = [float(row[column]) for row in others if row[column]]
        worse = sum(value < precision.value for value in table)
        runtime.print_line(
            f"{road_users}: average precision {precision.describe(1)}, above {worse} of {len(table)} placements of "
            f"{COUNT} × {SENSOR}"
        )
    if Detector.load(SHIPPED_DETECTOR).key != TABLE_DETECTOR:
        runtime.warn(["the table was measured with another detector than this placement: its ranks are not comparable"])
    if sensors != (SENSOR,) * COUNT:
        runtime.warn([f"this placement has {', '.join(sensors)}, those of the benchmark {COUNT} × {SENSOR}"])


def _chart(options: argparse.Namespace) -> None:
    """Measure the processor time of each choice at a built site, and chart it against the loss in the table."""
    (site,) = _chosen([options.chart])
    scene = options.output / site.name / "site.blend"
    if not scene.is_file():
        raise SeipError(f"{scene} is not there: build the site first, with --build --site {site.name}")
    losses = choice_losses(options.table, read_table(options.table))
    seconds = measure_seconds(scene, SENSOR, COUNT)
    rows = [
        (name, *(f"{figure:.2f}" for figure in _parts(loss, 100.0)), f"{seconds[name]:.1f}" if name in seconds else "")
        for name, loss in losses.items()
    ]
    save_csv(options.output / "choices.csv", CHOICE_COLUMNS, rows)
    save_speed_accuracy_chart(
        options.output / "speed_accuracy.png", seconds, losses, "Choice of two OS1-128: time against accuracy"
    )
    for row in rows:
        runtime.print_line("{:14} loses {} points [{}, {}] {} s".format(*row))
    runtime.print_line(f"written to {options.output}/: choices.csv and speed_accuracy.png")


def _chosen(names: Sequence[str]) -> tuple[BenchmarkSite, ...]:
    """Return the named sites, or all sites without names."""
    sites = {site.name: site for site in read_sites()}
    unknown = next((name for name in names if name not in sites), None)
    if unknown is not None:
        raise SeipError(f"the benchmark has no site {unknown!r}, but {', '.join(sites)}")
    return tuple(sites[name] for name in names or sites)


def _known_scores(path: Path, table: Placements) -> dict[str, list[CriterionScore]]:
    """Return the scores of the criteria in the table."""
    columns = {key: criterion_column(path, table, key) for key in CRITERIA}
    return {key: score(path, table, values) for key, values in columns.items() if values}


def _print_scores(scores: Mapping[str, Sequence[CriterionScore]]) -> None:
    runtime.print_line("mean over sites with 95 % intervals; loss: average precision below the best placement, points")
    for name, own in scores.items():
        for one in own:
            rank = "{:+.2f} [{:+.2f}, {:+.2f}]".format(*_parts(one.spearman, 1.0))
            loss = "{:.1f} [{:.1f}, {:.1f}]".format(*_parts(one.loss, 100.0))
            runtime.print_line(f"{name:20} {one.road_users:13} {one.sites:2} sites  Spearman {rank}  loss {loss}")


def _parts(estimate: IntervalEstimate, scale: float) -> tuple[float, ...]:
    """Return value, lower and upper bound, each times ``scale``."""
    return scale * estimate.value, scale * estimate.low, scale * estimate.high


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("study open-benchmark", "Score placement criteria and placements on ten junctions.")
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--build", action="store_true", help="build the sites and the table of placements")
    action.add_argument(
        "--criterion", type=Path, metavar="CSV", help="score a criterion: site, placement, value (more is better)"
    )
    action.add_argument(
        "--placement", nargs=2, metavar=("SITE", "BLEND"), help="evaluate the sensors of a scene at a built site"
    )
    action.add_argument("--chart", metavar="SITE", help="chart the loss of choices against their time at a built site")
    parser.add_argument("-o", "--output", type=Path, help="folder of the benchmark")
    parser.add_argument("--extracts", type=Path, metavar="FOLDER", help="extracts of the real sites, for --build")
    parser.add_argument(
        "--site", nargs="+", default=[], metavar="NAME", help=f"sites to build (all): {', '.join(_names())}"
    )
    parser.add_argument("--table", type=Path, default=TABLE, metavar="CSV", help="table of the benchmark's placements")
    return parser


def _names() -> list[str]:
    return [site.name for site in read_sites()]
