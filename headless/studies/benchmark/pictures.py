"""Scatter plots of error against run time, and log-log plots of growth."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogFormatter

from seip_addon.core.arrays import Float
from seip_addon.core.output.pictures.callouts import place_callouts
from seip_addon.core.output.pictures.chart_style import DASHED, new_figure, save_chart, set_title, style_axes
from seip_addon.core.output.pictures.drawing import save_png
from seip_addon.core.output.pictures.palette import INK, PAPER, SOFT_INK

from .pareto_front import Method, front, growth_exponent

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#999999")
"""Colours of families, distinct for colour-blind readers (Okabe and Ito 2008); `MARKS` keep them apart in print."""

COLUMNS = 2
MARKS = ("D", "o", "s", "^", "v", "P", "*", "X")


def save_trade_off_chart(
    path: str | os.PathLike[str], panels: Mapping[str, Sequence[Method]], title: str, subtitle: str, linear_below: float
) -> None:
    """Draw processor time against error, with the Pareto front and the default method, as PNG.

    Parameters
    ----------
    panels : mapping of str to sequence of Method
        Methods of each panel, by the label of its error axis; all panels have the same families.
    linear_below : float
        Errors up to this value are drawn on a linear part of the axis, larger ones on a logarithmic part.
    """
    rows = math.ceil(len(panels) / COLUMNS)
    figure = Figure((12.5, 5.0 * rows + 1.2), dpi=150, facecolor=PAPER, layout="constrained")
    families = list(dict.fromkeys(method.family for methods in panels.values() for method in methods))
    axes = [figure.add_subplot(rows, COLUMNS, number + 1) for number in range(len(panels))]
    for panel, (error_name, methods) in zip(axes, panels.items(), strict=True):
        _draw_front(panel, methods)
        for family, colour, mark in zip(families, COLOURS, MARKS, strict=False):  # there are more marks than families
            own = [method for method in methods if method.family == family]
            style: dict[str, Any] = {"color": colour, "marker": mark, "linestyle": "none", "markersize": 7, "zorder": 4}
            panel.plot([method.error for method in own], [method.seconds for method in own], label=family, **style)
            for method in own:
                if method.interval is not None:
                    panel.hlines(method.seconds, *method.interval, color=colour, linewidth=2.0, zorder=2)
        _mark_default(panel, methods)
        panel.set_yscale("log")
        panel.yaxis.set_minor_formatter(LogFormatter())  # plain numbers within a decade
        panel.set_xscale("symlog", linthresh=linear_below, linscale=0.5)
        panel.set_xlim(-0.35 * linear_below, 2.5 * max(linear_below, *(method.error for method in methods)))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{share * 100:g} %"))
        style_axes(panel, error_name, "processor time (s)")
    handles, labels = panel.get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, fontsize=9, loc="outside lower center", ncols=6)
    set_title(figure, f"{title}\n{subtitle}")
    figure.draw_without_rendering()  # fixes positions and limits of the panels, which the names are placed in
    figure.set_layout_engine("none")
    for panel, methods in zip(axes, panels.values(), strict=True):
        _label_methods(panel, methods)
    save_png(path, figure)


def save_growth_chart(
    path: str | os.PathLike[str],
    panels: Mapping[str, Sequence[tuple[str, Sequence[float], Sequence[float]]]],
    title: str,
) -> None:
    """Draw costs against sizes on logarithmic axes, with the fitted exponents, as PNG.

    Parameters
    ----------
    panels : mapping of str to sequence of (name, sizes, costs)
        Curves of each panel, by the label of its cost axis. Sizes are drawn as multiples of the smallest.
    """
    figure, axes = new_figure(12.5, 6.4, len(panels), dpi=150)
    for panel, (quantity, lines) in zip(axes, panels.items(), strict=True):
        for row, (name, size, cost) in enumerate(lines):
            label = f"{name}: exponent {growth_exponent(size, cost):.2f}"
            times = [value / size[0] for value in size]
            panel.plot(times, cost, color=COLOURS[row], marker=MARKS[row], markersize=6, linewidth=1.4, label=label)
        panel.set_xscale("log", base=2)
        panel.set_yscale("log")
        panel.xaxis.set_major_formatter(FuncFormatter(lambda times, _: f"× {times:g}"))
        panel.legend(frameon=False, fontsize=8.5, loc="upper center", bbox_to_anchor=(0.5, -0.12))
        style_axes(panel, "size, in multiples of the smallest", quantity)
    save_chart(path, figure, title)


def _draw_front(panel: Axes, methods: Sequence[Method]) -> None:
    best = front(methods)
    panel.step(
        [method.error for method in best],
        [method.seconds for method in best],
        where="pre",  # each point of the front dominates everything that is above and to the right of it
        color=SOFT_INK,
        linewidth=1.2,
        linestyle=DASHED,
        label="Pareto front: no method is both faster and more accurate",
    )


def _along_front(panel: Axes, methods: Sequence[Method]) -> Float:
    """Return points along the drawn front in pixels, (n, 2) float64."""
    corners = panel.transData.transform([(method.error, method.seconds) for method in front(methods)])
    bends = np.column_stack([corners[:-1, 0], corners[1:, 1]])
    path = np.insert(corners, np.arange(1, len(corners)), bends, axis=0)
    along: Float = np.linspace(path[:-1], path[1:], 50).reshape(-1, 2)
    return along


def _mark_default(panel: Axes, methods: Sequence[Method]) -> None:
    own = [method for method in methods if method.default]
    panel.plot(
        [method.error for method in own],
        [method.seconds for method in own],
        marker="o",
        linestyle="none",
        markersize=15,
        mfc="none",
        mec=INK,
        mew=1.6,
        label="default",
    )


def _label_methods(panel: Axes, methods: Sequence[Method]) -> None:
    """Write the name of each method next to its mark, without overlaps, and away from the front if there is room."""
    style: dict[str, Any] = {"size": 7.5, "color": INK, "ha": "center", "va": "center", "zorder": 3}
    box = {"facecolor": PAPER, "edgecolor": "none", "pad": 0.6}
    texts = [panel.text(0, 0, method.name, bbox=box, **style) for method in methods]
    extents = [text.get_window_extent() for text in texts]
    sizes = np.array([(extent.width, extent.height) for extent in extents])
    points = np.array([(method.error, method.seconds) for method in methods])
    anchors, radius = panel.transData.transform(points), 4.5 * panel.figure.dpi / 72
    frame = panel.get_window_extent()
    centres = place_callouts(anchors, sizes, frame.extents, radius, _along_front(panel, methods))
    for text, point, centre in zip(texts, points, panel.transData.inverted().transform(centres), strict=True):
        text.set_position(centre)
        panel.plot(*zip(point, centre, strict=True), color="#c3c9ce", linewidth=0.7, zorder=1)
