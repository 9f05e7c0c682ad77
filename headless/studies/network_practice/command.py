"""Value of a network's allocation against common practices with the same money.

seip study network-practice city/ -o out/practice
seip study network-practice city/ --runs 2 -o out/practice

With --runs, the shipped detector is evaluated with the placements of each practice in simulated traffic at every site;
this needs torch and SUMO (make detection sumo), and a network that was built from extracts.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from headless import runtime
from headless.network_run import poses_of
from headless.network_tasks import SURVEY_FILES
from headless.options import new_parser, whole_number
from headless.studies.network_practice.practices import PRACTICES, Chosen

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.choosing.network.site_problem import SiteProblem
from seip_addon.core.errors import SeipError
from seip_addon.core.estimates import IntervalEstimate, student_reach
from seip_addon.core.limits import Limits
from seip_addon.core.output.network.network_record import NetworkRecord, load_network
from seip_addon.core.storage.csv_table import save_csv
from seip_addon.core.storage.files import save_json
from seip_addon.core.storage.json_dataclass import as_json

if TYPE_CHECKING:
    from headless.detection.frame_results import FrameResult

ALLOCATION = "allocation"
COLUMNS = ("practice", "site", "weight", "sensors", "price_usd", "value", "coverage")


def main(argv: list[str]) -> None:
    """Compare the allocation in the folder of a network with common practices, and write the figures."""
    options = _parser().parse_args(argv)
    record = load_network(options.folder / "network.json")
    runtime.check_folder(options.output)
    good = [site for site in record.sites if site.status != "failed"]
    if len(good) < 2 or len(record.budgets_usd) > 1 or record.goal is not None:
        raise SeipError(f"{options.folder} must be a network of at least two sites with one budget")
    problems = [SiteProblem.load(options.folder / site.folder / SURVEY_FILES[3])[0] for site in good]
    weights = np.array([site.weight for site in good])
    money = record.budgets_usd[0]
    rows: list[tuple[object, ...]] = []
    chosen = {
        ALLOCATION: [poses_of(site.name, problem, site.sensors) for site, problem in zip(good, problems, strict=True)]
    }
    for name, practice in PRACTICES.items():
        runtime.LOG.info("%s …", name)
        chosen[name] = practice(problems, weights, money)
    values: dict[str, Float] = {}
    for name, taken in chosen.items():
        values[name] = np.array([site.value(poses) for site, poses in zip(problems, taken, strict=True)])
        for site, problem, poses, value in zip(good, problems, taken, values[name].tolist(), strict=True):
            price = math.fsum(problem.prices[list(poses)])
            rows.append((name, site.name, site.weight, len(poses), price, value, problem.coverage(poses)))
    save_csv(options.output / "practices.csv", COLUMNS, rows)
    figures = compared(record, values, weights)
    if options.runs:
        folders = [options.folder / site.folder for site in good]
        for name, precision in _precision(folders, problems, chosen, options.runs, options.output).items():
            figures[name]["average_precision"] = precision
    save_json(options.output / "practices.json", figures)
    for name, one in figures.items():
        runtime.print_line(f"{name}: {one['text']}")
    _print_precision(figures)


def _precision(
    folders: Sequence[Path],
    problems: Sequence[SiteProblem],
    chosen: Mapping[str, Sequence[Chosen]],
    runs: int,
    output: Path,
) -> dict[str, dict[str, dict[str, object]]]:
    """Return the average precision of practices by class of road users, over all sites."""
    from headless.studies.network_practice.detection import (  # noqa: PLC0415 -- needs torch
        compare_precision,
        detect_at_site,
    )

    results: dict[str, list[FrameResult]] = {name: [] for name in chosen}
    for number, (folder, problem) in enumerate(zip(folders, problems, strict=True)):
        runtime.LOG.info("site %d of %d, %s", number + 1, len(folders), folder.name)
        here = {name: taken[number] for name, taken in chosen.items()}
        found = runtime.finish_with_bar(detect_at_site(folder, problem, here, runs, output / folder.name))
        for name, frames in found.items():
            results[name] += frames
    return {
        name: {kind: as_json(one) for kind, one in of_classes.items()}
        for name, of_classes in compare_precision(results, ALLOCATION).items()
    }


def _print_precision(figures: Mapping[str, Mapping[str, Any]]) -> None:
    for name, one in figures.items():
        for kind, found in one.get("average_precision", {}).items():
            value, gain = (IntervalEstimate(**found[part]) for part in ("value", "gain"))
            more = "" if name == ALLOCATION else f"; with the allocation {gain.as_change(1)}"
            runtime.print_line(f"{name}: average precision of {kind} {value.describe(1)}{more}")


def compared(record: NetworkRecord, values: dict[str, Float], weights: Float) -> dict[str, dict[str, object]]:
    """Return for each practice its value, and by how much the allocation exceeds it, with 95 % intervals over sites."""
    share = weights / weights.sum()
    figures: dict[str, dict[str, object]] = {}
    for name, of_sites in values.items():
        value = float(share @ of_sites)
        gains = (values[ALLOCATION] - of_sites) * share * len(share)
        mean, reach = float(gains.mean()), student_reach(gains)
        low, high = mean - reach, mean + reach
        if record.criterion == "returns":
            text = f"{math.expm1(value):,.0f} returns from a typical road user"
            more = (
                f"the allocation has {math.exp(mean):.2f} times as many (95 % interval over sites "
                f"{math.exp(low):.2f} to {math.exp(high):.2f})"
            )
        else:
            text = f"{value:.1%} of the road seen"
            more = f"the allocation sees {100 * mean:+.1f} points more ({100 * low:+.1f} to {100 * high:+.1f})"
        full = text if name == ALLOCATION else f"{text}; {more}"
        figures[name] = {"value": value, "gain": mean, "low": low, "high": high, "text": full}
    return figures


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("study network-practice", "Compare the allocation of a network with common practices.")
    parser.add_argument("folder", type=Path, help="result folder of `seip network`")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    parser.add_argument(
        "--runs",
        type=whole_number(Limits(0, 64)),
        default=0,
        metavar="N",
        help="runs of simulated traffic at each site in which road users are detected (0: none)",
    )
    return parser
