"""Charts of the limits of criterion and arithmetic."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from seip_addon.core.output.pictures.chart_style import DASHED, MARKERS, new_figure, save_chart, style_axes
from seip_addon.core.output.pictures.palette import INK, SOFT_INK
from seip_addon.core.sensing.visibility.float32_precision import FLOAT32_STEP, MAX_STEP

from .arithmetic import ArithmeticStudy
from .criterion import CriterionStudy
from .weather import FAILS_BELOW, WeatherStudy, describe_weather

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Colours of series, distinct for colour-blind readers (Okabe and Ito 2008)."""

LIMIT_LINE: dict[str, Any] = {"color": SOFT_INK, "linewidth": 1.2, "linestyle": DASHED}


def save_ring_border_chart(path: str | os.PathLike[str], study: CriterionStudy, delta: float, title: str) -> None:
    """Draw the distance beyond which rings are more than 2δ apart against δ, for each sensor type."""
    sensors = list(dict.fromkeys(border.sensor for border in study.borders))
    figure, panels = _figure(len(sensors))
    for panel, sensor in zip(panels, sensors, strict=True):
        own = [border for border in study.borders if border.sensor == sensor]
        top = max(border.radius for border in study.borders)
        for number, height in enumerate(sorted({border.height for border in own})):
            at = [border for border in own if border.height == height]
            deltas, radii = [border.delta for border in at], [border.radius for border in at]
            style: dict[str, Any] = {"color": COLOURS[number], "marker": MARKERS[number], "markersize": 5}
            panel.plot(deltas, radii, label=f"{height:g} m high", **style)
            panel.fill_between(deltas, radii, top, color=COLOURS[number], alpha=0.07)
        panel.axvline(delta, **LIMIT_LINE)
        _delta_axis(panel, study)
        panel.set_ylim(0, top)
        panel.set_title(f"{sensor}: above the line, coverage counts beams", fontsize=10, color=INK)
        style_axes(panel, "δ (m); dashed: requested", "distance on a level road (m)")
        panel.legend(frameon=False, fontsize=8.5, loc="upper left")
    save_chart(path, figure, title)


def save_border_check_chart(path: str | os.PathLike[str], study: CriterionStudy, title: str) -> None:
    """Draw the share of targets in view that count as seen against their distance in multiples of the border."""
    figure, (panel,) = _figure(1)
    for number, own in enumerate(study.by_ratio):
        points = [
            (float(np.mean(own.ratios[row : row + 2])), share.value, *share.interval)
            for row, share in enumerate(own.seen)
            if share is not None
        ]
        at, value, low, high = np.array(points).T
        reach = [np.maximum(value - low, 0), np.maximum(high - value, 0)]
        style: dict[str, Any] = {"color": COLOURS[number], "marker": MARKERS[number], "capsize": 3}
        panel.errorbar(at, value, reach, label=own.sensor, **style)
    panel.axvline(1.0, **LIMIT_LINE)
    panel.set_ylim(0, 1.03)
    _share_axis(panel)
    style_axes(panel, "distance in multiples of the border", "of the targets in view, share that counts as seen")
    panel.legend(frameon=False, fontsize=9)
    save_chart(path, figure, title)


def save_delta_chart(path: str | os.PathLike[str], study: CriterionStudy, delta: float, title: str) -> None:
    """Draw coverage and the share in view against δ, and the coverage of each placement with the requested δ."""
    figure, panels = _figure(2)
    for number, sensor in enumerate(dict.fromkeys(answer.sensor for answer in study.by_delta)):
        own = [answer for answer in study.by_delta if answer.sensor == sensor]
        style: dict[str, Any] = {"color": COLOURS[number], "marker": MARKERS[number]}
        deltas = [answer.delta for answer in own]
        coverage, view = [answer.coverage for answer in own], [answer.view for answer in own]
        panels[0].plot(deltas, coverage, label=f"{sensor}, {own[0].height:g} m high", **style)
        panels[0].plot(deltas, view, color=COLOURS[number], linewidth=1.0, linestyle=":")
        panels[0].fill_between(deltas, coverage, view, color=COLOURS[number], alpha=0.06)
        panels[1].plot(deltas, [answer.evaluated for answer in own], label=sensor, **style)
    for panel, what in zip(
        panels,
        ("coverage (dotted: what is in view; between them, beams)", f"coverage under δ = {delta:g} m"),
        strict=True,
    ):
        panel.axvline(delta, **LIMIT_LINE)
        _delta_axis(panel, study)
        panel.set_ylim(0, 1.03)
        _share_axis(panel)
        style_axes(panel, "δ (m) that the placement was made for", what)
        panel.legend(frameon=False, fontsize=8.5)
    save_chart(path, figure, title)


