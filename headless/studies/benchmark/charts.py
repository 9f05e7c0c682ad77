"""Charts of processor time against error, with the Pareto front and the default method."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from headless.studies.benchmark.report import Findings
from headless.studies.benchmark.simplifications import EXACT
from headless.studies.benchmark.visibility import ENGINES

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogFormatter, NullLocator

from seip_addon.core.output.pictures.chart_style import DASHED, add_legend, colour, mark, set_title, style_axes
from seip_addon.core.output.pictures.drawing import draw_callouts, new_page, save_png
from seip_addon.core.output.pictures.palette import INK, SOFT_INK

LINEAR_BELOW = 1e-3
"""Errors up to this share are drawn on a linear part of the axis, larger ones on a logarithmic part."""

COLUMNS = 2


@dataclass(frozen=True)
class Method:
    """A method with its run time and error.

    Parameters
    ----------
    family : str
        Methods of one family have the same colour and marker.
    seconds : float
        Processor time.
    error : float
        Error of the result as a share; 0 if exact.
    default : bool
        Whether the program uses the method by default.
    """

    name: str
    family: str
    seconds: float
    error: float
    default: bool = False


def save_charts(folder: Path, findings: Findings) -> None:
    """Draw ``visibility.png`` and ``placement.png`` into a folder."""
    setting = findings.setting
    figure = trade_off(
        visibility_methods(findings),
        f"Visibility of {setting['scene']}: processor time at {setting['positions']} positions against error",
    )
    save_png(folder / "visibility.png", figure)
    title = "Placement (poses × targets, N sensors): processor time against the gap to the best bound"
    save_png(folder / "placement.png", trade_off(placement_methods(findings), title))


def visibility_methods(findings: Findings) -> dict[str, list[Method]]:
    """Return the methods to compute visibility, by what their error is of: the grid, and the placement on it."""
    panels: dict[str, list[Method]] = {"wrong pairs of pose and target, per visible pair": []}
    panels["coverage lost by the placement (share of targets)"] = []
    exact = findings.degradations[EXACT]
    for name, cost in findings.visibility.items():
        scan, _, of = name.partition(" ")
        family = f"{scan}, {'exact scene' if of in ENGINES else 'simplified, with embree'}"
        own = findings.degradations[EXACT if of in ENGINES else of]
        for methods, error in zip(panels.values(), (own.wrong, exact.coverage - own.coverage), strict=True):
            label = name if of in ENGINES else of
            methods.append(Method(label, family, cost.expense.cpu, max(0.0, error), default=name == "lazy embree"))
    return panels


def placement_methods(findings: Findings) -> dict[str, list[Method]]:
    """Return the methods of placement that found a solution, by instance."""
    panels: dict[str, list[Method]] = {}
    for run in findings.runs:
        proof = "its optimum" if run.proven else "an upper bound" if math.isfinite(run.bound) else "nothing"
        own = Method(run.method, f"proves {proof}", run.expense.cpu, run.gap, default=run.method == "ours")
        panels.setdefault(f"gap: {run.instance}", []).extend([own] if run.objective else [])
    return panels


def pareto_front(methods: Sequence[Method]) -> list[Method]:
    """Return the methods that no other one beats in both run time and error, the fastest first."""
    front: list[Method] = []
    for method in sorted(methods, key=lambda one: (one.seconds, one.error)):
        if not front or method.error < front[-1].error:
            front.append(method)
    return front


def trade_off(panels: Mapping[str, Sequence[Method]], title: str) -> Figure:
    """Draw processor time against error.

    Parameters
    ----------
    panels : mapping of str to sequence of Method
        Methods of each panel, by the label of its error axis; each panel has a default method of the same name.
    """
    rows, columns = math.ceil(len(panels) / COLUMNS), min(len(panels), COLUMNS)
    figure = new_page((14.0, 6.2 * rows + 1.0), dpi=110, layout="constrained")
    axes = [figure.add_subplot(rows, columns, number) for number in range(1, len(panels) + 1)]
    families = list(dict.fromkeys(method.family for methods in panels.values() for method in methods))
    for panel, (error_name, methods) in zip(axes, panels.items(), strict=True):
        _draw_methods(panel, methods, families)
        panel.set_ylim(panel.get_ylim())  # lines to labels must not change the limits
        style_axes(panel, error_name, "processor time (s)")
    add_legend(figure, axes[:1])
    set_title(figure, title)
    figure.draw_without_rendering()  # fixes positions and limits of the panels, in which the labels are placed
    figure.set_layout_engine("none")
    for panel, methods in zip(axes, panels.values(), strict=True):
        points = np.array([(method.error, method.seconds) for method in methods])
        draw_callouts(panel, points, [method.name for method in methods], points, zorder=3)
    return figure


def _draw_methods(panel: Axes, methods: Sequence[Method], families: Sequence[str]) -> None:
    for row, family in enumerate(families):
        own = [(method.error, method.seconds) for method in methods if method.family == family]
        points = np.array(own).reshape(-1, 2)
        style: dict[str, Any] = {
            "color": colour(row),
            "marker": mark(row),
            "linestyle": "none",
            "markersize": 8,
            "zorder": 4,
        }
        panel.plot(*points.T, label=family, **style)
    front = np.array([(method.error, method.seconds) for method in pareto_front(methods)])
    # each method of the front beats everything above and to the right of it
    panel.step(*front.T, where="pre", color=SOFT_INK, linestyle=DASHED, linewidth=1.2, label="Pareto front")
    (default,) = (method for method in methods if method.default)
    ring: dict[str, Any] = {"marker": "o", "markersize": 17, "mfc": "none", "mec": INK, "mew": 1.6, "linestyle": "none"}
    panel.plot(default.error, default.seconds, label=f"default: {default.name}", **ring)
    panel.set_yscale("log")
    panel.yaxis.set_major_formatter(FuncFormatter(lambda seconds, _: f"{seconds:g}"))
    panel.yaxis.set_minor_formatter(LogFormatter())  # plain numbers within a decade
    panel.set_xscale("symlog", linthresh=LINEAR_BELOW, linscale=0.5)
    panel.xaxis.set_minor_locator(NullLocator())
    panel.set_xlim(-0.35 * LINEAR_BELOW, 8.0 * max(LINEAR_BELOW, *(method.error for method in methods)))
    panel.margins(y=0.25)
    panel.xaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{share * 100:g} %"))
