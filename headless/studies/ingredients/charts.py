"""Chart of the loss at unseen sites if an ingredient of the training is left out."""

import os
from collections.abc import Sequence
from dataclasses import dataclass

from seip_addon.core.errors import SeipError
from seip_addon.core.estimates import IntervalEstimate
from seip_addon.core.output.pictures.chart_style import (
    DASHED,
    MARKERS,
    interval_ends,
    new_figure,
    save_chart,
    style_axes,
)
from seip_addon.core.output.pictures.palette import INK, PAPER, SERIES_COLOURS, SOFT_INK

PANEL_WIDTH, ROW_HEIGHT = 2.7, 0.42  # inches


@dataclass(frozen=True)
class IngredientMark:
    """Change of the average precision of a test without an ingredient."""

    test: str
    variant: str
    change: IntervalEstimate


def save_ingredients_chart(path: str | os.PathLike[str], marks: Sequence[IngredientMark], title: str) -> None:
    """Draw a panel for each test, and in it a row for each variant: the change with its interval, as PNG."""
    if not marks:
        raise SeipError("there are no variants to draw: first train with an ingredient left out")
    tests, variants = (list(dict.fromkeys(getattr(one, name) for one in marks)) for name in ("test", "variant"))
    size = (2.0 + PANEL_WIDTH * len(tests), 1.3 + ROW_HEIGHT * len(variants))
    figure, panels = new_figure(*size, len(tests), sharey=True)
    for panel, test in zip(panels, tests, strict=True):
        for one in marks:
            if one.test == test:
                row = variants.index(one.variant)
                ends = [100 * end for end in interval_ends(one.change)]
                panel.plot(ends, (row, row), color=SERIES_COLOURS[0], linewidth=1.2, marker="|")
                panel.plot(100 * one.change.value, row, color=SERIES_COLOURS[0], marker=MARKERS[0], mec=PAPER)
        panel.axvline(0.0, color=SOFT_INK, linewidth=1.0, linestyle=DASHED)
        panel.set_title(test.replace(", ", ",\n"), fontsize=9, color=INK, parse_math=False)
        style_axes(panel, "change of AP@0.7 (points)", fontsize=8.5)
    panels[0].set_yticks(range(len(variants)), variants, fontsize=9, parse_math=False)
    panels[0].invert_yaxis()
    save_chart(path, figure, title)
