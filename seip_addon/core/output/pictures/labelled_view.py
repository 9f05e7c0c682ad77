"""A rendered picture with the sensors' labels and a legend on it."""

import os
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import Rectangle

from ...choosing.placement.deployment import Deployment
from ...site.site import Site
from .drawing import (
    ATTRIBUTION_SIZE,
    NOTE_PAPER,
    Style,
    add_axes,
    credits_of,
    draw_sensors,
    heading_of,
    new_page,
    percent,
    save_png,
    text_width,
)
from .palette import INK, Legend
from .viewpoint import Sight

DPI = 160
LEGEND_LINE, CREDIT_LINE, MARGIN = 0.3, 0.19, 0.2  # inches
LEGEND_GAP, SWATCH = 0.22, 0.3  # inches
LEGEND_SIZE = 9.5  # points
BACKGROUND_COLOUR = "#e9edf0"
HIDDEN_NOTE = "outlined sensors stand behind something"


def save_labelled_view(  # noqa: PLR0913  # what is written on the picture
    path: str | os.PathLike[str],
    picture: str | os.PathLike[str],
    site: Site,
    deployment: Deployment,
    legend: Legend | None,
    sight: Sight,
    *,
    created: str = "",
) -> None:
    """Write title, labels and legend on a rendered picture of the scene, transparent where it is empty, as PNG.

    ``legend`` is None if the road has no colours; ``created`` is the time of the placement (ISO 8601), whose date the
    picture carries.
    """
    pixels = imread(str(picture))
    height, width = pixels.shape[0] / DPI, pixels.shape[1] / DPI
    heading = heading_of(site, deployment, width - 2 * MARGIN)
    entries = [] if legend is None else _legend_entries(legend, width)
    credit = credits_of(site, created)
    foot = (entries[-1][1] + 1 if entries else 0) * LEGEND_LINE + len(credit) * CREDIT_LINE + MARGIN / 2
    page = height + heading.height + foot
    figure = new_page((width, page), DPI)
    view = add_axes(figure, 0.0, foot, width, height)
    view.set(facecolor=BACKGROUND_COLOUR)
    view.spines[:].set_visible(False)
    view.imshow(pixels, extent=(0.0, width, 0.0, height), interpolation="nearest", aspect="auto")
    view.set(xlim=(0.0, width), ylim=(0.0, height))
    size = np.array((width, height))
    taken = []
    if sight.hidden.any():
        style: Style = {"va": "bottom", "size": ATTRIBUTION_SIZE, "color": INK, "bbox": NOTE_PAPER, "zorder": 3}
        note = view.text(MARGIN, 0.08, HIDDEN_NOTE, **style)
        extent = note.get_window_extent().padded(ATTRIBUTION_SIZE)
        taken.append(tuple((extent.get_points() / DPI - (0.0, foot)).ravel()))
    points, road = sight.sensors * size, sight.targets * size
    draw_sensors(view, deployment, points, road, zorder=2, hidden=sight.hidden, taken=taken)
    heading.draw(figure, MARGIN)
    _draw_foot(figure, entries, credit, foot)
    save_png(path, figure)


def _legend_entries(legend: Legend, width: float) -> list[tuple[float, int, str, str]]:
    """Return left end (inches), row, words and colour of each entry, in rows that fit; the title has no colour."""
    classes = reversed(list(zip(legend.words, legend.colours, legend.shares, strict=True)))
    entries = [(legend.title, ""), *((f"{words}  {percent(share)}", colour) for words, colour, share in classes)]
    placed, x, row = [], MARGIN, 0
    for words, colour in entries:
        length = SWATCH * bool(colour) + text_width(words, LEGEND_SIZE, "normal" if colour else "bold") + LEGEND_GAP
        if x > MARGIN and x + length > width:
            x, row = MARGIN, row + 1
        placed.append((x, row, words, colour))
        x += length
    return placed


def _draw_foot(
    figure: Figure, entries: Sequence[tuple[float, int, str, str]], credit: Sequence[str], height: float
) -> None:
    """Write at the foot of the picture what the colours on the road mean, and the credits below."""
    width = figure.get_size_inches()[0]
    foot = add_axes(figure, 0.0, 0.0, width, height)
    foot.set(xlim=(0.0, width), ylim=(height, 0.0))
    foot.axis("off")
    for x, row, words, colour in entries:
        y = MARGIN / 2 + (row + 0.4) * LEGEND_LINE
        if colour:
            foot.add_patch(Rectangle((x, y - 0.07), 0.2, 0.14, facecolor=colour))
        style: Style = {"weight": "normal" if colour else "bold", "size": LEGEND_SIZE, "color": INK, "va": "center"}
        foot.text(x + SWATCH * bool(colour), y, words, **style)
    for number, words in enumerate(credit):
        y = height - MARGIN / 4 - (len(credit) - number - 0.5) * CREDIT_LINE
        plain: Style = {"size": ATTRIBUTION_SIZE, "color": INK, "parse_math": False, "va": "center"}
        foot.text(MARGIN, y, words, **plain)
