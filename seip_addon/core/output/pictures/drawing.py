"""Elements shared by pictures: sensors with labels, title, PNG output; and the style of all charts."""

import io
import os
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
import shapely
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.ft2font import FT2Font, LoadFlags
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path
from PIL import Image
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Boolean, Float
from ...base.counts import counted, round_number
from ...choosing.placement.deployment import Deployment, price_text
from ...site.site import Site
from ...storage.files import whole_file
from .labels import place_callouts
from .palette import INK, PAPER, SERIES_COLOURS, SOFT_INK

Style = dict[str, Any]
"""Keyword arguments of matplotlib."""

MARKERS = ("o", "s", "^", "D", "v", "P", "h", "X")
SENSOR_MARK: Style = {"linestyle": "none", "markersize": 11.0, "mfc": INK, "mec": PAPER, "mew": 1.6}
HIDDEN_MARK: Style = {"mfc": "none", "mec": INK, "mew": 2.0}
MARK_RADIUS, LABEL_SIZE, LABEL_PADDING = 8.0, 10.0, 0.35  # points, points, share of the size
MANY_MARK_SIZE = 8.0  # points
ATTRIBUTION_SIZE = 8.5  # points
NOTE_PAPER: Style = {"boxstyle": "square,pad=0.25", "facecolor": PAPER, "alpha": 0.85, "edgecolor": "none"}
ATTRIBUTION_ORDER = 100  # drawing order of credits: over everything
MAX_LABELLED_IN_FULL = 12  # of more sensors than these the legend alone gives type and height
NAME_SIZE, RESULT_SIZE = 18.0, 12.0  # points
TOP, NAME_LINE, RESULT_LINE = 0.2, 0.34, 0.24  # inches
MEASURED_SIZE = 20.0  # points, at which the widths of texts are measured
SEPARATOR = "  ·  "
SCALE_SIZE = 9.0  # points
CORNER_ORDER = 6.0  # drawing order of scale and arrow: over the map and under its sensors
SERIES_MARKERS = ("o", "s", "^", "D", "v", "P", "X")  # one more than colours, so that pairs repeat only after 42 series
DASHED = (0, (4, 2))
GRID_COLOUR, FAINT_COLOUR = "#e3e6e8", "#c3c9ce"
Window = tuple[float, float, float, float]
"""Left, bottom, right and top of a part of the plane, metres."""


def new_page(size: tuple[float, float], dpi: float, layout: Literal["constrained"] | None = None) -> Figure:
    """Return an empty figure, width by height inches, whose texts can be measured."""
    figure = Figure(size, dpi=dpi, facecolor=PAPER, layout=layout)
    FigureCanvasAgg(figure)  # measures text
    return figure


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
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # letters that the type lacks are boxes, as in reports
        figure.savefig(drawn, format="rgba")
    pixels = Image.frombytes("RGBA", figure.canvas.get_width_height(), drawn.getvalue()).convert("RGB")
    # Octrees keep rare colours, which here carry meaning; the median cut would mix them with frequent ones.
    picture = pixels.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    content = io.BytesIO()
    picture.save(content, format="PNG", dpi=(figure.dpi, figure.dpi))
    return content.getvalue()


def box_corners(boxes: Float) -> Float:
    """Return the corners (k, 4, 2) of boxes in plan (k, 5), counter-clockwise from the front left one."""
    ahead = np.column_stack([np.cos(boxes[:, 4]), np.sin(boxes[:, 4])]) * boxes[:, 2:3] / 2
    left = np.column_stack([-np.sin(boxes[:, 4]), np.cos(boxes[:, 4])]) * boxes[:, 3:4] / 2
    around = np.stack([ahead + left, left - ahead, -ahead - left, ahead - left], axis=1)
    placed: Float = boxes[:, None, :2] + around
    return placed


