"""Charts of a coverage study."""

import math
import os
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from seip_addon.core.output.pictures.drawing import (
    DASHED,
    add_legend,
    colour,
    mark,
    new_figure,
    save_chart,
    style_axes,
)
from seip_addon.core.output.pictures.palette import INK, PAPER, SOFT_INK

from .cells import CENTRAL_WEIGHTS, COUNTS, CoverageStudy

PANEL_HEIGHT, PANEL_WIDTH, MIN_PANELS = 4.2, 3.65, 3  # inches, inches, least width of a chart in panels
TYPE_SHIFT = 0.09  # of the step between two heights, from one type to the next
NO_SPAN = (math.nan, math.nan)


def save_height_chart(path: str | os.PathLike[str], study: CoverageStudy, title: str) -> None:
    """Draw coverage against mounting height, a panel for each number of sensors, as PNG.

    A bar above a mark ends at the largest coverage that the solver could not rule out. Cells without a placement are
    left out.
    """
    figure, panels = _figure(len(COUNTS))
    ticks = [*(f"{height:g}" for height in study.heights), "free"]
    for panel, count in zip(panels, COUNTS, strict=True):
        for row, sensor in enumerate(study.sensors):
            # Side by side, so that no type's bar stands on another's mark.
            aside = TYPE_SHIFT * (row - (len(study.sensors) - 1) / 2)
            spans = [study.possible(sensor, count, height) or NO_SPAN for height in (*study.heights, None)]
            x = [place + aside for place in range(len(spans))]
            _line(panel, row, x[:-1], [low for low, _ in spans[:-1]], label=sensor)
            _line(panel, row, x[-1:], [spans[-1][0]])
            for place, (low, high) in zip(x, spans, strict=True):
                if high > low:
                    panel.plot((place, place), (low, high), color=colour(row), linewidth=1.1, marker="_", markersize=5)
        panel.set_title(f"N = {count}", color=INK, fontsize=10)
        panel.set_xticks(range(len(ticks)), ticks)
        panel.set_xlim(-0.5, len(ticks) - 0.5)
        _style_shares(panel, "mounting height (m)")
    if any(case.span[1] > case.span[0] for case in study.cases if case.weight == 1.0):
        panels[0].plot([], [], color=SOFT_INK, linewidth=1.1, marker="_", label="left open by the solver")
    _save(path, figure, panels, f"{title}: coverage by sensor type, height and number")


def save_weight_chart(path: str | os.PathLike[str], study: CoverageStudy, title: str) -> None:
    """Draw whole and central coverage against the weight of the centre, a panel for each type, as PNG."""
    figure, panels = _figure(len(study.sensors))
    weights = (1.0, *CENTRAL_WEIGHTS)
    for panel, sensor in zip(panels, study.sensors, strict=True):
        for row, count in enumerate(COUNTS):
            found = [study.find(sensor, count, weight=weight) for weight in weights]
            central = [math.nan if case is None else case.deployment.central or 0.0 for case in found]
            whole = [math.nan if case is None else case.deployment.coverage for case in found]
            _line(panel, row, range(len(weights)), central, label=f"N = {count}, centre")
            _line(panel, row, range(len(weights)), whole, label=f"N = {count}, whole", dashed=True)
        panel.set_title(sensor, color=INK, fontsize=10, parse_math=False)
        panel.set_xticks(range(len(weights)), ["1\n(vanilla)", *(f"{weight:g}" for weight in CENTRAL_WEIGHTS)])
        _style_shares(panel, "weight of the centre")
    _save(path, figure, panels, f"{title}: vanilla against weighted placement")


def _figure(count: int) -> tuple[Figure, Sequence[Axes]]:
    return new_figure(PANEL_WIDTH * max(count, MIN_PANELS), PANEL_HEIGHT, count, sharey=True)


def _save(path: str | os.PathLike[str], figure: Figure, panels: Sequence[Axes], title: str) -> None:
    panels[0].set_ylabel("share of targets seen", color=INK)
    add_legend(figure, panels[:1], len(panels[0].get_legend_handles_labels()[1]))
    save_chart(path, figure, title)


def _line(
    panel: Axes, row: int, x: Sequence[float], y: Sequence[float], *, label: str | None = None, dashed: bool = False
) -> None:
    style = {"linestyle": DASHED, "mfc": PAPER, "linewidth": 1.0} if dashed else {"linewidth": 1.6}
    panel.plot(x, y, color=colour(row), marker=mark(row), markersize=5, label=label, **style)


def _style_shares(panel: Axes, x: str) -> None:
    panel.set_ylim(0, 1.03)
    panel.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    style_axes(panel, x, grid="y")
