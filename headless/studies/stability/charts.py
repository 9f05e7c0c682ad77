"""Charts of the limits of the criterion of visibility."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.ticker import PercentFormatter, StrMethodFormatter

from seip_addon.core.output.pictures.drawing import DASHED, colour, mark, new_figure, save_chart, style_axes
from seip_addon.core.output.pictures.palette import SOFT_INK

from .criterion import CriterionStudy, SpacingAnswer

FIGURE_SIZE = (9.6, 4.6)  # inches


def save_delta_chart(path: str | os.PathLike[str], study: CriterionStudy, delta: float, title: str) -> None:
    """Draw coverage and the share in view against δ, and the coverage of each placement with the requested δ."""
    figure, panels = new_figure(*FIGURE_SIZE, 2, dpi=150)
    for number, (sensor, answers) in enumerate(study.by_delta.items()):
        style: dict[str, Any] = {"color": colour(number), "marker": mark(number)}
        deltas = [answer.delta for answer in answers]
        coverage, view = [answer.coverage for answer in answers], [answer.view for answer in answers]
        panels[0].plot(deltas, coverage, label=sensor, **style)
        panels[0].plot(deltas, view, color=colour(number), linewidth=1.0, linestyle=":")
        panels[0].fill_between(deltas, coverage, view, color=colour(number), alpha=0.06)
        panels[1].plot(deltas, [answer.evaluated for answer in answers], label=sensor, **style)
    quantities = ("coverage (dotted: what is in view; between them, beams)", f"coverage under δ = {delta:g} m")
    for panel, quantity in zip(panels, quantities, strict=True):
        panel.axvline(delta, color=SOFT_INK, linewidth=1.2, linestyle=DASHED)
        panel.set_xscale("log")
        panel.minorticks_off()
        panel.set_xticks(deltas[::2])
        panel.set_ylim(0, 1.03)
        _finish(panel, "δ (m) that the placement was made for", quantity)
    save_chart(path, figure, title)


def save_convergence_chart(path: str | os.PathLike[str], study: CriterionStudy, title: str) -> None:
    """Draw coverage against the spacing of targets and of candidates."""
    figure, panels = new_figure(*FIGURE_SIZE, 2, dpi=150)
    _draw_spacings(panels[0], study.by_grid, "spacing of the targets (m)")
    _draw_spacings(panels[1], study.by_candidates, "spacing of the candidates (m)")
    save_chart(path, figure, title)


def _draw_spacings(panel: Axes, answers: Sequence[SpacingAnswer], spacing: str) -> None:
    x = [answer.spacing for answer in answers]
    panel.plot(x, [answer.own for answer in answers], color=colour(1), marker="s", label="on its own grid")
    panel.plot(x, [answer.evaluated for answer in answers], color=colour(0), marker="o", label="on the fine grid")
    panel.set_xscale("log", base=2)
    panel.invert_xaxis()
    _finish(panel, spacing, "coverage of the best placement")


def _finish(panel: Axes, x: str, y: str) -> None:
    panel.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    panel.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=None, symbol=" %"))
    style_axes(panel, x, y)
    panel.legend(frameon=False, fontsize=8.5)
