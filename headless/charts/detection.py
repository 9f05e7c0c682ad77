"""Charts of a detector: precision and recall, parts of the road users, and a training."""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from seip_addon.core.base.arrays import Float
from seip_addon.core.output.pictures.drawing import (
    FAINT_COLOUR,
    colour,
    mark,
    new_figure,
    save_chart,
    style_axes,
)
from seip_addon.core.output.pictures.palette import INK, PAPER, SERIES_COLOURS, SOFT_INK

PANEL_SIZE = (6.0, 4.4)  # inches
RING_MARK: dict[str, Any] = {"linestyle": "none", "marker": "o", "mfc": "none", "mec": INK}
PRECISION_LABEL = "average precision"


@dataclass(frozen=True)
class Bin:
    """Figures of the road users and detections in one bin.

    Parameters
    ----------
    low, high : float
        Edges of the bin; the lower one is included.
    wanted : int
        Number of road users to detect.
    value : float
        Value of the figure; NaN if the bin has no road users.
    """

    low: float
    high: float
    wanted: int
    value: float


BinnedFigure = tuple[str, str, Sequence[Bin]]
"""Labels, with units, of the binned quantity and of the figure, and the bins."""


def save_precision_recall_chart(
    path: str | os.PathLike[str], recall: Float, precision: Float, label: str, title: str
) -> None:
    """Draw precision against recall at each score, (s,) each, as PNG."""
    figure, (panel,) = new_figure(*PANEL_SIZE)
    panel.plot(recall, precision, label=label, color=colour(0), linewidth=1.6)
    panel.set(xlim=(0, 1.01), ylim=(0, 1.02))
    style_axes(panel, "recall", "precision", "y")
    save_chart(path, figure, title, [panel])


def save_parts_chart(path: str | os.PathLike[str], panels: Sequence[BinnedFigure], title: str) -> None:
    """Draw figures in bins of road users, with one panel for each binned quantity, as PNG.

    Numbers of road users are drawn behind the lines.
    """
    figure, axes = new_figure(PANEL_SIZE[0] * 0.85 * len(panels), PANEL_SIZE[1], len(panels))
    for panel, (what, name_of_figure, bins) in zip(axes, panels, strict=True):
        _draw_road_users(panel, [one.wanted for one in bins])
        panel.plot(range(len(bins)), [one.value for one in bins], linewidth=1.6, **mark_style(0))
        panel.set_xticks(range(len(bins)), [_span(one) for one in bins], fontsize=8)
        panel.set_xlim(-0.5, len(bins) - 0.5)
        panel.set_ylim(0, 1.03)
        style_axes(panel, what, name_of_figure, "y")
    save_chart(path, figure, title, axes[:1])


def save_training_chart(
    path: str | os.PathLike[str], loss: Sequence[float], validation: Mapping[int, float], title: str
) -> None:
    """Draw the loss and the average precision on validation frames over the steps of a training, as PNG.

    Parameters
    ----------
    loss : sequence of float
        Loss of each step.
    validation : mapping of int to float
        Average precision by number of steps; the best is marked.
    """
    figure, (panel,) = new_figure(PANEL_SIZE[0] * 1.25, PANEL_SIZE[1])
    each = np.arange(1, len(loss) + 1)
    panel.plot(each, loss, color=FAINT_COLOUR, linewidth=0.7, label="loss")
    panel.plot(
        each, _smoothed(np.asarray(loss, dtype=np.float64)), color=SERIES_COLOURS[0], linewidth=1.6, label="smoothed"
    )
    panel.set_yscale("log")
    panel.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    panel.yaxis.set_minor_formatter(NullFormatter())
    panel.set_xlim(0, len(loss))
    style_axes(panel, "step", "loss", "y")
    panels = [panel]
    if validation:
        beside = panel.twinx()
        panels.append(beside)
        steps, reached = list(validation), list(validation.values())
        beside.plot(steps, reached, color=SERIES_COLOURS[1], marker="s", markersize=4, label="validation AP")
        best = max(validation, key=lambda step: validation[step])
        label = f"best: {validation[best]:.2f} after {best} steps"
        beside.plot([best], [validation[best]], label=label, markersize=12, mew=1.3, **RING_MARK)
        beside.set_ylim(0, 1.02)
        beside.set_ylabel(f"{PRECISION_LABEL} on validation frames", color=INK)
        beside.tick_params(colors=SOFT_INK)
        for side in ("top", "left"):
            beside.spines[side].set_visible(False)
    save_chart(path, figure, title, panels)


def mark_style(row: int) -> dict[str, Any]:
    """Return the colour and mark of a series, by its number."""
    return {"color": colour(row), "marker": mark(row), "markersize": 6, "mec": PAPER, "mew": 0.7, "zorder": 4}


def _draw_road_users(panel: Axes, counts: Sequence[int]) -> None:
    """Draw the number of road users of each bin behind the lines, the largest half as high as the panel."""
    heights = 0.5 * np.asarray(counts) / max(1, *counts)
    panel.bar(range(len(counts)), heights, width=0.86, color="#eef0f2", zorder=0, label="road users")
    for place, (count, height) in enumerate(zip(counts, heights, strict=True)):
        panel.text(place, height + 0.012, f"{count}", ha="center", va="bottom", size=6.5, color=SOFT_INK, zorder=1)


def _span(one: Bin) -> str:
    """Return the label of a bin: ``0–10``, or ``60 +`` for one without an end."""
    return f"{one.low:g}–{one.high:g}" if math.isfinite(one.high) else f"{one.low:g} +"


def _smoothed(values: Float) -> Float:
    """Return the centred running mean over a fiftieth of the values; the window is shorter at the ends."""
    reach = len(values) // 100
    total = np.concatenate([[0.0], np.cumsum(values)])
    places = np.arange(len(values))
    first, last = np.maximum(places - reach, 0), np.minimum(places + reach + 1, len(values))
    mean: Float = (total[last] - total[first]) / (last - first)
    return mean
