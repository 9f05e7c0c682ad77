"""Charts of the limits of the detector."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from seip_addon.core.errors import SeipError
from seip_addon.core.output.pictures.chart_style import (
    DASHED,
    MARKERS,
    colour,
    mark,
    new_figure,
    save_chart,
    style_axes,
)
from seip_addon.core.output.pictures.palette import INK, PAPER, SERIES_COLOURS, SOFT_INK

from .disturbances import CappedPillars, SensorFailure
from .study import DisturbanceCurve, LimitsStudy, TransferResult

COLUMNS = 4  # panels in a row

PANEL_SIZE = (3.6, 3.0)  # inches


def save_limits_chart(path: str | os.PathLike[str], study: LimitsStudy) -> None:
    """Draw average precision against the size of each disturbance, with intervals; dashed: least harmful size."""
    if not study.curves:
        raise SeipError("the study has no disturbances to draw: evaluate some first")
    names = list(dict.fromkeys(curve.name for curve in study.curves))
    rows = -(-len(names) // COLUMNS)
    size = (PANEL_SIZE[0] * min(COLUMNS, len(names)), PANEL_SIZE[1] * rows + 0.7)
    figure = Figure(size, dpi=150, facecolor=PAPER, layout="constrained")
    panels = figure.subplots(rows, min(COLUMNS, len(names)), squeeze=False).ravel().tolist()
    configurations = list(dict.fromkeys(curve.configuration for curve in study.curves))
    for panel, name in zip(panels, names, strict=False):
        own = [curve for curve in study.curves if curve.name == name]
        _draw(panel, own, [configurations.index(curve.configuration) for curve in own])
    for panel in panels[len(names) :]:
        panel.set_axis_off()
    title = f"{study.name}: average precision under disturbances (dashed: significantly lower from here on)"
    save_chart(path, figure, title, panels[:1])


def save_transfer_chart(path: str | os.PathLike[str], study: LimitsStudy) -> None:
    """Draw the change of average precision of detectors used on other types, traffic and sites than in training."""
    changes = (*study.transfers, *study.padding)
    if not changes:
        raise SeipError("the study has no results on other types, traffic or sites to draw: evaluate some first")
    figure, (panel,) = new_figure(9.0, 1.2 + 0.42 * len(changes), dpi=150)
    for row, one in enumerate(changes):
        low, high = one.change.low * 100, one.change.high * 100
        panel.plot((low, high), (row, row), color=SERIES_COLOURS[0], linewidth=1.2, marker="|")
        panel.plot(one.change.value * 100, row, color=SERIES_COLOURS[0], marker=MARKERS[0], mec=PAPER)
    panel.axvline(0.0, color=SOFT_INK, linewidth=1.0, linestyle=DASHED)
    panel.set_yticks(range(len(changes)), [_label(one) for one in changes], fontsize=8.5, parse_math=False)
    panel.invert_yaxis()
    style_axes(panel, "change of average precision (points)")
    save_chart(path, figure, f"{study.name}: types, traffic and sites not in training")


def _label(one: TransferResult) -> str:
    return f"{one.trained_on}, on {one.tested_on}, against {one.against}"


def _draw(panel: Axes, curves: Sequence[DisturbanceCurve], rows: Sequence[int]) -> None:
    """Draw the lines of one disturbance; sizes are equally spaced along the axis."""
    falling = isinstance(curves[0].points[0].disturbance, CappedPillars)  # the fewer points, the worse
    sizes = sorted({point.disturbance.size for curve in curves for point in curve.points}, reverse=falling)
    for curve, row in zip(curves, rows, strict=True):
        at = [0, *(1 + sizes.index(point.disturbance.size) for point in curve.points)]
        estimates = [curve.undisturbed, *(point.precision for point in curve.points)]
        value = np.array([one.value for one in estimates])
        ends = np.array([(one.low, one.high) for one in estimates]).T
        reach = np.nan_to_num(np.abs(ends - value), posinf=0.0)
        each = isinstance(
            curve.points[0].disturbance, SensorFailure
        )  # sizes are numbers of sensors, which have no order
        style = {"color": colour(row), "marker": mark(row), "markersize": 5}
        style["linestyle"] = "none" if each else "-"
        panel.errorbar(at, value, reach, label=curve.configuration, capsize=2.5, linewidth=1.2, **style)  # type: ignore[arg-type]  # colours and marks are text, sizes are not
        begins = curve.begins
        if begins is not None and not each:
            place = 1 + sizes.index(begins.disturbance.size) + 0.06 * (row - 1)
            panel.axvline(place, color=colour(row), linewidth=0.9, linestyle=DASHED, zorder=1)
    panel.set_xticks(range(len(sizes) + 1), ["none", *(f"{size:g}" for size in sizes)], fontsize=8)
    panel.set_title(curves[0].name, fontsize=10, color=INK)
    panel.set_ylim(0, 1.02)
    style_axes(panel, curves[0].unit, fontsize=9)
