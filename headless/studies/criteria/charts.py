"""Charts of placements of one type and number: average precision against coverage, and how criteria agree with it."""

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.ticker import FuncFormatter

from seip_addon.core.errors import SeipError
from seip_addon.core.estimates import Interval, IntervalEstimate
from seip_addon.core.output.pictures.chart_style import (
    DASHED,
    FAINT_COLOUR,
    colour,
    interval_ends,
    mark,
    new_figure,
    save_chart,
)
from seip_addon.core.output.pictures.chart_style import style_axes as style
from seip_addon.core.output.pictures.palette import INK, PAPER, SERIES_COLOURS, SOFT_INK

PANEL_SIZE = (6.4, 4.6)  # inches
BAR_HEIGHT = 0.5  # inches that a criterion takes


@dataclass(frozen=True)
class PlacementMark:
    """A placement in a chart.

    Parameters
    ----------
    kind : str
        How it was drawn; the first of all is ringed.
    interval : (float, float) or None
        95 % interval of the average precision, where there is one.
    """

    kind: str
    coverage: float
    average_precision: float
    interval: Interval | None = None


@dataclass(frozen=True)
class CriterionBar:
    """A criterion with its rank correlation.

    Parameters
    ----------
    beforehand : bool
        Whether it can be had beforehand; others are drawn faintly.
    """

    name: str
    correlation: IntervalEstimate
    beforehand: bool = True


def save_placements_chart(
    path: str | os.PathLike[str], placements: Sequence[PlacementMark], found: str, title: str
) -> None:
    """Draw average precision against coverage, a mark for each placement, the first one ringed, as PNG.

    Parameters
    ----------
    found : str
        The correlation, in words.
    """
    if not placements:
        raise SeipError("there is nothing to draw a chart of placements from: evaluate some first")
    figure, (panel,) = new_figure(*PANEL_SIZE)
    kinds = list(dict.fromkeys(one.kind for one in placements))
    for row, kind in enumerate(kinds):
        own = [one for one in placements if one.kind == kind]
        for one in own:
            if one.interval is not None:
                panel.plot([one.coverage] * 2, one.interval, color=colour(row), linewidth=0.9, alpha=0.55, zorder=2)
        places, values = [one.coverage for one in own], [one.average_precision for one in own]
        panel.plot(
            places,
            values,
            label=kind,
            linestyle="none",
            color=colour(row),
            marker=mark(row),
            markersize=6,
            mec=PAPER,
            mew=0.7,
            zorder=4,
        )
    first = placements[0]
    ring: dict[str, Any] = {
        "linestyle": "none",
        "marker": "o",
        "mfc": "none",
        "mec": INK,
        "markersize": 13,
        "mew": 1.4,
        "zorder": 5,
    }
    panel.plot([first.coverage], [first.average_precision], **ring)
    panel.xaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{100 * share:.0f} %"))
    panel.margins(x=0.06, y=0.08)
    style(panel, "coverage: share of the road that the placement sees", "average precision", "both")
    panel.set_title(found, color=SOFT_INK, fontsize=9.5)
    save_chart(path, figure, title, [panel])


def save_criteria_chart(
    path: str | os.PathLike[str], criteria: Sequence[CriterionBar], ceiling: IntervalEstimate, title: str
) -> None:
    """Draw the rank correlation of each criterion with its interval, and the noise ceiling, as PNG."""
    if not criteria:
        raise SeipError("there is nothing to draw a chart of criteria from: evaluate some placements first")
    figure, (panel,) = new_figure(PANEL_SIZE[0] * 1.25, 1.6 + BAR_HEIGHT * len(criteria))
    for row, one in enumerate(criteria):
        face = SERIES_COLOURS[1] if one.beforehand else FAINT_COLOUR
        value = 0.0 if math.isnan(one.correlation.value) else one.correlation.value
        panel.barh(row, value, height=0.62, color=face, zorder=2)
        if math.isfinite(one.correlation.high - one.correlation.low):
            panel.plot(interval_ends(one.correlation), [row, row], color=INK, linewidth=1.3, marker="|", zorder=4)
        ink = PAPER if one.beforehand else INK
        panel.text(0.01, row, f"{one.correlation.value:.2f}", va="center", size=8.5, color=ink, zorder=5)
    if math.isfinite(ceiling.value):
        panel.axvspan(*interval_ends(ceiling), color="#eef0f2", zorder=0)
        panel.axvline(
            ceiling.value, color=SOFT_INK, linestyle=DASHED, label="noise ceiling, with its interval", zorder=1
        )
    panel.set_yticks(range(len(criteria)), [one.name for one in criteria])
    panel.invert_yaxis()
    panel.set_xlim(right=1.0)
    style(panel, "Spearman's rank correlation with average precision", grid="x")
    save_chart(path, figure, title, [panel])
