"""Charts of average precision against price and coverage."""

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from headless.charts.detection import (
    PANEL_SIZE,
    PRECISION_LABEL,
    check_drawn,
    mark_style,
    placement_name,
)

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from seip_addon.core.arrays import Float
from seip_addon.core.estimates import Interval
from seip_addon.core.output.pictures.callouts import place_callouts
from seip_addon.core.output.pictures.chart_style import (
    DASHED,
    FAINT_COLOUR,
    add_legend,
    colour,
    new_figure,
    set_title,
    style_axes,
)
from seip_addon.core.output.pictures.drawing import save_png
from seip_addon.core.output.pictures.palette import INK, PAPER, SOFT_INK

LABEL: dict[str, Any] = {"size": 8.0, "color": INK, "ha": "center", "va": "center", "zorder": 5, "parse_math": False}


@dataclass(frozen=True)
class PrecisionCell:
    """Average precision of one type and number of sensors, by seed.

    Parameters
    ----------
    sensor : str
        Catalogue key.
    count : int
        N, the largest number of sensors allowed.
    price : float, US dollars
    coverage : float, 0 to 1
    values : tuple of float
        Average precision by seed.
    interval : (float, float) or None
        95 % interval of their mean, or None.
    """

    sensor: str
    count: int
    price: float
    coverage: float
    values: tuple[float, ...]
    interval: Interval | None = None

    @property
    def mean(self) -> float:
        """Mean over the seeds."""
        return float(np.mean(self.values))

    @property
    def name(self) -> str:
        """Name in charts."""
        return placement_name(self.count, self.sensor)


def save_price_chart(path: str | os.PathLike[str], cells: Sequence[PrecisionCell], title: str) -> None:
    """Draw average precision against price, with the front named, as PNG."""
    check_drawn(cells, "average precision against price")
    figure, (panel,) = new_figure(PANEL_SIZE[0] * 1.25, PANEL_SIZE[1])
    best = _front(cells)
    _scatter(panel, cells, [cell.price for cell in cells])
    panel.step(
        [cell.price for cell in best],
        [cell.mean for cell in best],
        where="post",  # a higher price never gives less: cheaper placements can be chosen, too
        color=SOFT_INK,
        linewidth=1.1,
        linestyle=DASHED,
        zorder=1,
        label="front: nothing cheaper detects as well",
    )
    panel.set_xscale("log")
    panel.margins(x=0.12)
    panel.xaxis.set_major_formatter(FuncFormatter(lambda price, _: f"${price / 1000:,.0f}k"))
    panel.xaxis.set_minor_formatter(NullFormatter())
    prices = [cell.price for cell in cells]
    ticks = [step * 10.0**decade for decade in range(7) for step in (1, 2, 5)]
    panel.set_xticks([tick for tick in ticks if min(prices) / 1.5 <= tick <= max(prices) * 1.5])
    _precision_axis(panel, _reached(cells), "price of all sensors")
    add_legend(figure, [panel])
    set_title(figure, title)
    _name(figure, panel, [(cell.price, cell.mean, cell.name, cell in best) for cell in cells])
    save_png(path, figure)


def save_coverage_chart(
    path: str | os.PathLike[str],
    cells: Sequence[PrecisionCell],
    correlation: float,
    interval: Interval | None,
    title: str,
) -> None:
    """Draw average precision against coverage, with their rank correlation, as PNG.

    Parameters
    ----------
    correlation : float
        Spearman's rank correlation of coverage and mean average precision.
    interval : (float, float) or None
        Its 95 % interval, where there is one.
    """
    check_drawn(cells, "average precision against coverage")
    figure, (panel,) = new_figure(*PANEL_SIZE)
    _scatter(panel, cells, [cell.coverage for cell in cells])
    panel.margins(x=0.1)
    panel.xaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{100 * share:.0f} %"))
    _precision_axis(panel, _reached(cells), "coverage: share of the road that the placement sees")
    between = "" if interval is None else f" ({interval[0]:.2f} to {interval[1]:.2f})"
    panel.set_title(f"rank correlation ρ = {correlation:.2f}{between}", color=SOFT_INK, fontsize=9.5)
    add_legend(figure, [panel])
    set_title(figure, title)
    _name(figure, panel, [(cell.coverage, cell.mean, cell.name, False) for cell in cells])
    save_png(path, figure)


