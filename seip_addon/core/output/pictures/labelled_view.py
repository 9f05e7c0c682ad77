"""A rendered picture with the sensors' labels and a legend on it."""

import os
from dataclasses import dataclass

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import Rectangle
from matplotlib.text import Text

from ...arrays import Boolean, Float
from ...choosing.placement.deployment import Deployment
from ...site.site import Site
from .coverage_colours import Legend
from .drawing import draw_attribution, draw_sensors, draw_title, percent, save_png
from .palette import INK, PAPER, SOFT_INK

DPI = 160
HEAD, FOOT, MARGIN = 0.86, 0.42, 0.2  # inches
LEGEND_GAP = 0.22  # inches
BACKGROUND_COLOUR = "#e9edf0"


@dataclass(frozen=True, eq=False)
class Sight:
    """Positions on a picture, as shares of its width and height from the lower left.

    Parameters
    ----------
    sensors : (k, 2) float64
    hidden : (k,) bool
        Sensors that something stands in front of.
    targets : (t, 2) float64
    """

    sensors: Float
    hidden: Boolean
    targets: Float


def save_labelled_view(
    path: str | os.PathLike[str],
    picture: str | os.PathLike[str],
    site: Site,
    deployment: Deployment,
    legend: Legend | None,
    sight: Sight,
) -> None:
    """Write title, labels and legend on a picture of the scene, as PNG.

    Parameters
    ----------
    picture : path-like
        The rendered PNG, transparent where there is nothing.
    legend : Legend or None
        What the colours on the road mean; None where the road has none.
    """
    pixels = imread(str(picture))
    height, width = pixels.shape[0] / DPI, pixels.shape[1] / DPI
    figure = Figure((width, height + HEAD + FOOT), dpi=DPI, facecolor=PAPER)
    FigureCanvasAgg(figure)  # measures text
    page = height + HEAD + FOOT
    view = figure.add_axes((0.0, FOOT / page, 1.0, height / page))
    view.set(xticks=(), yticks=(), facecolor=BACKGROUND_COLOUR)
    view.spines[:].set_visible(False)
    view.imshow(pixels, extent=(0.0, width, 0.0, height), interpolation="nearest", aspect="auto")
    view.set(xlim=(0.0, width), ylim=(0.0, height))
    size = np.array((width, height))
    draw_sensors(view, deployment, sight.sensors * size, sight.targets * size, zorder=2, hidden=sight.hidden)
    draw_attribution(view, site.attribution)
    draw_title(figure, site, deployment, MARGIN)
    if sight.hidden.any():
        paper = {"boxstyle": "square,pad=0.25", "facecolor": PAPER, "alpha": 0.85, "edgecolor": "none"}
        note = "outlined sensors stand behind something"
        view.text(MARGIN, 0.08, note, va="bottom", size=8, color=SOFT_INK, bbox=paper, zorder=3)
    if legend is not None:
        _draw_legend(figure, legend)
    save_png(path, figure)


def _draw_legend(figure: Figure, legend: Legend) -> None:
    """Write at the foot of the picture what the colours on the road mean."""
    width, page = figure.get_size_inches()
    foot = figure.add_axes((0.0, 0.0, 1.0, FOOT / page))
    foot.set(xlim=(0.0, width), ylim=(0.0, FOOT))
    foot.axis("off")
    x = _end(foot.text(MARGIN, FOOT / 2, legend.title, va="center", size=9, color=INK, weight="bold"))
    for words, colour, share in reversed(list(zip(legend.words, legend.colours, legend.shares, strict=True))):
        foot.add_patch(Rectangle((x + LEGEND_GAP, FOOT / 2 - 0.07), 0.2, 0.14, facecolor=colour))
        label = f"{words}  {percent(share)}"
        x = _end(foot.text(x + LEGEND_GAP + 0.3, FOOT / 2, label, va="center", size=9, color=INK))


def _end(text: Text) -> float:
    """Return where a text ends, inches from the left of the picture."""
    return float(text.get_window_extent().x1) / DPI
