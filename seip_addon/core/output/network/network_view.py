"""Map of a network in plan: sites and streets in metres, and the window around them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ...arrays import Float
from ...counts import round_number
from ...geometry.tangent_plane import plan_metres
from ..pictures.palette import PAPER_STREETS
from .network_record import NetworkRecord

Street = tuple[Float, int]
"""Latitudes and longitudes of a street, (n, 2) float64, and its importance, 0 to 2."""
MARGIN, LEAST_EXTENT = 0.07, 600.0  # share of the sites' extent around them; metres
MOST_CORNERS = 40_000  # of all streets, some 300 kB
FINEST = 2000  # parts of the window's width that streets are simplified to
LARGEST_RADIUS, SMALLEST_RADIUS, BARE_RADIUS = 18.0, 3.5, 4.5
"""Pixels of circles: for the most money, at least, and of sites without sensor."""


@dataclass(frozen=True, eq=False)
class NetworkView:
    """Sites of a network in a window, x east and y north in metres.

    Parameters
    ----------
    places : (n, 2) float64
        In the order of the record.
    radii : (n,) float64, pixels
        Areas of circles are proportional to the money spent.
    window : (left, bottom, right, top)
    streets : tuple of Street
        Lines in metres, the least important first.
    """

    places: Float
    radii: Float
    window: tuple[float, float, float, float]
    streets: tuple[Street, ...]

    @property
    def width(self) -> float:
        """Width of the window, metres."""
        return self.window[2] - self.window[0]

    @property
    def shape(self) -> float:
        """How many times as high as wide the window is."""
        return (self.window[3] - self.window[1]) / self.width


def network_view(record: NetworkRecord, streets: Sequence[Street] | None, shapes: tuple[float, float]) -> NetworkView:
    """Return the map whose window is as high as wide times a number within ``shapes``."""
    degrees = np.array([(site.latitude, site.longitude) for site in record.sites]).reshape(-1, 2)
    middle = _middle(degrees)
    places = plan_metres(degrees, middle)
    low, high = (places.min(axis=0), places.max(axis=0)) if len(places) else (np.zeros(2), np.zeros(2))
    width, height = np.maximum((1 + 2 * MARGIN) * (high - low), LEAST_EXTENT).tolist()
    width, height = max(width, height / shapes[1]), max(height, width * shapes[0])
    x, y = ((low + high) / 2).tolist()
    window = (x - width / 2, y - height / 2, x + width / 2, y + height / 2)
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


def _drawn(streets: Sequence[Street], middle: Float, window: tuple[float, float, float, float]) -> Iterator[Street]:
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