def _sensors(cells: Sequence[PrecisionCell]) -> list[str]:
    return list(dict.fromkeys(cell.sensor for cell in cells))


def _scatter(panel: Axes, cells: Sequence[PrecisionCell], x: Sequence[float]) -> None:
    """Mark each cell's mean with its interval, a colour and a mark for each type."""
    for row, sensor in enumerate(_sensors(cells)):
        own = [(place, cell) for place, cell in zip(x, cells, strict=True) if cell.sensor == sensor]
        for place, cell in own:
            _bar(panel, place, cell.interval, row)
        places, means = [place for place, _ in own], [cell.mean for _, cell in own]
        panel.plot(places, means, label=sensor, linestyle="none", **mark_style(row))


def _bar(panel: Axes, x: float, interval: Interval | None, row: int) -> None:
    if interval is not None:
        panel.plot((x, x), interval, color=colour(row), linewidth=1.1, marker="_", markersize=5, zorder=3)


def _front(cells: Sequence[PrecisionCell]) -> list[PrecisionCell]:
    """Return the Pareto front of cells by price and average precision, the cheapest first."""
    best: list[PrecisionCell] = []
    for cell in sorted(cells, key=lambda cell: (cell.price, -cell.mean)):
        if not best or cell.mean > best[-1].mean:
            best.append(cell)
    return best


def _reached(cells: Sequence[PrecisionCell]) -> list[float]:
    return [value for cell in cells for value in (*cell.values, *(cell.interval or ()))]


def _precision_axis(panel: Axes, reached: Sequence[float], x: str) -> None:
    """Scale the axis to the values; on an axis from 0, differences near 1 would not be visible."""
    lowest = min(value for value in reached if math.isfinite(value))
    panel.set_ylim(max(0.0, math.floor(10 * lowest - 0.3) / 10), 1.005 if max(reached) <= 1 else None)
    style_axes(panel, x, PRECISION_LABEL, "y")


def _name(figure: Figure, panel: Axes, named: Sequence[tuple[float, float, str, bool]]) -> None:
    """Write names (x, y, name, whether highlighted) next to their marks, without overlaps."""
    figure.draw_without_rendering()  # fixes the positions and limits of panels, which names are placed by
    figure.set_layout_engine("none")
    texts = [panel.text(x, y, words, weight="bold" if out else "normal", **LABEL) for x, y, words, out in named]
    extents = [text.get_window_extent() for text in texts]
    sizes = np.array([(extent.width, extent.height) for extent in extents])
    points = panel.transData.transform([(x, y) for x, y, _, _ in named])
    radius, frame = 4.0 * figure.dpi / 72, panel.get_window_extent()
    lines = np.concatenate([_along(panel, line) for line in panel.get_lines()])
    centres = place_callouts(points, sizes, frame.extents, radius, lines)
    back = panel.transData.inverted()
    for text, point, centre, size in zip(texts, points, centres, sizes, strict=True):
        text.set(x=back.transform(centre)[0], y=back.transform(centre)[1])
        gap = np.maximum(np.abs(point - centre) - size / 2, 0)
        if np.hypot(*gap) > 2.5 * radius:  # so far that the name could be attributed to another mark
            panel.plot(*back.transform([point, centre]).T, color=FAINT_COLOUR, linewidth=0.7, zorder=1)
            text.set_bbox({"facecolor": PAPER, "edgecolor": "none", "pad": 0.8})


def _along(panel: Axes, line: Line2D) -> Float:
    """Return points along a drawn line in pixels, (n, 2) float64."""
    corners: Float = panel.transData.transform(line.get_xydata())
    corners = corners[np.isfinite(corners).all(axis=1)]
    if len(corners) < 2:
        return corners
    along: Float = np.linspace(corners[:-1], corners[1:], 20).reshape(-1, 2)
    return along
