"""A rendered picture with the sensors' labels and a legend on it."""

import os
from dataclasses import dataclass

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import Rectangle

from ...arrays import Boolean, Float
from ...choosing.placement.deployment import Deployment
from ...site.site import Site
from .drawing import draw_attribution, draw_sensors, draw_title, percent, save_png
from .palette import INK, PAPER, SEEN_COLOURS, SEEN_TWICE, SEEN_WORDS, SOFT_INK

DPI = 160
HEAD, FOOT, MARGIN = 0.86, 0.42, 0.2  # inches
LEGEND_STEP = 2.35  # inches
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
    path: str | os.PathLike[str], picture: str | os.PathLike[str], site: Site, deployment: Deployment, sight: Sight
) -> None:
    """Write title, labels and legend on a picture of the scene, as PNG.

    Parameters
    ----------
    picture : path-like
        The rendered PNG, transparent where there is nothing.
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
    _draw_legend(figure, deployment, any_hidden=bool(sight.hidden.any()))
    save_png(path, figure)


def _draw_legend(figure: Figure, deployment: Deployment, *, any_hidden: bool) -> None:
    """Write at the foot of the picture what the colours on the road and the marks mean."""
    width, page = figure.get_size_inches()
    foot = figure.add_axes((0.0, 0.0, 1.0, FOOT / page))
    foot.set(xlim=(0.0, width), ylim=(0.0, FOOT))
    foot.axis("off")
    for place, times in enumerate(reversed(range(SEEN_TWICE + 1))):
        x = MARGIN + place * LEGEND_STEP
        share = np.count_nonzero(np.minimum(deployment.seen_by, SEEN_TWICE) == times) / len(deployment.seen_by)
        foot.add_patch(Rectangle((x, FOOT / 2 - 0.07), 0.2, 0.14, facecolor=SEEN_COLOURS[times]))
        foot.text(x + 0.3, FOOT / 2, f"{SEEN_WORDS[times]}  {percent(share)}", va="center", size=9, color=INK)
    if any_hidden:
        x = width - MARGIN
        foot.text(
            x, FOOT / 2, "outlined sensors stand behind something", ha="right", va="center", size=8, color=SOFT_INK
        )
