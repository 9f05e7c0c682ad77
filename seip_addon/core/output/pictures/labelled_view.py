"""A rendered picture with the sensors' labels and a legend on it."""

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import Rectangle
from matplotlib.text import Text
from PIL import Image

from ...arrays import Boolean, Float
from ...choosing.placement.deployment import Deployment
from ...site.site import Site
from ...storage.files import whole_file
from .colours import Legend
from .drawing import (
    ATTRIBUTION_SIZE,
    NOTE_PAPER,
    Style,
    credits_of,
    draw_sensors,
    heading_of,
    new_page,
    percent,
    save_png,
    text_width,
)
from .palette import INK, PAPER

DPI = 160
LEGEND_LINE, CREDIT_LINE, MARGIN = 0.3, 0.19, 0.2  # inches
LEGEND_GAP, SWATCH = 0.22, 0.3  # inches
LEGEND_SIZE = 9.5  # points
BACKGROUND_COLOUR = "#e9edf0"
HIDDEN_NOTE = "outlined sensors stand behind something"


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
    """Write title, labels and legend on a picture of the scene, as PNG.

    Parameters
    ----------
    picture : path-like
        The rendered PNG, transparent where there is nothing.
    legend : Legend or None
        What the colours on the road mean; None where the road has none.
    created : str
        Time of the placement (ISO 8601), whose date the picture carries.
    """
    pixels = imread(str(picture))
    height, width = pixels.shape[0] / DPI, pixels.shape[1] / DPI
    heading = heading_of(site, deployment, width - 2 * MARGIN)
    rows = [] if legend is None else _legend_rows(legend, width)
    credit = credits_of(site, created)
    foot = len(rows) * LEGEND_LINE + len(credit) * CREDIT_LINE + MARGIN / 2
    page = height + heading.height + foot
    figure = new_page((width, page), DPI)
    view = figure.add_axes((0.0, foot / page, 1.0, height / page))
    view.set(xticks=(), yticks=(), facecolor=BACKGROUND_COLOUR)
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
    _draw_legend(figure, rows, credit, foot)
    save_png(path, figure)


def _legend_rows(legend: Legend, width: float) -> list[list[tuple[str, str]]]:
    """Return words and colour of each entry of the legend, in rows that fit the picture; the title has no colour."""
    classes = reversed(list(zip(legend.words, legend.colours, legend.shares, strict=True)))
    entries = [(legend.title, ""), *((f"{words}  {percent(share)}", colour) for words, colour, share in classes)]
    rows: list[list[tuple[str, str]]] = [[]]
    used = MARGIN
    for entry in entries:
        length = (
            SWATCH * bool(entry[1]) + text_width(entry[0], LEGEND_SIZE, "normal" if entry[1] else "bold") + LEGEND_GAP
        )
        if rows[-1] and used + length > width:
            rows.append([])
            used = MARGIN
        rows[-1].append(entry)
        used += length
    return rows


def _draw_legend(figure: Figure, rows: list[list[tuple[str, str]]], credit: Sequence[str], height: float) -> None:
    """Write at the foot of the picture what the colours on the road mean, and the credits below."""
    width, page = figure.get_size_inches()
    foot = figure.add_axes((0.0, 0.0, 1.0, height / page))
    foot.set(xlim=(0.0, width), ylim=(height, 0.0))
    foot.axis("off")
    for number, row in enumerate(rows):
        x, y = MARGIN - LEGEND_GAP, MARGIN / 2 + (number + 0.4) * LEGEND_LINE
        for words, colour in row:
            if colour:
                foot.add_patch(Rectangle((x + LEGEND_GAP, y - 0.07), 0.2, 0.14, facecolor=colour))
            style: Style = {"weight": "normal" if colour else "bold", "size": LEGEND_SIZE, "color": INK}
            x = _end(foot.text(x + LEGEND_GAP + (SWATCH if colour else 0.0), y, words, va="center", **style))
    for number, words in enumerate(credit):
        y = height - MARGIN / 4 - (len(credit) - number - 0.5) * CREDIT_LINE
        plain: Style = {"size": ATTRIBUTION_SIZE, "color": INK, "parse_math": False}
        foot.text(MARGIN, y, words, va="center", **plain)


def _end(text: Text) -> float:
    """Return where a text ends, inches from the left of the picture."""
    return float(text.get_window_extent().x1) / DPI


GAP = 24  # pixels between the two, and around them


def save_sheet(path: str | os.PathLike[str], view: Image.Image, plan: Image.Image) -> None:
    """Put a view to the left of a plan, scaled to the plan's width, as PNG."""
    high = round(view.height * plan.width / view.width)
    sheet = Image.new("RGB", (2 * plan.width + 3 * GAP, max(high, plan.height) + 2 * GAP), PAPER)
    sheet.paste(view.convert("RGB").resize((plan.width, high), Image.Resampling.LANCZOS), (GAP, GAP))
    sheet.paste(plan.convert("RGB"), (plan.width + 2 * GAP, GAP))
    with whole_file(path) as temporary:
        sheet.save(temporary, format="PNG")
