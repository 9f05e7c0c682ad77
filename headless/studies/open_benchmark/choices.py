r"""Loss in average precision of ways to choose a placement, against the default, and the time that they take.

A placement that is the best of many by measured average precision (AP) owes some of it to chance. Each choice is
therefore scored on runs of traffic that it did not see. Let :math:`a_p` be the mean AP of the classes with placement p
in one half of the runs of a site, and :math:`b_p` that in the other half. A choice that takes placement c loses
:math:`b_d - b_c` against the placement d that the default criterion likes best; the mean of both ways round counts. A
criterion takes the placement that it likes best; of finalists, the one with the largest :math:`a_p` is taken.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from headless.studies.benchmark.resource_usage import Expense

import numpy as np
from matplotlib.ticker import LogFormatter

from seip_addon.core.base.arrays import Float, Integer
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.estimates import IntervalEstimate
from seip_addon.core.output.pictures.chart_style import add_legend, colour, new_figure, set_title, style_axes
from seip_addon.core.output.pictures.drawing import draw_callouts, save_png
from seip_addon.core.output.pictures.palette import INK

from .table import CRITERIA, HALVES, Placements, criterion_column, mean_over_sites, numbers

FINALISTS = (2, 4, 8, 16)
"""Numbers of finalists that are compared."""
DEFAULT = "returns"
"""Criterion against which the others lose or gain."""
SHORTLISTS = ("coverage", DEFAULT)
"""Criteria of which finalists are the best placements, in turn: those that `seip place` has."""
BLEND = ("returns", "egvs", "inspe", "pe_vgop")
"""Criteria whose standardised values have a mean that is compared too."""
NAMES = {
    "returns": "returns (the default)",
    "occupancy_entropy": "S-MIG",
    "egvs": "EGVS",
    "inspe": "InSPE",
    "pe_vgop": "PE-VGOP",
    "blend": "mean of returns, EGVS, InSPE and PE-VGOP",
}
"""Names of choices in charts."""
LINES = ("--", ":", "-.")
TIMED = {
    "coverage": ("--criterion", "road"),
    "returns": ("--criterion", "returns"),
    **{f"{count} finalists": ("--finalists", str(count)) for count in FINALISTS},
}
"""Options of `seip place` for the choices that it makes."""


def choice_losses(path: Path, table: Placements) -> dict[str, IntervalEstimate]:
    """Return what each choice loses in mean AP of the classes against the default, the mean over sites, -1 to 1.

    Parameters
    ----------
    path : path
        File of the table, for messages.

    Raises
    ------
    SeipError
        The table lacks average precision by halves of the runs, coverage or returns.
    """
    columns = {key: criterion_column(path, table, key) for key in CRITERIA}
    lost: dict[str, list[float]] = {}
    for site, rows in table.items():
        parts = [_mean_precision(path, rows, half) for half in (0, 1)]
        values = {key: column[site] for key, column in columns.items() if site in column}
        missing = next((key for key in SHORTLISTS if key not in values), None)
        if missing is not None:
            raise SeipError(f"{path} has no values of {missing} at {site}: build the benchmark again")
        default = int(np.argmax(values[DEFAULT]))
        for name, pool in _pools(values).items():
            losses = [
                scored[default] - scored[pool[int(np.argmax(judged[pool]))]] for judged, scored in (parts, parts[::-1])
            ]
            lost.setdefault(name, []).append(float(np.mean(losses)))
    return {name: mean_over_sites(np.array(values)) for name, values in lost.items()}


def _pools(values: Mapping[str, Float]) -> dict[str, Integer]:
    """Return the placements among which each choice is made by detection: one for a criterion alone."""
    pools = {key: np.array([int(np.argmax(own))]) for key, own in values.items()}
    if all(key in values for key in BLEND):
        blend = np.sum([_standardised(values[key]) for key in BLEND], axis=0)
        pools["blend"] = np.array([int(np.argmax(blend))])
    ranked = [np.argsort(-values[key], kind="stable").tolist() for key in SHORTLISTS]
    in_turn = np.array(list(dict.fromkeys(chain.from_iterable(zip(*ranked, strict=True)))))
    return pools | {f"{count} finalists": in_turn[:count] for count in FINALISTS}


def _standardised(values: Float) -> Float:
    spread = float(values.std())
    standardised: Float = (values - values.mean()) / (spread or 1.0)
    return standardised


def _mean_precision(path: Path, rows: Sequence[Mapping[str, str]], half: int) -> Float:
    """Return the mean AP of the classes in a half of the runs, for each placement of a site, (n,)."""
    columns = [halves[half] for halves in HALVES.values() if all(row.get(one) for row in rows for one in halves)]
    if not columns:
        raise SeipError(f"{path} has no average precision by halves of the runs: build the benchmark again")
    mean: Float = np.mean([numbers(path, rows, column) for column in columns], axis=0)
    return mean


def measure_seconds(scene: Path, sensor: str, count: int) -> dict[str, float]:
    """Return the processor seconds of `seip place` for each of its choices at a site, everything computed anew.

    Raises
    ------
    SeipError
        A placement failed.
    """
    seconds = {}
    for name, options in TIMED.items():
        with tempfile.TemporaryDirectory() as folder:
            sensors = ("--sensor", sensor, "--count", str(count), "--no-render")
            command = [sys.executable, "-m", "headless", "place", str(scene), *sensors, *options, "-o", folder]
            expense = Expense()
            done = expense.time(partial(subprocess.run, command, capture_output=True, text=True, check=False))
            if done.returncode:
                said = done.stderr.strip() or f"exit status {done.returncode}"
                raise SeipError(f"seip place {' '.join(options)} failed: {said.splitlines()[-1]}")
        seconds[name] = expense.cpu
    return seconds


def save_speed_accuracy_chart(
    path: Path, seconds: Mapping[str, float], losses: Mapping[str, IntervalEstimate], title: str
) -> None:
    """Draw the loss of each choice, in points, against its seconds on a logarithmic axis.

    Choices without a time, which `seip place` does not make, are lines across the chart.
    """
    figure, (panel,) = new_figure(7.6, 4.8)
    style_axes(panel, "processor seconds, everything computed anew", "average precision below the default, points")
    timed = [name for name in losses if name in seconds]
    points = np.array([(seconds[name], 100.0 * losses[name].value) for name in timed])
    ends = np.array([(losses[name].value - losses[name].low, losses[name].high - losses[name].value) for name in timed])
    panel.errorbar(points[:, 0], points[:, 1], yerr=100.0 * ends.T, fmt="o", color=colour(0), capsize=3.0, zorder=3)
    for row, name in enumerate(name for name in losses if name not in seconds):
        line: dict[str, Any] = {"color": colour(row + 1), "linestyle": LINES[row % len(LINES)], "linewidth": 1.2}
        panel.axhline(100.0 * losses[name].value, label=NAMES.get(name, name), **line)
    panel.axhline(0.0, color=INK, linewidth=0.8)
    panel.set_xscale("log")
    for of in (panel.xaxis.set_major_formatter, panel.xaxis.set_minor_formatter):
        of(LogFormatter(minor_thresholds=(2.0, 0.5)))  # plain numbers within a decade
    panel.margins(x=0.15)
    add_legend(figure, [panel])
    set_title(figure, title)
    figure.draw_without_rendering()  # fixes positions and limits of the panel, in which the labels are placed
    figure.set_layout_engine("none")
    draw_callouts(panel, points, [NAMES.get(name, name) for name in timed], points, zorder=4)
    save_png(path, figure)
