"""Value of a network's allocation against common practices with the same money.

seip study network-practice city/ -o out/practice
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from headless import runtime
from headless.network_tasks import SURVEY_FILES
from headless.options import new_parser
from headless.studies.network_practice.practices import PRACTICES

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.choosing.network.site_problem import SiteProblem
from seip_addon.core.errors import SeipError
from seip_addon.core.estimates import student_reach
from seip_addon.core.output.network.network_record import NetworkRecord, load_network
from seip_addon.core.storage.csv_table import save_csv
from seip_addon.core.storage.files import save_json

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
    values = {"allocation": np.array([site.value for site in good])}
    rows += [
        ("allocation", site.name, site.weight, len(site.sensors), site.price_usd, site.value, site.coverage)
        for site in good
    ]
    for name, practice in PRACTICES.items():
        runtime.LOG.info("%s …", name)
        chosen = practice(problems, weights, money)
        values[name] = np.array([site.value(poses) for site, poses in zip(problems, chosen, strict=True)])
        for site, problem, poses, value in zip(good, problems, chosen, values[name].tolist(), strict=True):
            price = math.fsum(problem.prices[list(poses)])
            row = (name, site.name, site.weight, len(poses), price, value, problem.coverage(poses))
            rows.append(row)
    save_csv(options.output / "practices.csv", COLUMNS, rows)
    figures = compared(record, values, weights)
    save_json(options.output / "practices.json", figures)
    for name, one in figures.items():
        runtime.print_line(f"{name}: {one['text']}")


def compared(record: NetworkRecord, values: dict[str, Float], weights: Float) -> dict[str, dict[str, object]]:
    """Return for each practice its value, and by how much the allocation exceeds it, with 95 % intervals over sites."""
    share = weights / weights.sum()
    figures: dict[str, dict[str, object]] = {}
    for name, of_sites in values.items():
        value = float(share @ of_sites)
        gains = (values["allocation"] - of_sites) * share * len(share)
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
        full = text if name == "allocation" else f"{text}; {more}"
        figures[name] = {"value": value, "gain": mean, "low": low, "high": high, "text": full}
    return figures


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("study network-practice", "Compare the allocation of a network with common practices.")
    parser.add_argument("folder", type=Path, help="result folder of `seip network`")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    return parser
