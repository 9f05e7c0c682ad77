"""Chart of average precision against price."""

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

from seip_addon.core.base.arrays import Float
from seip_addon.core.base.estimates import Interval
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
from seip_addon.core.output.pictures.labels import place_callouts
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
    for row, sensor in enumerate(dict.fromkeys(cell.sensor for cell in cells)):
        own = [cell for cell in cells if cell.sensor == sensor]
        for cell in own:
            if cell.interval is not None:
                style: dict[str, Any] = {"color": colour(row), "linewidth": 1.1, "marker": "_", "markersize": 5}
                panel.plot((cell.price, cell.price), cell.interval, zorder=3, **style)
        prices, means = [cell.price for cell in own], [cell.mean for cell in own]
        panel.plot(prices, means, label=sensor, linestyle="none", **mark_style(row))
    best = _front(cells)
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
    # Scaled to the values: on an axis from 0, differences near 1 would not be visible.
    reached = [value for cell in cells for value in (*cell.values, *(cell.interval or ()))]
    lowest = min(value for value in reached if math.isfinite(value))
    panel.set_ylim(max(0.0, math.floor(10 * lowest - 0.3) / 10), 1.005 if max(reached) <= 1 else None)
    style_axes(panel, "price of all sensors", PRECISION_LABEL, "y")
    add_legend(figure, [panel])
    set_title(figure, title)
    _name(figure, panel, cells, best)
    save_png(path, figure)


def _front(cells: Sequence[PrecisionCell]) -> list[PrecisionCell]:
    """Return the Pareto front of cells by price and average precision, the cheapest first."""
    best: list[PrecisionCell] = []
    for cell in sorted(cells, key=lambda cell: (cell.price, -cell.mean)):
        if not best or cell.mean > best[-1].mean:
            best.append(cell)
    return best


def _name(figure: Figure, panel: Axes, cells: Sequence[PrecisionCell], best: Sequence[PrecisionCell]) -> None:
    """Write the name of each cell next to its mark, without overlaps; those of the front in bold."""
    figure.draw_without_rendering()  # fixes the positions and limits of panels, which names are placed by
    figure.set_layout_engine("none")
    texts = [
        panel.text(cell.price, cell.mean, cell.name, weight="bold" if cell in best else "normal", **LABEL)
        for cell in cells
    ]
    extents = [text.get_window_extent() for text in texts]
    sizes = np.array([(extent.width, extent.height) for extent in extents])
    points = panel.transData.transform([(cell.price, cell.mean) for cell in cells])
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
