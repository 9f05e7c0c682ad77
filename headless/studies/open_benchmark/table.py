"""Table of the open benchmark: placements with average precision and criteria, and scores of criteria on it."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from headless.studies.rank_correlation import rank_correlation

import numpy as np

from seip_addon.core.base.arrays import Float
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.estimates import IntervalEstimate, student_reach
from seip_addon.core.storage.csv_table import save_csv
from seip_addon.core.storage.files import read_small

AP = {"vehicles": "ap_vehicles", "two-wheelers": "ap_two_wheelers", "pedestrians": "ap_pedestrians"}
"""Columns of average precision by class of road users."""
HALVES = {name: (f"{column}_first", f"{column}_second") for name, column in AP.items()}
"""Columns of average precision in the first and in the second half of the runs, by class of road users."""
CRITERIA = ("coverage", "returns", "occupancy_entropy", "egvs", "inspe", "pe_vgop")
"""Columns of criteria, as in `criteria.site_criteria`, which needs torch."""
COLUMNS = ("site", "placement", "kind", "sensors", *AP.values(), *chain.from_iterable(HALVES.values()), *CRITERIA)
FEWEST = 4
"""Number of placements of a site below which criteria are not scored there."""
_MOST_BYTES = 1 << 26

Placements = dict[str, list[dict[str, str]]]
"""Rows of the table by site."""


@dataclass(frozen=True)
class CriterionScore:
    """Score of a criterion for a class of road users.

    Parameters
    ----------
    sites : int
        Number of sites.
    spearman : IntervalEstimate
        Spearman's rank correlation of the criterion with average precision over a site's placements, mean over sites.
    loss : IntervalEstimate
        Regret: average precision of a site's best placement minus that of the placement with the largest value of the
        criterion, mean over sites.
    """

    road_users: str
    sites: int
    spearman: IntervalEstimate
    loss: IntervalEstimate


def table_rows(site: str, placements: Sequence[Mapping[str, Any]]) -> Iterator[tuple[object, ...]]:
    """Yield the rows of a site.

    Parameters
    ----------
    placements : sequence of mapping
        ``placements`` in the record of the criteria study, ``criteria.json``.
    """
    for number, placement in enumerate(placements, start=1):
        sensors = "; ".join(" ".join(f"{value:.3f}" for value in xyz) for xyz in placement["sensors"])
        figures = [placement["average_precision"].get(name) for name in AP]
        figures += chain.from_iterable(placement["in_halves"].get(name, (None, None)) for name in AP)
        figures += [placement["criteria"].get(key) for key in CRITERIA]
        cells = ["" if value is None or math.isnan(value) else f"{value:.6f}" for value in figures]
        yield (site, number, placement["kind"], sensors, *cells)


def save_table(path: Path, rows: Sequence[Sequence[object]]) -> None:
    """Write rows, as from `table_rows`, with the names of the columns."""
    save_csv(path, COLUMNS, rows)


def read_table(path: Path) -> Placements:
    """Read the table.

    Raises
    ------
    SeipError
        The file is not a table of the benchmark.
    """
    by_site: Placements = {}
    for row in _read_csv(path, ("site", "placement", *AP.values())):
        by_site.setdefault(row["site"], []).append(row)
    return by_site


def read_criterion(path: Path, table: Placements) -> dict[str, Float]:
    """Read the values of a criterion from a CSV file with the columns ``site``, ``placement`` and ``value``.

    Returns
    -------
    dict of str to (n,) float64
        Values for the placements of each site in the file, in the order of the table.

    Raises
    ------
    SeipError
        A placement is unknown, duplicate or missing, or a value is not a number.
    """
    found: dict[str, dict[str, float]] = {}
    for row in _read_csv(path, ("site", "placement", "value")):
        site, placement = row["site"], row["placement"]
        if placement not in {one["placement"] for one in table.get(site, ())}:
            raise SeipError(f"{path}: the benchmark has no placement {placement} at {site or 'a site without name'}")
        if placement in found.setdefault(site, {}):
            raise SeipError(f"{path}: placement {placement} at {site} is duplicate: keep one row")
        found[site][placement] = _number(path, row, "value")
    for site, values in found.items():
        missing = [one["placement"] for one in table[site] if one["placement"] not in values]
        if missing:
            raise SeipError(
                f"{path}: placement {missing[0]} at {site} is missing: give a value to each of its placements"
            )
    if not found:
        raise SeipError(f"{path} has no values")
    return {site: np.array([values[one["placement"]] for one in table[site]]) for site, values in found.items()}


def criterion_column(path: Path, table: Placements, key: str) -> dict[str, Float]:
    """Return the values of a criterion in the table, (n,) float64 for each site where all placements have one."""
    return {site: numbers(path, rows, key) for site, rows in table.items() if all(row.get(key) for row in rows)}


def score(path: Path, table: Placements, values: Mapping[str, Float]) -> list[CriterionScore]:
    """Score a criterion on the sites for which it has values, for each class of road users.

    Parameters
    ----------
    path : path
        File of the table, for messages.
    values : mapping of str to (n,) float64
        Values for the placements of each site, in the order of the table; more is better.
    """
    scores = []
    for road_users, column in AP.items():
        correlations, losses = [], []
        for site, own in values.items():
            rows = table[site]
            if len(rows) < FEWEST or not all(row[column] for row in rows):
                continue
            precision = numbers(path, rows, column)
            # The correlation of a constant criterion is undefined; it counts as zero, as it ranks nothing.
            correlations.append(float(np.nan_to_num(rank_correlation(own, precision))))
            losses.append(float(precision.max() - precision[int(np.argmax(own))]))
        if correlations:
            figures = (mean_over_sites(np.array(each)) for each in (correlations, losses))
            scores.append(CriterionScore(road_users, len(correlations), *figures))
    return scores


def mean_over_sites(values: Float) -> IntervalEstimate:
    """Return the mean over sites with its 95 % interval by Student's t, which is infinite for a single site."""
    mean = float(values.mean())
    reach = student_reach(values) if len(values) > 1 else math.inf
    return IntervalEstimate(mean, mean - reach, mean + reach)


def numbers(path: Path, rows: Sequence[Mapping[str, str]], column: str) -> Float:
    """Return the numbers in a column of rows, (n,) float64; ``path`` is for messages."""
    return np.array([_number(path, row, column) for row in rows])


def _read_csv(path: Path, needed: Sequence[str]) -> list[dict[str, str]]:
    """Read the rows of a CSV file in UTF-8 that has the needed columns; missing cells are empty."""
    text = read_small(path, _MOST_BYTES, "give a table of the benchmark")
    try:
        rows = list(csv.DictReader(io.StringIO(text.decode("utf-8-sig"))))
    except (UnicodeDecodeError, csv.Error) as error:
        raise SeipError(f"{path} is not a table: {error}; save it as CSV in UTF-8") from error
    missing = [name for name in needed if not rows or name not in rows[0]]
    if missing:
        raise SeipError(f"{path} has no column {missing[0]!r}: it needs {', '.join(needed)}")
    return [{name: value or "" for name, value in row.items() if isinstance(name, str)} for row in rows]


def _number(path: Path, row: Mapping[str, str], column: str) -> float:
    try:
        value = float(row[column])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        where = f"placement {row['placement']} at {row['site']}"
        raise SeipError(f"{path}: {column} of {where} is {row[column]!r}, not a number")
    return value
