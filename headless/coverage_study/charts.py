"""Charts of a coverage study."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from seip_addon.core.pictures.drawing import save_png
from seip_addon.core.pictures.palette import INK, PAPER, SOFT_INK

from . import NUMBERS, WEIGHTS, CoverageStudy

SERIES = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
"""Colours of sensor types, told apart by colour-blind people (Okabe and Ito 2008)."""

MARKS = ("o", "s", "^", "D", "v", "P", "X")  # one more than colours: 42 types before a pair comes again
HEIGHT, PANEL_WIDTH, FEWEST_PANELS = 4.2, 3.65, 3  # inches, inches, panels that a chart is wide at least
BESIDE = 0.09  # of the step between two heights, from one type to the next


def save_height_chart(path: str | os.PathLike[str], study: CoverageStudy, title: str) -> None:
    """Draw coverage against mounting height, a panel for each number of sensors, as PNG.

    A bar above a mark ends at the coverage that the solver could not rule out.
    Cells without a placement are left out.
    """
    figure, panels = _figure(len(NUMBERS))
    ticks = [*(f"{height:g}" for height in study.heights), "free"]
    for panel, count in zip(panels, NUMBERS, strict=True):
        for row, sensor in enumerate(study.sensors):
            # Side by side, so that no type's bar stands on another's mark.
            aside = BESIDE * (row - (len(study.sensors) - 1) / 2)
            spans = [study.possible(sensor, count, height) or NOTHING for height in (*study.heights, None)]
            x = [place + aside for place in range(len(spans))]
            _line(panel, row, x[:-1], [low for low, _ in spans[:-1]], label=sensor)
            _line(panel, row, x[-1:], [spans[-1][0]])
            for place, (low, high) in zip(x, spans, strict=True):
                if high > low:
                    panel.plot((place, place), (low, high), color=_colour(row), linewidth=1.1, marker="_", markersize=5)
        panel.set_title(f"N = {count}", color=INK, fontsize=10)
        panel.set_xticks(range(len(ticks)), ticks)
        panel.set_xlim(-0.5, len(ticks) - 0.5)
        panel.set_xlabel("mounting height (m)", color=INK)
        _dress(panel)
    if any(case.span[1] > case.span[0] for case in study.cases if case.weight == 1.0):
        panels[0].plot([], [], color=SOFT_INK, linewidth=1.1, marker="_", label="left open by the solver")
    _finish(figure, panels, f"{title}: coverage by sensor type, height and number")
    save_png(path, figure)


def save_weight_chart(path: str | os.PathLike[str], study: CoverageStudy, title: str) -> None:
    """Draw whole and central coverage against the weight of the centre, a panel for each type, as PNG."""
    figure, panels = _figure(len(study.sensors))
    weights = (1.0, *WEIGHTS)
    for panel, sensor in zip(panels, study.sensors, strict=True):
        for row, count in enumerate(NUMBERS):
            found = [study.find(sensor, count, weight=weight) for weight in weights]
            central = [math.nan if case is None else case.deployment.central or 0.0 for case in found]
            whole = [math.nan if case is None else case.deployment.coverage for case in found]
            _line(panel, row, range(len(weights)), central, label=f"N = {count}, centre")
            _line(panel, row, range(len(weights)), whole, label=f"N = {count}, whole", dashed=True)
        panel.set_title(sensor, color=INK, fontsize=10, parse_math=False)
        panel.set_xticks(range(len(weights)), ["1\n(vanilla)", *(f"{weight:g}" for weight in WEIGHTS)])
        panel.set_xlabel("weight of the centre", color=INK)
        _dress(panel)
    _finish(figure, panels, f"{title}: vanilla against weighted placement")
    save_png(path, figure)


NOTHING = (math.nan, math.nan)


def _figure(count: int) -> tuple[Figure, Sequence[Axes]]:
    """Return a figure with that many panels side by side."""
    size = (PANEL_WIDTH * max(count, FEWEST_PANELS), HEIGHT)
    figure = Figure(size, dpi=160, facecolor=PAPER, layout="constrained")
    return figure, figure.subplots(1, count, sharey=True, squeeze=False)[0]


def _finish(figure: Figure, panels: Sequence[Axes], title: str) -> None:
    """Write what the panels share: the axis, the legend below them and the title."""
    panels[0].set_ylabel("share of targets seen", color=INK)
    handles, labels = panels[0].get_legend_handles_labels()
    legend = figure.legend(handles, labels, frameon=False, fontsize=9, loc="outside lower center", ncols=len(labels))
    for text in legend.get_texts():
        text.set_parse_math(False)
    figure.suptitle(title, color=INK, fontsize=12, parse_math=False)


def _line(
    panel: Axes, row: int, x: Sequence[float], y: Sequence[float], *, label: str | None = None, dashed: bool = False
) -> None:
    style = {"linestyle": (0, (4, 2)), "mfc": PAPER, "linewidth": 1.0} if dashed else {"linewidth": 1.6}
    panel.plot(x, y, color=_colour(row), marker=MARKS[row % len(MARKS)], markersize=5, label=label, **style)


def _colour(row: int) -> str:
    return SERIES[row % len(SERIES)]


def _dress(panel: Axes) -> None:
    panel.set_ylim(0, 1.03)
    panel.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    panel.grid(axis="y", color="#e3e6e8", linewidth=0.8)
    panel.tick_params(colors=SOFT_INK)
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)
