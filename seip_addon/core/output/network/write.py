"""Files of a network of sites: tables, map in plan, and a report with one page for decisions."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...base.arrays import Float
from ...base.counts import counted, round_number
from ...geometry.tangent_plane import plan_metres
from ...storage.csv_table import save_csv
from ...storage.files import save_json, whole_file
from ...storage.json_dataclass import as_json
from ..pictures.drawing import (
    Style,
    Window,
    add_axes,
    as_png,
    draw_callouts,
    draw_corners,
    new_page,
    percent,
    plain_legend,
    window_around,
)
from ..pictures.palette import INK, PAPER, PAPER_STREETS, SHARE_COLOURS, SOFT_INK
from ..report.blocks import Block, Bullets, Facts, Paragraph, Picture, Report, Table, make_sections
from ..report.pdf import save_report
from ..results.answer import date, dollars, sentence
from ..results.geographic_files import DECIMALS, Feature, feature, save_features
from .network_record import SCHEMA, NetworkRecord, NetworkSite, gain_text, outcome, ranked_sites, sensors_text

COLUMNS = (
    *("rank", "name", "latitude_deg", "longitude_deg", "weight", "status", "sensors", "types", "price_usd", "value"),
    *("bound", "coverage", "gain_per_1000_usd", "folder", "message"),
)
DIGITS = 9  # of values
NETWORK_FILES = ("network.json", "network.geojson", "sites.csv")
PICTURE = "map.png"
Street = tuple[Float, int]
"""Latitudes and longitudes of a street, (n, 2) float64, and its importance, 0 to 2."""
MARGIN, LEAST_EXTENT = 0.07, 600.0  # share of the sites' extent around them; metres
MOST_CORNERS = 40_000  # of all streets, some 300 kB
FINEST = 2000  # parts of the window's width that streets are simplified to
LARGEST_RADIUS, SMALLEST_RADIUS, BARE_RADIUS = 18.0, 3.5, 4.5
"""Pixels of circles: for the most money, at least, and of sites without sensor."""
DPI = 150
COVERAGE_STEPS, RETURNS_STEPS = (0.2, 0.4, 0.6, 0.8), (1.0, 5.0, 20.0, 100.0)
"""Coverages, and typical returns, at which a site gets the next of `SHARE_COLOURS`."""
MAP_SIZE, LEGEND_HEIGHT = (7.2, 3.9), 0.55  # inches
MAP_SHAPE = (MAP_SIZE[1] - LEGEND_HEIGHT) / MAP_SIZE[0]
PIXEL = 0.45  # points for each pixel of a radius
STREET_WIDTHS = (0.4, 0.7, 1.2)  # points, by importance
MOST_NUMBERED = 12  # sites with their rank on the map
OUTLINE: Style = {"mec": INK, "mew": 0.8}
STATUS_MARKS: dict[str, Style] = {
    "without sensor": {"marker": "o", "markersize": 2 * BARE_RADIUS * PIXEL, "mfc": PAPER, "mec": SOFT_INK, "mew": 1.0},
    "failed": {"marker": "x", "markersize": 6.5, "mec": SOFT_INK, "mew": 1.4},
}
GAIN = {
    "road": "Gain per $1,000 is in percentage points of the road seen at the site",
    "returns": "Gain per $1,000 is the growth of 1 + typical returns at the site",
}


def write_network(folder: Path, record: NetworkRecord, streets: Sequence[Street] | None = None) -> tuple[Path, ...]:
    """Write record, tables, map and report of a network; the same arguments give the same bytes.

    Parameters
    ----------
    folder : Path
        Created if it is missing.
    streets : sequence of ((n, 2) float64, int), optional
        Background of the map: latitudes and longitudes of each street in degrees, and its importance from 0 to 2.

    Returns
    -------
    tuple of path

    Raises
    ------
    SeipError
        The folder or a file cannot be written.
    """
    drawn = draw_map(record, streets)
    save_json(folder / NETWORK_FILES[0], {"schema": SCHEMA, **as_json(record)})
    save_features(folder / NETWORK_FILES[1], record.name, record.attribution, _features(record))
    rows = [[figures[name] for name in COLUMNS] for _, figures in _rows(record)]
    save_csv(folder / NETWORK_FILES[2], COLUMNS, rows)
    with whole_file(folder / PICTURE) as temporary:
        temporary.write_bytes(drawn)
    report = save_report(folder, make_network_report(record, drawn))
    return (*(folder / name for name in (*NETWORK_FILES, PICTURE)), *report)


def _features(record: NetworkRecord) -> Iterator[Feature]:
    """Yield the sites and their sensors as points on WGS 84."""
    rows = list(_rows(record))
    for _, figures in rows:
        yield feature("site", "Point", [figures.pop("longitude_deg"), figures.pop("latitude_deg")], **figures)
    for site, _ in rows:
        for sensor in site.sensors:
            place = [_within_a_turn(sensor.longitude), round(sensor.latitude, DECIMALS)]
            about = {"id": sensor.id, "site": site.name, "folder": site.folder, "sensor": sensor.sensor}
            numbers = {"height_m": round(sensor.height_m, 3), "price_usd": round(sensor.price_usd, 2)}
            yield feature("sensor", "Point", place, **about, position=sensor.position, **numbers)


def _rows(record: NetworkRecord) -> Iterator[tuple[NetworkSite, dict[str, object]]]:
    """Yield the sites in their order with their figures, which have the names of `COLUMNS`."""
    for rank, (site, gain) in enumerate(ranked_sites(record), start=1):
        figures = {name: getattr(site, name) for name in ("name", "weight", "status", "folder", "message")}
        figures |= {name: round(getattr(site, name), DIGITS) for name in ("value", "bound", "coverage")}
        yield (
            site,
            figures
            | {
                "rank": None if gain is None else rank,
                "latitude_deg": round(site.latitude, DECIMALS),
                "longitude_deg": _within_a_turn(site.longitude),
                "sensors": len(site.sensors),
                "types": sensors_text(site.sensors, {}),
                "price_usd": round(site.price_usd, 2),
                "gain_per_1000_usd": None if gain is None else round(gain, DIGITS),
            },
        )


def _within_a_turn(longitude: float) -> float:
    """Return a longitude from -180 to 180 degrees, which RFC 7946 asks for."""
    return round(longitude - 360.0 * round(longitude / 360.0), DECIMALS)


def make_network_report(record: NetworkRecord, drawn_map: bytes) -> Report:
    """Return the report with the map, PNG, on its first page."""
    failed = tuple((site.name, site.message) for site in record.sites if site.status == "failed")
    left_out = (Paragraph("The figures of the network leave these sites out."), Table(("Site", "Reason"), failed))
    contents: dict[str, Iterable[Block]] = {
        "Sites with sensors": _equipped(record),
        "Sites that failed": left_out if failed else (),
        "Notes": [Bullets(tuple(map(sentence, record.notes)))] if record.notes else [],
        "Sources": [Bullets(record.attribution)] if record.attribution else [],
    }
    first = (
        Facts(tuple(_key_figures(record)), large=True),
        Picture(drawn_map, "Sites, north is up. Colour shows the result, area the money; hollow: without sensor."),
    )
    title = f"Roadside LiDAR sensors at the sites of a network{f', {date(record.created)}' if record.created else ''}"
    return Report(record.name, title, record.created, first, make_sections(contents))


def _key_figures(record: NetworkRecord) -> Iterator[tuple[str, str]]:
    usable = [site for site in record.sites if site.status != "failed"]
    equipped, failed = sum(site.status == "equipped" for site in usable), len(record.sites) - len(usable)
    yield "Sites", f"{equipped:,} of {len(record.sites):,} have sensors{f', {failed:,} failed' if failed else ''}"
    sensors = [sensor for site in record.sites for sensor in site.sensors]
    yield "Sensors", f"{len(sensors):,}: {sensors_text(sensors, record.sensor_names)}" if sensors else "none"
    yield "Money", f"{dollars(record.price_usd)} of a budget of {dollars(record.budget_usd)}"
    if not usable:
        yield "Quality", "no site could be computed"
        return
    mean = f"mean of the sites{' by their weights' if len({site.weight for site in usable}) > 1 else ''}"
    typical = outcome(record, record.value)
    if record.criterion == "road":
        yield "Quality", f"{typical} of the road is seen ({mean})"
    else:
        total = math.fsum(site.weight for site in usable) or 1.0
        seen = percent(min(math.fsum(site.weight * site.coverage for site in usable) / total, 1.0))
        points = f"about {typical} measured points on a typical road user in each revolution"
        yield "Quality", f"{points}; {seen} of the road is seen ({mean})"
    yield "Proof", record.certificate


def _equipped(record: NetworkRecord) -> Iterator[Block]:
    bare = sum(site.status == "without sensor" for site in record.sites)
    if bare:
        yield Paragraph(f"{counted(bare, 'site has no sensor', 'sites have no sensor')}.")
    rows = tuple(
        (
            *("–" if gain is None else str(rank), site.name, sensors_text(site.sensors, record.sensor_names)),
            *(dollars(site.price_usd), outcome(record, _reached(record, site)), gain_text(record, gain)),
        )
        for rank, (site, gain) in enumerate(ranked_sites(record), start=1)
        if site.status == "equipped"
    )
    if not rows:
        return
    yield Paragraph(f"Sites by gain per dollar. {GAIN[record.criterion]}, times its weight over the mean weight.")
    figure = "Road seen" if record.criterion == "road" else "Returns"
    yield Table(("Rank", "Site", "Sensors", "Money", figure, "Gain per $1,000"), rows, frozenset({0, 3, 4, 5}))


def _reached(record: NetworkRecord, site: NetworkSite) -> float:
    """Return the result of a site as `outcome` takes it."""
    return site.coverage if record.criterion == "road" else site.value


def draw_map(record: NetworkRecord, streets: Sequence[Street] | None = None) -> bytes:
    """Return the sites on the streets as PNG, the first of them with their ranks; areas of circles show the money."""
    degrees = np.array([(site.latitude, site.longitude) for site in record.sites]).reshape(-1, 2)
    middle = _middle(degrees)
    places = plan_metres(degrees, middle)
    low, high = (places.min(axis=0), places.max(axis=0)) if len(places) else (np.zeros(2), np.zeros(2))
    around = np.maximum(MARGIN * (high - low), (LEAST_EXTENT - (high - low)) / 2)
    window = window_around((*(low - around).tolist(), *(high + around).tolist()), 0.0, (MAP_SHAPE, MAP_SHAPE))
    width, height = MAP_SIZE
    figure = new_page(MAP_SIZE, DPI)
    axes = add_axes(figure, 0.0, LEGEND_HEIGHT, width, height - LEGEND_HEIGHT, window)
    drawn = list(_drawn(streets or (), middle, window))
    for rank, (colour, line) in enumerate(zip(PAPER_STREETS, STREET_WIDTHS, strict=True)):
        own = [street for street, importance in drawn if importance == rank]
        axes.add_collection(LineCollection(own, colors=colour, linewidths=line, zorder=1.0), autolim=False)
    radii = np.array([_radius(record, site.price_usd) for site in record.sites])
    for at in np.argsort(-radii, kind="stable").tolist():
        axes.plot(*places[at], zorder=3.0, **_mark(record, record.sites[at]))
    taken = draw_corners(axes, record.attribution, longest=1.0)
    first = [site for site, gain in ranked_sites(record)[:MOST_NUMBERED] if gain is not None]
    points = np.array([places[record.sites.index(site)] for site in first]).reshape(-1, 2)
    draw_callouts(axes, points, [str(rank + 1) for rank in range(len(first))], places, 4.0, taken)
    _draw_legend(figure, record)
    return as_png(figure)


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


def _radius(record: NetworkRecord, money: float) -> float:
    """Return the radius of the circle for an amount of money, pixels."""
    largest = min(LARGEST_RADIUS, max(9.0, 110.0 / math.sqrt(max(1, len(record.sites)))))
    most = max(1.0, *(site.price_usd for site in record.sites)) if record.sites else 1.0
    return max(SMALLEST_RADIUS, largest * math.sqrt(money / most))


def _mark(record: NetworkRecord, site: NetworkSite) -> Style:
    if site.status != "equipped":
        return STATUS_MARKS[site.status]
    reached = site.coverage if record.criterion == "road" else math.expm1(site.value)
    colour = SHARE_COLOURS[bisect_right(COVERAGE_STEPS if record.criterion == "road" else RETURNS_STEPS, reached)]
    return {"marker": "o", "markersize": 2 * PIXEL * _radius(record, site.price_usd), "mfc": colour, **OUTLINE}


def _draw_legend(figure: Figure, record: NetworkRecord) -> None:
    road = record.criterion == "road"
    steps = [f"{step:.0%}" if road else f"{step:g}" for step in (COVERAGE_STEPS if road else RETURNS_STEPS)]
    between = [f"{low.removesuffix('%')}–{high}" for low, high in pairwise(steps)]
    levels = (f"< {steps[0]}", *between, f"≥ {steps[-1]}")
    circle: Style = {"marker": "o", **OUTLINE}
    marks = [
        (words, circle | {"mfc": colour, "markersize": 7.0})
        for colour, words in zip(SHARE_COLOURS, levels, strict=True)
    ]
    most = max((site.price_usd for site in record.sites), default=0.0)
    marks += [
        (dollars(money), circle | {"mfc": "none", "markersize": 2 * PIXEL * _radius(record, money)})
        for money in (sorted({round_number(most / 6), round_number(most)}) if most >= 1 else ())
    ]
    there = {site.status for site in record.sites}
    marks += [(status, mark) for status, mark in STATUS_MARKS.items() if status in there]
    lines = [Line2D([], [], linestyle="none", **mark) for _, mark in marks]
    style: Style = {"ncols": len(marks), "fontsize": 8, "borderaxespad": 0.0, "loc": "lower center"}
    spacing: Style = {"handletextpad": 0.1, "columnspacing": 0.9, "title_fontsize": 8, "bbox_to_anchor": (0.5, 0.005)}
    what = "Road seen" if road else "Typical returns from a road user"
    title = f"{what} (colour), money spent (area); numbers: ranks by gain per dollar"
    plain_legend(figure, lines, [words for words, _ in marks], title=title, **style, **spacing)