def draw_polygons(axes: Axes, polygons: Iterable[Float], **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
    """Draw polygons by their corners, (k, 2) each; the limits of the axes stay."""
    axes.add_collection(PolyCollection(list(polygons), **style), autolim=False)


def draw_area(axes: Axes, area: BaseGeometry, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
    """Draw a polygon with its holes, or several."""
    polygons = [part for part in shapely.get_parts(area) if part.geom_type == "Polygon" and not part.is_empty]
    rings = [ring for part in polygons for ring in (part.exterior, *part.interiors)]
    if rings:
        path = Path.make_compound_path(*(Path(np.asarray(ring.coords)[:, :2], closed=True) for ring in rings))
        axes.add_patch(PathPatch(path, **style))


def window_around(bounds: Iterable[float], margin: float, shapes: tuple[float, float] = (0.0, np.inf)) -> Window:
    """Return the window around (left, bottom, right, top) with a margin, as high as wide times a number in ``shapes``.

    Examples
    --------
    >>> window_around((0.0, 0.0, 40.0, 10.0), 5.0, shapes=(0.5, 1.0))
    (-5.0, -7.5, 45.0, 17.5)
    """
    left, bottom, right, top = bounds
    width, height = right - left + 2 * margin, top - bottom + 2 * margin
    width, height = max(width, height / shapes[1]), max(height, width * shapes[0])
    x, y = (left + right) / 2, (bottom + top) / 2
    return x - width / 2, y - height / 2, x + width / 2, y + height / 2


def add_axes(
    figure: Figure, left: float, bottom: float, width: float, height: float, window: Window | None = None
) -> Axes:
    """Return axes without ticks at a place given in inches; those of a map show a window of the plane."""
    page_width, page_height = figure.get_size_inches()
    axes = figure.add_axes((left / page_width, bottom / page_height, width / page_width, height / page_height))
    axes.set(xticks=(), yticks=())
    if window is not None:
        axes.set(xlim=(window[0], window[2]), ylim=(window[1], window[3]))
        axes.spines[:].set(color=SOFT_INK, linewidth=0.8)
    return axes


def markers_of(deployment: Deployment) -> dict[str, str]:
    """Return a marker for each sensor type in use, by catalogue key."""
    keys = sorted({sensor.model.key for sensor in deployment.sensors})
    return {key: MARKERS[index % len(MARKERS)] for index, key in enumerate(keys)}


def draw_sensors(  # noqa: PLR0913  # what labels need to keep off
    axes: Axes,
    deployment: Deployment,
    points: Float,
    road: Float,
    *,
    zorder: float,
    hidden: Boolean | None = None,
    taken: Sequence[Window] = (),
) -> None:
    """Mark each sensor and write its label next to it, no label on another; with type and height if there are few.

    Parameters
    ----------
    axes : Axes
        With their final limits.
    points : (k, 2) float64
        Position of each sensor on the picture.
    road, taken
        As for `draw_callouts`.
    zorder : float
        Drawing order of the marks; labels and their lines are drawn below.
    hidden : (k,) bool, optional
        Hidden sensors, which are marked by an outline only.
    """
    sensors = deployment.sensors
    in_full = len(sensors) <= MAX_LABELLED_IN_FULL
    words = [f"{s.label}  {s.model.short_name} · {s.height:.3g} m{s.turned}" if in_full else s.label for s in sensors]
    draw_callouts(axes, points, words, road, zorder - 0.5, taken)
    markers = markers_of(deployment)
    hidden = np.zeros(len(points), dtype=bool) if hidden is None else hidden
    size = SENSOR_MARK["markersize"] if in_full else MANY_MARK_SIZE
    for sensor, point, behind in zip(sensors, points, hidden, strict=True):
        style = (SENSOR_MARK | HIDDEN_MARK if behind else SENSOR_MARK) | {"markersize": size}
        axes.plot(*point, marker=markers[sensor.model.key], zorder=zorder, **style)


def text_width(words: str, size: float, weight: str = "normal") -> float:
    """Return the width of a text in inches at a size in points."""
    font = _font(weight)
    font.set_size(MEASURED_SIZE, 72)  # each time: figures set the size of the same font
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of letters that the type lacks
        font.set_text(words, 0.0, flags=LoadFlags.NO_HINTING)
    return float(font.get_width_height()[0]) / 64.0 * size / MEASURED_SIZE / 72.0


def is_writable(words: str) -> bool:
    """Return whether the type has all letters of a text; it draws boxes in place of others, such as Chinese ones."""
    font = _font("normal")
    return all(letter.isspace() or font.get_char_index(ord(letter)) for letter in words)


@cache
def _font(weight: str) -> FT2Font:
    return get_font(findfont(FontProperties(weight=weight)))


def wrapped(words: str, width: float, size: float, weight: str = "normal") -> list[str]:
    """Return a text in lines that fit a width in inches at a size in points."""
    lines, line = [], ""
    for word in words.split():
        longer = f"{line} {word}" if line else word
        if text_width(longer, size, weight) <= width:
            line = longer
            continue
        lines += [line] if line else []
        line = word
        while text_width(line, size, weight) > width and len(line) > 1:  # one word wider than the line
            fits = next(n for n in range(len(line) - 1, 0, -1) if n == 1 or text_width(line[:n], size, weight) <= width)
            lines.append(line[:fits])
            line = line[fits:]
    return [*lines, line] if line or not lines else lines


@dataclass(frozen=True)
class Heading:
    """The site's name and the result, in lines that fit a page."""

    name: tuple[str, ...]
    result: tuple[str, ...]

    @property
    def height(self) -> float:
        """Height on the page, inches."""
        return TOP + len(self.name) * NAME_LINE + len(self.result) * RESULT_LINE + TOP / 2

    def draw(self, figure: Figure, left: float) -> None:
        """Write it at the head of a page, ``left`` inches from its border."""
        width, height = figure.get_size_inches()
        style = {"x": left / width, "ha": "left", "va": "top", "parse_math": False}
        y = TOP
        for line in self.name:
            figure.text(y=1 - y / height, s=line, size=NAME_SIZE, weight="bold", color=INK, **style)
            y += NAME_LINE
        for line in self.result:
            figure.text(y=1 - y / height, s=line, size=RESULT_SIZE, color=SOFT_INK, **style)
            y += RESULT_LINE


def heading_of(site: Site, deployment: Deployment, room: float) -> Heading:
    """Return the heading of a picture, ``room`` inches wide."""
    lines: list[str] = []
    for part in _summary(deployment):
        joined = f"{lines[-1]}{SEPARATOR}{part}" if lines else part
        if lines and text_width(joined, RESULT_SIZE) <= room:
            lines[-1] = joined
        else:
            lines += wrapped(part, room, RESULT_SIZE)
    return Heading(tuple(wrapped(site.name, room, NAME_SIZE, "bold")), tuple(lines))


def draw_attribution(axes: Axes, attribution: Sequence[str]) -> Window | None:
    """Write the credits of a map's sources at its lower right corner, over what is drawn there; return their box."""
    if not attribution:
        return None
    style: Style = {"ha": "right", "va": "bottom", "size": ATTRIBUTION_SIZE, "color": INK, "bbox": NOTE_PAPER}
    style |= {"parse_math": False, "transform": axes.transAxes, "zorder": ATTRIBUTION_ORDER}
    written = axes.text(0.995, 0.005, "\n".join(attribution), **style)
    extent = written.get_window_extent().padded(ATTRIBUTION_SIZE / 2 * axes.figure.dpi / 72)
    (left, bottom), (right, top) = axes.transData.inverted().transform(extent.get_points())
    return left, bottom, right, top


def credits_of(site: Site, created: str) -> tuple[str, ...]:
    """Return the credits of a picture: those that the sources demand, and the date of the placement if it is known."""
    return (*site.attribution, *([f"Placement of {created[:10]}"] if created else []))


def _summary(deployment: Deployment) -> list[str]:
    """Return the result in parts: what is seen, and the price."""
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
    price = price_text(deployment.price, installed=deployment.installed)
    return [*parts, price if deployment.installed else f"{price} for sensors"]


def percent(share: float) -> str:
    """Return a share in per cent; only all of it is 100 %, and only nothing is 0 %."""
    if 0.0 < share < 0.0005:
        return "<0.1%"
    return f"{min(share, 1.0 if share == 1.0 else 0.999):.1%}"


def draw_callouts(  # as for `place_callouts`
    axes: Axes, points: Float, words: list[str], road: Float, zorder: float, taken: Sequence[Window] = ()
) -> None:
    """Write words next to points (k, 2), in data coordinates, off the road (t, 2) and each other where they can be.

    No label is in a box of ``taken``.
    """
    if not len(points):
        return
    boxed = {"boxstyle": f"round,pad={LABEL_PADDING}", "facecolor": PAPER, "edgecolor": SOFT_INK, "linewidth": 0.6}
    style: Style = {"ha": "center", "va": "center", "size": LABEL_SIZE, "color": INK, "bbox": boxed}
    texts = [axes.text(0, 0, label, zorder=zorder, parse_math=False, **style) for label in words]
    point = axes.figure.dpi / 72
    extents = [text.get_window_extent() for text in texts]
    sizes = np.array([(extent.width, extent.height) for extent in extents]) + 2 * LABEL_PADDING * LABEL_SIZE * point
    anchors = axes.transData.transform(points)
    boxes = axes.transData.transform(np.reshape(taken, (-1, 2))).reshape(-1, 4)
    bounds = axes.get_window_extent().padded(-4.0 * point).extents
    centres = place_callouts(anchors, sizes, bounds, MARK_RADIUS * point, axes.transData.transform(road), boxes)
    for text, start, end in zip(texts, points, axes.transData.inverted().transform(centres), strict=True):
        text.set_position(end)
        axes.plot(*zip(start, end, strict=True), color=INK, linewidth=0.9, zorder=zorder - 0.1)


def draw_corners(
    axes: Axes, attribution: Sequence[str] = (), *, longest: float = 2.0, north: bool = True
) -> list[Window]:
    """Draw the scale, an arrow along +y and the credits in the corners of a map, and return what they cover.

    Parameters
    ----------
    longest : float, inches
        Largest length of the scale bar.
    north : bool
        Whether to draw the arrow; +y is north in map coordinates.
    """
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    inch = (right - left) * axes.figure.dpi / axes.bbox.width
    papers = corner_boxes((left, bottom, right, top), inch, longest)[: 1 + north]
    for low_x, low_y, high_x, high_y in papers:
        paper: Style = {"facecolor": PAPER, "alpha": 0.9, "edgecolor": "none", "zorder": CORNER_ORDER}
        axes.add_patch(Rectangle((low_x, low_y), high_x - low_x, high_y - low_y, **paper))
    length, x, y = round_number(longest * inch), left + 0.25 * inch, bottom + 0.25 * inch
    for part in range(4):
        style: Style = {"facecolor": INK if part % 2 == 0 else PAPER, "edgecolor": INK, "linewidth": 0.7}
        corner = (x + part * length / 4, y)
        axes.add_patch(Rectangle(corner, length / 4, 0.08 * inch, zorder=CORNER_ORDER, **style))
    unit, name = (1000.0, "km") if length >= 2000.0 else (1.0, "m")
    style = {"ha": "center", "va": "bottom", "size": SCALE_SIZE, "color": INK, "zorder": CORNER_ORDER}
    ends = ((0.0, "0"), (length / 2, f"{length / 2 / unit:g}"), (length, f"{length / unit:g} {name}"))
    for at, words in ends if longest > 1.0 else ends[::2]:
        axes.text(x + at, y + 0.13 * inch, words, **style)
    if north:
        x, y = right - 0.38 * inch, top - 0.82 * inch
        arrow = np.array([(0.0, 0.42), (0.12, 0.0), (0.0, 0.09), (-0.12, 0.0)]) * inch + (x, y)
        axes.fill(arrow[:, 0], arrow[:, 1], facecolor=INK, edgecolor="none", zorder=CORNER_ORDER)
        axes.text(x, y + 0.46 * inch, "N", weight="bold", **style)
    covered = draw_attribution(axes, attribution)
    return [*papers, *([] if covered is None else [covered])]


def corner_boxes(window: Window, inch: float, longest: float = 2.0) -> list[Window]:
    """Return the boxes of the scale and of the north arrow on a map of a window; an inch of it is ``inch`` metres."""
    left, bottom, right, top = window
    x, y = left + 0.12 * inch, bottom + 0.13 * inch
    scale = (x, y, x + (round_number(longest * inch) + 0.55 * inch), y + 0.52 * inch)
    x, y = right - 0.62 * inch, top - 0.92 * inch
    return [scale, (x, y, x + 0.48 * inch, y + 0.8 * inch)]


def colour(row: int) -> str:
    """Return the colour of a series."""
    return SERIES_COLOURS[row % len(SERIES_COLOURS)]


def mark(row: int) -> str:
    """Return the marker of a series."""
    return SERIES_MARKERS[row % len(SERIES_MARKERS)]


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


def style_axes(panel: Axes, x: str = "", y: str = "", grid: Literal["both", "x", "y"] = "both") -> None:
    """Label the axes, and draw grid, ticks and borders as in all charts; empty labels are left out."""
    if x:
        panel.set_xlabel(x, color=INK)
    if y:
        panel.set_ylabel(y, color=INK)
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
