"""Chart of average precision against price."""

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from headless.charts.detection import (
    PANEL_SIZE,
    PRECISION_LABEL,
    mark_style,
)

import numpy as np
from matplotlib.ticker import FuncFormatter, NullFormatter

from seip_addon.core.base.estimates import Interval
from seip_addon.core.output.pictures.drawing import (
    DASHED,
    add_legend,
    colour,
    draw_callouts,
    new_figure,
    save_png,
    set_title,
    style_axes,
)
from seip_addon.core.output.pictures.palette import SOFT_INK


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
        return f"{self.count} × {self.sensor}"


def save_price_chart(path: str | os.PathLike[str], cells: Sequence[PrecisionCell], title: str) -> None:
    """Draw average precision against price, with its front, as PNG."""
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
    panel.set_xlim(panel.get_xlim())  # lines to names must not change the limits
    figure.draw_without_rendering()  # fixes positions and limits of the panel, in which the names are placed
    figure.set_layout_engine("none")
    points = np.array([(cell.price, cell.mean) for cell in cells])
    draw_callouts(panel, points, [cell.name for cell in cells], points, zorder=5)
    save_png(path, figure)


def _front(cells: Sequence[PrecisionCell]) -> list[PrecisionCell]:
    """Return the Pareto front of cells by price and average precision, the cheapest first."""
    best: list[PrecisionCell] = []
    for cell in sorted(cells, key=lambda cell: (cell.price, -cell.mean)):
        if not best or cell.mean > best[-1].mean:
            best.append(cell)
    return best
