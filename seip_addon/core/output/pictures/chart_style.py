"""Style of all charts: colours, marks, axes, legends and titles."""

import os
from collections.abc import Sequence
from typing import Any, Literal

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .drawing import Window, new_page, save_png, window_around
from .palette import INK, SERIES_COLOURS, SOFT_INK

MARKERS = ("o", "s", "^", "D", "v", "P", "X")  # one more than colours, so that pairs repeat only after 42 series
DASHED = (0, (4, 2))
GRID_COLOUR, FAINT_COLOUR = "#e3e6e8", "#c3c9ce"


def colour(row: int) -> str:
    """Return the colour of a series."""
    return SERIES_COLOURS[row % len(SERIES_COLOURS)]


def mark(row: int) -> str:
    """Return the marker of a series."""
    return MARKERS[row % len(MARKERS)]


def new_figure(
    width: float, height: float, panels: int = 1, *, dpi: int = 160, sharey: bool = False
) -> tuple[Figure, Sequence[Axes]]:
    """Return a figure, ``width`` by ``height`` inches, with panels side by side."""
    figure = new_page((width, height), dpi, layout="constrained")
    return figure, list(figure.subplots(1, panels, sharey=sharey, squeeze=False)[0])


def limits_around(bounds: Window, margin: float) -> tuple[dict[str, Any], float]:
    """Return the limits of a plan around (left, bottom, right, top), with a relative margin, and its shape.

    The shape is how many times as high as wide it is.
    """
    left, bottom, right, top = bounds
    left, bottom, right, top = window_around(bounds, margin * max(right - left, top - bottom))
    limits = {"xlim": (left, right), "ylim": (bottom, top), "aspect": "equal"}
    return limits, (top - bottom) / (right - left)


def style_axes(panel: Axes, x: str = "", y: str = "", grid: Literal["both", "x", "y"] = "both", **font: Any) -> None:  # noqa: ANN401 -- matplotlib's own
    """Label the axes, and draw grid, ticks and borders as in all charts; empty labels are left out."""
    if x:
        panel.set_xlabel(x, color=INK, **font)
    if y:
        panel.set_ylabel(y, color=INK, **font)
    panel.grid(axis=grid, color=GRID_COLOUR, linewidth=0.8)
    panel.set_axisbelow(True)
    panel.tick_params(which="both", colors=SOFT_INK)
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)


def set_title(figure: Figure, title: str) -> None:
    """Write the title above all panels."""
    figure.suptitle(title, color=INK, fontsize=12, parse_math=False)


def add_legend(figure: Figure, panels: Sequence[Axes], columns: int | None = None) -> None:
    """Write one legend of the panels' entries below all panels, in the number of columns that fit."""
    handles = [handle for panel in panels for handle in panel.get_legend_handles_labels()[0]]
    labels = [str(handle.get_label()) for handle in handles]
    if columns is None:
        widths, room = [0.6 + 0.07 * len(label) for label in labels], figure.get_figwidth()  # inches, about
        columns = len(labels) if sum(widths) < room else max(1, int(room // max(widths)))
    plain_legend(figure, handles, labels, loc="outside lower center", ncols=columns)


def plain_legend(figure: Figure, handles: Sequence[Artist], labels: Sequence[str], **style: Any) -> None:  # noqa: ANN401 -- as above
    """Write a legend without a frame whose labels are never taken for formulas."""
    legend = figure.legend(handles, labels, **{"frameon": False, "fontsize": 9} | style)
    for text in legend.get_texts():
        text.set_parse_math(False)


def save_chart(path: str | os.PathLike[str], figure: Figure, title: str, panels: Sequence[Axes] = ()) -> None:
    """Write the title and, if panels are given, their legend, and save the chart as PNG."""
    if panels:
        add_legend(figure, panels)
    set_title(figure, title)
    save_png(path, figure)
