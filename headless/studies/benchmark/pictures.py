"""Scatter plots of error against run time, and log-log plots of growth."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import Any

from headless.charts.style import DASHED, new_figure, save_chart, set_title, style_axes

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogFormatter

from seip_addon.core.arrays import Float
from seip_addon.core.output.pictures.callouts import place_callouts
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
    """Draw processor time against error, with the front and the default, as PNG.

    Parameters
    ----------
    panels : mapping of str to sequence of Method
        Methods of each panel by the meaning of its error; the same families in all panels.
    linear_below : float
        Errors up to this value are drawn on a linear part of the axis, larger ones on a logarithmic part.
    """
    rows = math.ceil(len(panels) / COLUMNS)
    figure = Figure((12.5, 5.0 * rows + 1.2), dpi=150, facecolor=PAPER, layout="constrained")
    families = list(dict.fromkeys(way.family for ways in panels.values() for way in ways))
    axes = [figure.add_subplot(rows, COLUMNS, number + 1) for number in range(len(panels))]
    for panel, (what, ways) in zip(axes, panels.items(), strict=True):
        _draw_front(panel, ways)
        for family, colour, mark in zip(families, COLOURS, MARKS, strict=False):  # there are marks to spare
            own = [way for way in ways if way.family == family]
            style: dict[str, Any] = {"color": colour, "marker": mark, "linestyle": "none", "markersize": 7, "zorder": 4}
            panel.plot([way.error for way in own], [way.seconds for way in own], label=family, **style)
            for way in own:
                if way.interval is not None:
                    panel.hlines(way.seconds, *way.interval, color=colour, linewidth=2.0, zorder=2)
        _mark_default(panel, ways)
        panel.set_yscale("log")
        panel.yaxis.set_minor_formatter(LogFormatter())  # within a decade, plain numbers
        panel.set_xscale("symlog", linthresh=linear_below, linscale=0.5)
        panel.set_xlim(-0.35 * linear_below, 2.5 * max(linear_below, *(way.error for way in ways)))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{share * 100:g} %"))
        style_axes(panel, what, "processor time (s)")
    handles, labels = panel.get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, fontsize=9, loc="outside lower center", ncols=6)
    set_title(figure, f"{title}\n{subtitle}")
    figure.draw_without_rendering()  # fixes the positions and limits of panels, which names are placed by
    figure.set_layout_engine("none")
    for panel, ways in zip(axes, panels.values(), strict=True):
        _name(panel, ways)
    save_png(path, figure)


def save_growth_chart(
    path: str | os.PathLike[str],
    panels: Mapping[str, Sequence[tuple[str, Sequence[float], Sequence[float]]]],
    title: str,
) -> None:
    """Draw costs against sizes on logarithmic axes, with the exponents, as PNG.

    Parameters
    ----------
    panels : mapping of str to sequence of (name, sizes, costs)
        Curves of each panel by the measured quantity. Sizes are drawn as multiples of the smallest.
    """
    figure, axes = new_figure(12.5, 6.4, len(panels), dpi=150)
    for panel, (what, lines) in zip(axes, panels.items(), strict=True):
        for row, (name, size, cost) in enumerate(lines):
            label = f"{name}: exponent {growth_exponent(size, cost):.2f}"
            times = [value / size[0] for value in size]
            panel.plot(times, cost, color=COLOURS[row], marker=MARKS[row], markersize=6, linewidth=1.4, label=label)
        panel.set_xscale("log", base=2)
        panel.set_yscale("log")
        panel.xaxis.set_major_formatter(FuncFormatter(lambda times, _: f"× {times:g}"))
        panel.legend(frameon=False, fontsize=8.5, loc="upper center", bbox_to_anchor=(0.5, -0.12))
        style_axes(panel, "size, in multiples of the smallest", what)
    save_chart(path, figure, title)


def _draw_front(panel: Axes, ways: Sequence[Method]) -> None:
    best = front(ways)
    panel.step(
        [way.error for way in best],
        [way.seconds for way in best],
        where="pre",  # each point of the front dominates everything that is above and to the right of it
        color=SOFT_INK,
        linewidth=1.2,
        linestyle=DASHED,
        label="front: nothing is both quicker and nearer",
    )


def _along_front(panel: Axes, ways: Sequence[Method]) -> Float:
    """Return points along the drawn front in pixels, (n, 2) float64."""
    corners = panel.transData.transform([(way.error, way.seconds) for way in front(ways)])
    bends = np.column_stack([corners[:-1, 0], corners[1:, 1]])
    path = np.insert(corners, np.arange(1, len(corners)), bends, axis=0)
    along: Float = np.linspace(path[:-1], path[1:], 50).reshape(-1, 2)
    return along


def _mark_default(panel: Axes, ways: Sequence[Method]) -> None:
    own = [way for way in ways if way.default]
    panel.plot(
        [way.error for way in own],
        [way.seconds for way in own],
        marker="o",
        linestyle="none",
        markersize=15,
        mfc="none",
        mec=INK,
        mew=1.6,
        label="default",
    )


def _name(panel: Axes, ways: Sequence[Method]) -> None:
    """Write each method's name next to its mark, without overlaps, and off the front where there is room."""
    style: dict[str, Any] = {"size": 7.5, "color": INK, "ha": "center", "va": "center", "zorder": 3}
    box = {"facecolor": PAPER, "edgecolor": "none", "pad": 0.6}
    texts = [panel.text(0, 0, way.name, bbox=box, **style) for way in ways]
    extents = [text.get_window_extent() for text in texts]
    sizes = np.array([(extent.width, extent.height) for extent in extents])
    points = np.array([(way.error, way.seconds) for way in ways])
    anchors, radius = panel.transData.transform(points), 4.5 * panel.figure.dpi / 72
    frame = panel.get_window_extent()
    centres = place_callouts(anchors, sizes, frame.extents, radius, _along_front(panel, ways))
    for text, point, centre in zip(texts, points, panel.transData.inverted().transform(centres), strict=True):
        text.set_position(centre)
        panel.plot(*zip(point, centre, strict=True), color="#c3c9ce", linewidth=0.7, zorder=1)
