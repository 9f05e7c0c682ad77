"""Pictures that only a report has: the map of blind spots, and price against coverage."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from ..pictures.drawing import MAX_LABELLED, as_png, draw_attribution, draw_callouts
from ..pictures.palette import INK, PAPER, SEEN_COLOURS, SOFT_INK
from ..pictures.plan_style import Style
from .blind_spots import BlindSpot
from .evidence import Evidence
from .losses import FrontPoint

DPI = 150
MAP_WIDTH, MAX_MAP_HEIGHT = 7.2, 8.0  # inches
MARGIN = 4.0  # metres around the road
CHART_SIZE = (7.2, 3.6)  # inches


def blind_spot_map(evidence: Evidence, spots: Sequence[BlindSpot]) -> bytes:
    """Return the road by how many sensors see it, with the sensors and numbered blind spots, as PNG."""
    targets = evidence.site.targets
    x, y = targets.xyz[:, 0], targets.xyz[:, 1]
    sensors = np.array([sensor.local_m[:2] for sensor in evidence.sensors]).reshape(-1, 2)
    low = np.minimum(targets.xyz[:, :2].min(axis=0), sensors.min(axis=0, initial=math.inf)) - MARGIN
    high = np.maximum(targets.xyz[:, :2].max(axis=0), sensors.max(axis=0, initial=-math.inf)) + MARGIN
    width, height = high - low
    page = (MAP_WIDTH, min(MAX_MAP_HEIGHT, MAP_WIDTH * height / width))
    figure = Figure(page, dpi=DPI, facecolor=PAPER)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xticks=(), yticks=())
    axes.spines[:].set(color=SOFT_INK, linewidth=0.8)

    column = np.round((x - x.min()) / targets.spacing).astype(np.int64)
    row = np.round((y - y.min()) / targets.spacing).astype(np.int64)
    cells = np.full((row.max() + 1, column.max() + 1), np.nan)
    cells[row, column] = np.minimum(evidence.seen_by, 2)
    half = targets.spacing / 2
    frame = (x.min() - half, x.max() + half, y.min() - half, y.max() + half)
    style: Style = {"cmap": ListedColormap(SEEN_COLOURS), "vmin": 0, "vmax": 2, "interpolation": "nearest"}
    axes.imshow(cells, origin="lower", extent=frame, aspect="auto", **style)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    if 0 < len(sensors) <= MAX_LABELLED:
        draw_callouts(axes, sensors, [sensor.id for sensor in evidence.sensors], targets.xyz[:, :2], 3.0)
    axes.plot(*sensors.T, linestyle="none", marker="^", markersize=10, mfc=INK, mec=PAPER, mew=1.2, zorder=4.0)
    draw_attribution(axes, evidence.record.site.attribution)
    for number, spot in enumerate(spots, start=1):
        circle: Style = {"boxstyle": "circle,pad=0.25", "facecolor": PAPER, "edgecolor": INK, "linewidth": 1.2}
        style = {"ha": "center", "va": "center", "size": 9, "weight": "bold", "color": INK, "zorder": 5.0}
        axes.text(float(spot.middle[0]), float(spot.middle[1]), str(number), bbox=circle, **style)
    return as_png(figure)


def front_chart(points: Sequence[FrontPoint], placed: tuple[float, float], *, installed: bool = False) -> bytes:
    """Return coverage against price as PNG.

    Parameters
    ----------
    placed : (float, float)
        Price (dollars) and covered share of the weight of the placement.
    installed : bool
        Whether prices count posts, mounting, power and backhaul.
    """
    figure = Figure(CHART_SIZE, dpi=DPI, facecolor=PAPER, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    price = [point.price / 1000 for point in points]
    share = [100 * point.coverage for point in points]
    missed = [100 * point.missed for point in points]
    style: Style = {"color": SEEN_COLOURS[2], "ecolor": SOFT_INK, "capsize": 4, "markersize": 7}
    axes.errorbar(price, share, yerr=np.array([np.zeros(len(points)), missed]), marker="o", linewidth=1.4, **style)
    for point, x, y in zip(points, price, share, strict=True):
        axes.annotate(str(point.count), (x, y), xytext=(8, -13), textcoords="offset points", size=9)
    ring: Style = {"markersize": 15, "mfc": "none", "mec": INK, "mew": 1.6, "linestyle": "none"}
    axes.plot(placed[0] / 1000, 100 * placed[1], marker="o", label="this placement", **ring)
    axes.set(xlabel=f"{'installed ' * installed}price, thousand US dollars", ylabel="coverage, %")
    axes.margins(0.1, 0.15)
    axes.grid(visible=True, color="#d8dde1", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="lower right")
    return as_png(figure)
