"""Map of a network in plan: sites and streets in metres, and the window around them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...base.arrays import Float
from ...base.counts import round_number
from ...geometry.tangent_plane import plan_metres
from ..pictures.chart_style import plain_legend
from ..pictures.drawing import (
    Style,
    Window,
    add_axes,
    as_png,
    draw_callouts,
    draw_corners,
    new_page,
    window_around,
)
from ..pictures.palette import INK, PAPER, PAPER_STREETS, SHARE_COLOURS, SOFT_INK
from ..report.wording import dollars
from .network_record import NetworkRecord, colour_title, level, level_words, ranked_sites

Street = tuple[Float, int]
"""Latitudes and longitudes of a street, (n, 2) float64, and its importance, 0 to 2."""
MARGIN, LEAST_EXTENT = 0.07, 600.0  # share of the sites' extent around them; metres
MOST_CORNERS = 40_000  # of all streets, some 300 kB
FINEST = 2000  # parts of the window's width that streets are simplified to
LARGEST_RADIUS, SMALLEST_RADIUS, BARE_RADIUS = 18.0, 3.5, 4.5
"""Pixels of circles: for the most money, at least, and of sites without sensor."""
DPI = 150
MAP_SIZE, LEGEND_HEIGHT = (7.2, 3.9), 0.55  # inches
MAP_SHAPE = (MAP_SIZE[1] - LEGEND_HEIGHT) / MAP_SIZE[0]
PIXEL = 0.45  # points for each pixel of `NetworkView.radii`
STREET_WIDTHS = (0.4, 0.7, 1.2)  # points, by importance
MOST_NUMBERED = 12  # sites with their rank on the map
STATUS_MARKS: dict[str, Style] = {
    "without sensor": {"marker": "o", "markersize": 2 * BARE_RADIUS * PIXEL, "mfc": PAPER, "mec": SOFT_INK, "mew": 1.0},
    "failed": {"marker": "x", "markersize": 6.5, "mec": SOFT_INK, "mew": 1.4},
}


@dataclass(frozen=True, eq=False)
class NetworkView:
    """Sites of a network in a window, x east and y north in metres.

    Sites have places (n, 2) in the order of the record, and radii (n,), pixels, of circles whose areas are proportional
    to the money spent. Streets are lines in metres, the least important first.
    """

    places: Float
    radii: Float
    window: Window
    streets: tuple[Street, ...]


def network_view(record: NetworkRecord, streets: Sequence[Street] | None) -> NetworkView:
    """Return sites and streets in the window of the map."""
    degrees = np.array([(site.latitude, site.longitude) for site in record.sites]).reshape(-1, 2)
    middle = _middle(degrees)
    places = plan_metres(degrees, middle)
    low, high = (places.min(axis=0), places.max(axis=0)) if len(places) else (np.zeros(2), np.zeros(2))
    around = np.maximum(MARGIN * (high - low), (LEAST_EXTENT - (high - low)) / 2)
    window = window_around((*(low - around).tolist(), *(high + around).tolist()), 0.0, (MAP_SHAPE, MAP_SHAPE))
    money = np.array([site.price_usd for site in record.sites])
    largest = min(LARGEST_RADIUS, max(9.0, 110.0 / math.sqrt(max(1, len(money)))))
    radii = np.maximum(SMALLEST_RADIUS, largest * np.sqrt(money / max(1.0, money.max(initial=0.0))))
    return NetworkView(places, radii, window, tuple(_drawn(streets or (), middle, window)))


def radius_of(record: NetworkRecord, view: NetworkView, money: float) -> float:
    """Return the radius of the circle for an amount of money, pixels."""
    most = max(range(len(record.sites)), key=lambda at: record.sites[at].price_usd)
    return max(SMALLEST_RADIUS, float(view.radii[most]) * math.sqrt(money / record.sites[most].price_usd))


def legend_money(record: NetworkRecord) -> tuple[float, ...]:
    """Return round amounts of money whose circles a legend shows."""
    most = max((site.price_usd for site in record.sites), default=0.0)
    return tuple(sorted({round_number(most / 6), round_number(most)})) if most >= 1 else ()


def _middle(degrees: Float) -> Float:
    """Return the middle of the latitudes, and that of the shortest arc with all longitudes."""
    if not len(degrees):
        return np.zeros(2)
    around = np.sort(degrees[:, 1] % 360.0)
    gaps = np.diff(around, append=around[0] + 360.0)
    widest = int(np.argmax(gaps))
    east, west = around[widest], around[(widest + 1) % len(around)]
    arc = 360.0 - gaps[widest]
    return np.array(((degrees[:, 0].min() + degrees[:, 0].max()) / 2, west + arc / 2 if arc else east))


def _drawn(streets: Sequence[Street], middle: Float, window: Window) -> Iterator[Street]:
    """Yield the streets in a window, joined and simplified until they are few corners; the shortest are left out."""
    lines = []
    for rank in range(len(PAPER_STREETS)):
        own = [plan_metres(line, middle) for line, importance in streets if importance == rank and len(line) > 1]
        within = shapely.clip_by_rect(shapely.MultiLineString(own), *window)
        whole = shapely.get_parts(shapely.line_merge(within)) if own else ()
        lines += [(line, rank) for line in whole if line.geom_type == "LineString" and not line.is_empty]
    tolerance = (window[2] - window[0]) / FINEST
    while True:
        long = [(line, rank) for line, rank in lines if line.length > 3 * tolerance]
        simple = [(shapely.get_coordinates(line.simplify(tolerance)), rank) for line, rank in long]
        if sum(len(line) for line, _ in simple) <= MOST_CORNERS:
            break
        tolerance *= 1.5
    yield from simple


def draw_map(record: NetworkRecord, streets: Sequence[Street] | None = None) -> bytes:
    """Return the sites on the streets as PNG, the first of them with their ranks."""
    view = network_view(record, streets)
    width, height = MAP_SIZE
    figure = new_page(MAP_SIZE, DPI)
    axes = add_axes(figure, 0.0, LEGEND_HEIGHT, width, height - LEGEND_HEIGHT, view.window)
    for rank, (colour, line) in enumerate(zip(PAPER_STREETS, STREET_WIDTHS, strict=True)):
        own = [street for street, importance in view.streets if importance == rank]
        axes.add_collection(LineCollection(own, colors=colour, linewidths=line, zorder=1.0), autolim=False)
    for at in np.argsort(-view.radii, kind="stable").tolist():
        axes.plot(*view.places[at], zorder=3.0, **_mark(record, view, at))
    taken = draw_corners(axes, record.attribution, longest=1.0)
    first = [one.site for one in ranked_sites(record)[:MOST_NUMBERED] if one.gain is not None]
    points = np.array([view.places[record.sites.index(site)] for site in first]).reshape(-1, 2)
    draw_callouts(axes, points, [str(rank + 1) for rank in range(len(first))], view.places, 4.0, taken)
    _draw_legend(figure, record, view)
    return as_png(figure)


def _mark(record: NetworkRecord, view: NetworkView, at: int) -> Style:
    site = record.sites[at]
    if site.status != "equipped":
        return STATUS_MARKS[site.status]
    size = 2 * PIXEL * float(view.radii[at])
    return {"marker": "o", "markersize": size, "mfc": SHARE_COLOURS[level(record, site)], "mec": INK, "mew": 0.8}


def _draw_legend(figure: Figure, record: NetworkRecord, view: NetworkView) -> None:
    circle: Style = {"marker": "o", "mec": INK, "mew": 0.8}
    marks = [
        (words, circle | {"mfc": colour, "markersize": 7.0})
        for colour, words in zip(SHARE_COLOURS, level_words(record), strict=True)
    ]
    for money in legend_money(record):
        size = 2 * PIXEL * radius_of(record, view, money)
        marks.append((dollars(money), circle | {"mfc": "none", "markersize": size}))
    there = {site.status for site in record.sites}
    marks += [(status, mark) for status, mark in STATUS_MARKS.items() if status in there]
    lines = [Line2D([], [], linestyle="none", **mark) for _, mark in marks]
    style: Style = {"ncols": len(marks), "fontsize": 8, "borderaxespad": 0.0, "loc": "lower center"}
    spacing: Style = {"handletextpad": 0.1, "columnspacing": 0.9, "title_fontsize": 8, "bbox_to_anchor": (0.5, 0.005)}
    title = f"{colour_title(record)} (colour), money spent (area); numbers: ranks by gain per dollar"
    plain_legend(figure, lines, [words for words, _ in marks], title=title, **style, **spacing)
