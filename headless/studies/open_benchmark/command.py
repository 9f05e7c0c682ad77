"""Open benchmark of placement criteria, on ten junctions.

seip study open-benchmark --build --extracts osm/ -o out/benchmark
seip study open-benchmark --criterion mine.csv

docs/open-benchmark.md describes the benchmark. --criterion needs only the table; --build needs torch and SUMO
(make detection sumo). An interrupted build resumes.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from headless import runtime
from headless.options import new_parser
from headless.studies.open_benchmark.sites import build_benchmark_site, read_sites
from headless.studies.open_benchmark.table import (
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


def main(argv: list[str]) -> None:
    """Build the benchmark, or score a criterion on it."""
    options = _parser().parse_args(argv)
    if options.criterion is not None:
        table = read_table(options.table)
        scores = score(options.table, table, read_criterion(options.criterion, table))
        _print_scores({options.criterion.stem: scores, **_known_scores(options.table, table)})
    else:
        _build(options)


def _build(options: argparse.Namespace) -> None:
    """Build the sites, evaluate their placements, and write the tables of placements and of scores."""
    from headless.studies.criteria import command as criteria  # noqa: PLC0415 -- needs torch

    if options.output is None:
        raise SeipError("name the folder of the benchmark with -o")
    if options.extracts is None:
        raise SeipError("name the folder with the extracts of the real sites with --extracts")
    runtime.check_folder(options.output)
    sites = {site.name: site for site in read_sites()}
    rows: list[Sequence[object]] = []
    for site in (sites[name] for name in options.site):
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
    parser = new_parser("seip study open-benchmark", "Score placement criteria on ten junctions.")
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--build", action="store_true", help="build the sites and the table of placements")
    action.add_argument(
        "--criterion", type=Path, metavar="CSV", help="score a criterion: site, placement, value (more is better)"
    )
    parser.add_argument("-o", "--output", type=Path, help="folder of the benchmark")
    parser.add_argument("--extracts", type=Path, metavar="FOLDER", help="extracts of the real sites, for --build")
    names = [site.name for site in read_sites()]
    parser.add_argument("--site", nargs="+", choices=names, default=names, metavar="NAME", help="sites to build")
    parser.add_argument("--table", type=Path, default=TABLE, metavar="CSV", help="table of the benchmark's placements")
    return parser
