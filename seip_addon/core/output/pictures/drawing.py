"""Elements shared by pictures: sensors with labels, title, PNG output."""

import io
import os
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from ...arrays import Boolean, Float
from ...choosing.placement.deployment import Deployment, price_text
from ...counts import counted
from ...site.site import Site
from ...storage.files import whole_file
from .callouts import place_callouts
from .palette import INK, PAPER, SOFT_INK

MARKERS = ("o", "s", "^", "D", "v", "P", "h", "X")
SENSOR_MARK: dict[str, Any] = {"linestyle": "none", "markersize": 11.0, "mfc": INK, "mec": PAPER, "mew": 1.6}
HIDDEN_MARK: dict[str, Any] = {"mfc": "none", "mec": INK, "mew": 2.0}
MARK_RADIUS, LABEL_SIZE, LABEL_PADDING = 8.0, 8.5, 0.35  # points, points, share of the size
ATTRIBUTION_ORDER = 100  # drawing order of credits: over everything
SIZE_STEP = 0.1  # points
MAX_LABELLED = 40  # more sensors than these get no labels on the picture


def save_png(path: str | os.PathLike[str], figure: Figure) -> None:
    """Write a figure as PNG; see `as_png`."""
    content = as_png(figure)
    with whole_file(path) as temporary:
        temporary.write_bytes(content)


def as_png(figure: Figure) -> bytes:
    """Return a figure as PNG; the same figure gives the same bytes.

    A palette of the 256 colours that stand for all others makes a file a third to a fifth as large.
    """
    drawn = io.BytesIO()
    figure.savefig(drawn, format="rgba")
    pixels = Image.frombytes("RGBA", figure.canvas.get_width_height(), drawn.getvalue()).convert("RGB")
    # Octrees keep rare colours, which here carry meaning; the median cut would mix them with frequent ones.
    picture = pixels.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    content = io.BytesIO()
    picture.save(content, format="PNG", optimize=True, dpi=(figure.dpi, figure.dpi))
    return content.getvalue()


