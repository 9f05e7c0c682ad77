"""A rendered picture with the sensors' labels and a legend on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import Rectangle

from .drawing import draw_sensors, draw_title, percent
from .palette import INK, PAPER, SEEN_COLOURS, SEEN_TWICE, SEEN_WORDS
from .storage import whole_file

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

    from .deployment import Deployment
    from .site import Site

    Float = NDArray[np.float64]

DPI = 160
HEAD, FOOT, MARGIN = 0.86, 0.42, 0.2  # inches
LEGEND_STEP = 2.6  # inches
HAZE = "#e9edf0"


def save_labelled_view(
    path: str | os.PathLike[str],
    picture: str | os.PathLike[str],
    site: Site,
    deployment: Deployment,
    anchors: Float,
) -> None:
    """Write title, labels and legend on a picture of the scene, as PNG.

    Parameters
    ----------
    path : path-like
        The picture to write.
    picture : path-like
        The rendered PNG, transparent where there is nothing.
    site : Site
    deployment : Deployment
        The chosen sensors and what they see.
    anchors : (k, 2) float64
        Where each sensor is on the picture, in shares of its width and height from the lower left.
    """
    pixels = imread(str(picture))
    height, width = pixels.shape[0] / DPI, pixels.shape[1] / DPI
    figure = Figure((width, height + HEAD + FOOT), dpi=DPI, facecolor=PAPER)
    FigureCanvasAgg(figure)  # measures text
    page = height + HEAD + FOOT
    view = figure.add_axes((0.0, FOOT / page, 1.0, height / page))
    view.set(xticks=(), yticks=(), facecolor=HAZE)
    view.spines[:].set_visible(False)
    view.imshow(pixels, extent=(0.0, width, 0.0, height), interpolation="nearest", aspect="auto")
    view.set(xlim=(0.0, width), ylim=(0.0, height))
    draw_sensors(view, deployment, anchors * (width, height), zorder=2)
    draw_title(figure, site, deployment, MARGIN)
    _draw_legend(figure, deployment)
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="png", metadata={"Software": None})


def _draw_legend(figure: Figure, deployment: Deployment) -> None:
    """Write at the foot of the picture what the colours on the road mean."""
    width, page = figure.get_size_inches()
    foot = figure.add_axes((0.0, 0.0, 1.0, FOOT / page))
    foot.set(xlim=(0.0, width), ylim=(0.0, FOOT))
    foot.axis("off")
    for place, times in enumerate(reversed(range(SEEN_TWICE + 1))):
        x = MARGIN + place * LEGEND_STEP
        share = np.count_nonzero(np.minimum(deployment.seen_by, SEEN_TWICE) == times) / len(deployment.seen_by)
        foot.add_patch(Rectangle((x, FOOT / 2 - 0.07), 0.2, 0.14, facecolor=SEEN_COLOURS[times]))
        foot.text(x + 0.3, FOOT / 2, f"{SEEN_WORDS[times]}  {percent(share)}", va="center", size=9, color=INK)