def save_convergence_chart(path: str | os.PathLike[str], study: CriterionStudy, title: str) -> None:
    """Draw coverage against the spacing of targets and of candidates."""
    figure, panels = _figure(2)
    for panel, answers, what in (
        (panels[0], study.by_grid, "spacing of the targets (m)"),
        (panels[1], study.by_candidates, "spacing of the candidates (m)"),
    ):
        spacing = [a.grid_spacing if panel is panels[0] else a.candidate_spacing for a in answers]
        panel.plot(spacing, [a.own for a in answers], color=COLOURS[1], marker="s", label="on its own grid")
        panel.plot(spacing, [a.evaluated for a in answers], color=COLOURS[0], marker="o", label="on the fine grid")
        panel.set_xscale("log", base=2)
        panel.invert_xaxis()
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        _share_axis(panel)
        style_axes(panel, what, "coverage of the best placement")
        panel.legend(frameon=False, fontsize=8.5)
    save_chart(path, figure, title)


def save_rounding_chart(path: str | os.PathLike[str], study: ArithmeticStudy, title: str) -> None:
    """Draw the error of hits against the distance of a street, or of a stray mesh, from the origin."""
    figure, (panel,) = _figure(1)
    for number, (name, checks) in enumerate(
        (
            ("street moved, computed in float64", study.moved),
            ("street kept there in float32", study.stored),
            ("stray mesh there", study.stray),
        )
    ):
        for engine, dash in zip(dict.fromkeys(check.engine for check in checks), ("-", ":"), strict=False):
            own = [check for check in checks if check.engine == engine]
            style: dict[str, Any] = {
                "color": COLOURS[number],
                "marker": MARKERS[number],
                "linestyle": dash,
                "markersize": 5,
            }
            panel.plot([c.distance for c in own], [c.off for c in own], label=f"{name}, {engine}", **style)
    panel.axhline(MAX_STEP, **LIMIT_LINE)
    panel.axvline(MAX_STEP / FLOAT32_STEP, **LIMIT_LINE)
    panel.set_xscale("log")
    panel.set_yscale("log")
    style_axes(panel, "distance (m); dashed: where the tool warns", "hits off at most, across the surface (m)")
    panel.legend(frameon=False, fontsize=8.5)
    save_chart(path, figure, title)


def save_weather_chart(path: str | os.PathLike[str], study: WeatherStudy, title: str) -> None:
    """Draw coverage by weather of placements for clear air and for the weather, and of a type with a longer range."""
    figure, (panel,) = new_figure(9.5, 4.8, dpi=150)
    at = range(1 + len(study.answers))
    clear, longer = study.clear, study.longer_clear
    for number, (name, values) in enumerate(
        (
            (f"{study.sensor} placed for clear air", [clear, *(one.kept for one in study.answers)]),
            (f"{study.sensor} placed for the weather", [clear, *(one.placed for one in study.answers)]),
            (f"{study.longer} placed for the weather", [longer, *(one.longer for one in study.answers)]),
        )
    ):
        panel.plot(
            at, values, color=COLOURS[number], marker=MARKERS[number], linestyle="none", markersize=8, label=name
        )
    panel.axhline(FAILS_BELOW, **LIMIT_LINE)
    panel.set_xticks(
        at,
        [
            "clear",
            *(
                describe_weather(one.words).replace(" of ", "\n").replace(", visibility ", "\n")
                for one in study.answers
            ),
        ],
    )
    panel.set_ylim(0, 1.03)
    _share_axis(panel)
    style_axes(panel, "", f"coverage of {study.count} sensors; dashed: half", grid="y")
    panel.legend(frameon=False, fontsize=8.5, loc="lower left")
    save_chart(path, figure, title)


def _figure(panels: int) -> tuple[Figure, Sequence[Axes]]:
    return new_figure(max(6.5, 4.8 * panels), 4.6, panels, dpi=150)


def _delta_axis(panel: Axes, study: CriterionStudy) -> None:
    panel.set_xscale("log")
    panel.minorticks_off()
    panel.set_xticks(sorted({border.delta for border in study.borders})[::2])
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _share_axis(panel: Axes) -> None:
    panel.yaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{share * 100:g} %"))