def draw_polygons(axes: Axes, polygons: Iterable[Float], **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
    """Draw polygons by their corners, (k, 2) each; the limits of the axes stay."""
    axes.add_collection(PolyCollection(list(polygons), **style), autolim=False)


def add_axes(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Return axes without ticks at a place given in inches."""
    page_width, page_height = figure.get_size_inches()
    axes = figure.add_axes((left / page_width, bottom / page_height, width / page_width, height / page_height))
    axes.set(xticks=(), yticks=())
    return axes


def markers_of(deployment: Deployment) -> dict[str, str]:
    """Return a marker for each sensor type in use, by catalogue key."""
    keys = sorted({sensor.model.key for sensor in deployment.sensors})
    return {key: MARKERS[index % len(MARKERS)] for index, key in enumerate(keys)}


def draw_sensors(
    axes: Axes, deployment: Deployment, points: Float, road: Float, *, zorder: float, hidden: Boolean | None = None
) -> None:
    """Mark each sensor and write its label, type and height next to it, no label on another.

    Parameters
    ----------
    axes : Axes
        With their final limits.
    points : (k, 2) float64
        Where each sensor is, in data coordinates.
    road : (t, 2) float64
        Position of each target; labels avoid them where possible.
    zorder : float
        Drawing order of the marks; labels and their lines are drawn below.
    hidden : (k,) bool, optional
        Hidden sensors, which are marked by an outline only.
    """
    if 0 < len(points) <= MAX_LABELLED:
        words = [f"{s.label}  {s.model.key} · {s.height:.3g} m{s.turned}" for s in deployment.sensors]
        draw_callouts(axes, points, words, road, zorder - 0.5)
    markers = markers_of(deployment)
    hidden = np.zeros(len(points), dtype=bool) if hidden is None else hidden
    for sensor, point, behind in zip(deployment.sensors, points, hidden, strict=True):
        style = SENSOR_MARK | HIDDEN_MARK if behind else SENSOR_MARK
        axes.plot(*point, marker=markers[sensor.model.key], zorder=zorder, **style)


def draw_title(figure: Figure, site: Site, deployment: Deployment, left: float) -> None:
    """Write the site's name and the result at the head of a page, ``left`` inches from its border."""
    width, height = figure.get_size_inches()
    style = {"x": left / width, "ha": "left", "va": "top", "parse_math": False}
    room = width - 2 * left
    title = figure.text(y=1 - 0.20 / height, s=site.name, weight="bold", color=INK, **style)
    line = figure.text(y=1 - 0.55 / height, s=summary(deployment), color=SOFT_INK, **style)
    _fit(title, room, 17.0, 12.0)
    _fit(line, room, 11.0, 4.0)


def _fit(text: Text, room: float, size: float, least: float) -> None:
    """Fit a text into a width in inches: at a size in points, a smaller one down to ``least``, or cut short."""
    words = text.get_text()
    text.set_fontsize(size)
    while _inches(text) > room and size > least:  # letters have whole pixels: widths do not quite follow the size
        size = max(min(size - SIZE_STEP, size * room / _inches(text)), least)
        text.set_fontsize(size)
    for length in range(len(words) - 1, 0, -1):
        if _inches(text) <= room:
            return
        text.set_text(f"{words[:length].rstrip()}…")


def _inches(text: Text) -> float:
    """Return the width of a text on its page."""
    figure = text.get_figure(root=True)
    return float(text.get_window_extent().width / figure.dpi) if figure is not None else 0.0


def draw_attribution(axes: Axes, attribution: Sequence[str]) -> None:
    """Write the credits of a map's sources at its lower right corner, over what is drawn there."""
    if not attribution:
        return
    paper: dict[str, Any] = {"boxstyle": "square,pad=0.25", "facecolor": PAPER, "alpha": 0.85, "edgecolor": "none"}
    style: dict[str, Any] = {"ha": "right", "va": "bottom", "size": 7, "color": INK, "bbox": paper, "parse_math": False}
    axes.text(0.995, 0.005, "\n".join(attribution), transform=axes.transAxes, zorder=ATTRIBUTION_ORDER, **style)


def summary(deployment: Deployment) -> str:
    """Return the result in one line."""
    sensors = counted(len(deployment.sensors), "sensor sees", "sensors see")
    band = deployment.gain_band
    between = f" ({percent(band.low)} to {percent(band.high)})" if band is not None and band.sheets else ""
    parts = [f"{sensors} {percent(deployment.coverage)} of the road{between}"]
    if deployment.returns is not None:
        parts.insert(0, deployment.returns.describe())
    else:
        if deployment.central is not None:
            parts.append(f"{percent(deployment.central)} of its weighted part")
        parts.append(f"{percent(deployment.seen_twice)} seen twice")
    parts.append(f"price {price_text(deployment.price, installed=deployment.installed)}")
    return "  ·  ".join(parts)


def percent(share: float) -> str:
    """Return a share in per cent; only all of it is 100 %, and only nothing is 0 %."""
    if 0.0 < share < 0.0005:
        return "<0.1%"
    return f"{min(share, 1.0 if share == 1.0 else 0.999):.1%}"


def draw_callouts(axes: Axes, points: Float, words: list[str], road: Float, zorder: float) -> None:
    """Write words next to points (k, 2), in data coordinates, off the road (t, 2) and each other where they can be."""
    boxed = {"boxstyle": f"round,pad={LABEL_PADDING}", "facecolor": PAPER, "edgecolor": SOFT_INK, "linewidth": 0.6}
    texts = [
        axes.text(0, 0, label, ha="center", va="center", size=LABEL_SIZE, color=INK, bbox=boxed, zorder=zorder)
        for label in words
    ]
    point = axes.figure.dpi / 72
    extents = [text.get_window_extent() for text in texts]
    sizes = np.array([(extent.width, extent.height) for extent in extents]) + 2 * LABEL_PADDING * LABEL_SIZE * point
    anchors = axes.transData.transform(points)
    bounds = axes.get_window_extent().padded(-4.0 * point).extents
    centres = place_callouts(anchors, sizes, bounds, MARK_RADIUS * point, axes.transData.transform(road))
    for text, start, end in zip(texts, points, axes.transData.inverted().transform(centres), strict=True):
        text.set_position(end)
        axes.plot(*zip(start, end, strict=True), color=INK, linewidth=0.9, zorder=zorder - 0.1)
