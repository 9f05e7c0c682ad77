"""The plan of a site: map, title and legend with the sensors, shares of the road, and what lines and marks mean."""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from shapely.geometry.base import BaseGeometry

from ...choosing.placement.deployment import Deployment, Sensor
from ...counts import counted
from ...site.scene_geometry import ASSUMED, FROM_MAP, OTHER_LEVELS, NamedArea, SceneGeometry
from ...site.site import Site
from .colours import of_placement
from .drawing import (
    SENSOR_MARK,
    Style,
    add_axes,
    credits_box,
    credits_of,
    draw_attribution,
    draw_north,
    draw_scale,
    draw_sensors,
    heading_of,
    markers_of,
    new_page,
    north_paper,
    percent,
    save_png,
    scale_paper,
    wrapped,
)
from .palette import FORBIDDEN, INK, MANDATORY, SOFT_INK, WEIGHTED
from .plan_map import (
    ASSUMED_HEIGHT,
    ASSUMED_MARK,
    HEIGHT_CMAP,
    OTHER_ROAD,
    POLE_MARK,
    SENSOR,
    SIDEWALK_MARK,
    MapContent,
    Window,
    draw_map,
    draw_street_names,
    map_content,
    mark_boxes,
)

DPI = 160
MARGIN = 0.3  # inches
MAP_WIDTH = 9.6  # inches: a page of A4 shows type at 0.7 of its size
MIN_MAP_HEIGHT, MAX_MAP_HEIGHT = 5.2, 10.0  # inches
MARGIN_SHARE = 0.06  # of the region's size, shown around it
MIN_MARGIN = 3.0  # metres, likewise
ROOMS = (1.0, 1.03, 1.06, 1.1, 1.15, 1.2, 1.3, 1.4)  # by which more is shown until no corner's writing hides the region

COLUMNS, COLUMN_GAP = 3, 0.35  # of the legend: number, and inches between two
SIZE, SMALL, HEADING_SIZE = 10.0, 9.0, 11.5  # points
LINE, SMALL_LINE, HEADING_LINE, AFTER = 0.23, 0.19, 0.4, 0.16  # inches
TEXT_X, LABEL_X, SHARE_ROOM = 0.34, 0.78, 0.55  # inches: of text beside a mark, of a sensor's type, for its share
MOST_TOGETHER = 12  # rows of a section that stay in one column
HEIGHT_STEP = 0.1  # inches, by which a legend grows until its columns suffice

BOLD: Style = {"weight": "bold"}
ASIDE: Style = {"size": SMALL, "color": SOFT_INK}
Sign = Callable[[Axes, float, float], object]
"""Draws a sign into axes in inches, at the left end and the middle of a row's first line."""


def save_plan_view(  # what a plan shows
    path: str | os.PathLike[str],
    geometry: SceneGeometry,
    site: Site,
    deployment: Deployment,
    notes: Sequence[str] = (),
    *,
    created: str = "",
) -> None:
    """Draw the site with its candidates, the chosen sensors and what they see, as PNG.

    The same arguments give the same bytes.

    Parameters
    ----------
    notes : sequence of str
        Notes for the reader of the plan, one sentence each.
    created : str
        Time of the placement (ISO 8601), whose date the plan carries.
    """
    save_png(path, draw_plan(geometry, site, deployment, notes, created=created))


def draw_plan(
    geometry: SceneGeometry, site: Site, deployment: Deployment, notes: Sequence[str] = (), *, created: str = ""
) -> Figure:
    """Return the plan as a figure."""
    sensors = np.array([sensor.xyz[:2] for sensor in deployment.sensors]).reshape(-1, 2)
    shown = shapely.union_all([site.region, *shapely.points(sensors)])
    map_height = _map_height(shown)
    window = _window(shown, map_height)
    content = map_content(geometry, site, deployment, window)
    heading, legend = heading_of(site, deployment, MAP_WIDTH), PlanLegend(content, MAP_WIDTH, notes)
    size = (MAP_WIDTH + 2 * MARGIN, heading.height + map_height + legend.height + 2 * MARGIN)
    figure = new_page(size, DPI)
    heading.draw(figure, MARGIN)
    plan = add_axes(figure, MARGIN, legend.height + 2 * MARGIN, MAP_WIDTH, map_height)
    draw_map(plan, content, window, MAP_WIDTH)
    inch = (window[2] - window[0]) / MAP_WIDTH
    draw_scale(plan, inch)
    draw_north(plan, inch)
    credit = credits_of(site, created)
    draw_attribution(plan, credit)
    taken = [_corners(*paper) for paper in _papers(window)]
    taken += [credits_box(plan, credit)] if credit else []
    names = draw_street_names(plan, geometry, window, MAP_WIDTH, [*taken, *mark_boxes(sensors, inch)])
    draw_sensors(
        plan,
        deployment,
        sensors,
        site.targets.xyz[:, :2],
        zorder=SENSOR,
        taken=np.array([*taken, *names]).reshape(-1, 4),
    )
    legend.draw(add_axes(figure, MARGIN, MARGIN, MAP_WIDTH, legend.height))
    return figure


def _map_height(shown: BaseGeometry) -> float:
    """Return the height of the map on the page in inches, as near to the shape of what it shows as fits."""
    _, _, width, height = _bounds(shown)
    return min(max(MAP_WIDTH * height / width, MIN_MAP_HEIGHT), MAX_MAP_HEIGHT)


def _window(shown: BaseGeometry, map_height: float) -> Window:
    """Return the part of the plane to show: region and sensors with a margin, on a map of given height in inches.

    The margin is larger where the scale or the north arrow would hide part of the region.
    """
    x, y, width, height = _bounds(shown)
    shape = map_height / MAP_WIDTH
    width, height = max(width, height / shape), max(height, width * shape)
    windows = [
        (x - room * width / 2, y - room * height / 2, x + room * width / 2, y + room * height / 2) for room in ROOMS
    ]
    papers = ([shapely.box(*_corners(*paper)) for paper in _papers(one)] for one in windows)
    return next(
        (
            one
            for one, covers in zip(windows, papers, strict=True)
            if not any(shown.intersects(cover) for cover in covers)
        ),
        windows[0],
    )


def _papers(window: Window) -> list[Window]:
    """Return left, bottom, width and height of scale and north arrow on a map."""
    left, bottom, right, top = window
    inch = (right - left) / MAP_WIDTH
    return [scale_paper(left, bottom, inch), north_paper(right, top, inch)]


def _corners(left: float, bottom: float, width: float, height: float) -> Window:
    return left, bottom, left + width, bottom + height


def _bounds(shown: BaseGeometry) -> tuple[float, float, float, float]:
    """Return the middle, width and height of what is shown, with some room around it."""
    left, bottom, right, top = shown.bounds
    around = 2 * max(MARGIN_SHARE * max(right - left, top - bottom), MIN_MARGIN)
    return (left + right) / 2, (bottom + top) / 2, right - left + around, top - bottom + around


@dataclass(frozen=True, eq=False)
class _Row:
    """A part of the legend that stays in one column.

    Parameters
    ----------
    texts : tuple of (float, float, str, Style)
        Inches from the left and from the first line downwards, text, and style; a position of ``inf`` is the right end.
    height : float, inches
    joined : bool
        Whether the next row stays in the same column, as below a heading.
    """

    texts: tuple[tuple[float, float, str, Style], ...]
    height: float
    sign: Sign | None = None
    joined: bool = False

    def draw(self, axes: Axes, x: float, y: float, width: float) -> None:
        if self.sign is not None:
            self.sign(axes, x, y)
        for left, down, words, style in self.texts:
            plain: Style = {"size": SIZE, "color": INK, "va": "center", "parse_math": False}
            plain["ha"] = "right" if left > width else "left"
            axes.text(x + min(left, width), y + down, words, **plain | style)


class PlanLegend:
    """Legend of a plan, laid out in columns as low as its rows allow.

    Parameters
    ----------
    width : float, inches
        Width of all columns together.
    notes : sequence of str
        Sentences below everything else.
    """

    def __init__(self, content: MapContent, width: float, notes: Sequence[str]) -> None:
        self._column = (width - (COLUMNS - 1) * COLUMN_GAP) / COLUMNS
        self._width = width
        sections = (
            self._sensors(content.deployment),
            self._targets(content.site, content.deployment),
            self._map(content.geometry, content.site),
            self._heights(content),
            self._notes(notes),
        )
        self._rows = [row for section in sections for row in _together(list(section))]
        self.height = max(*map(self._tall, range(len(self._rows))), sum(row.height for row in self._rows) / COLUMNS)
        while len({column for column, _ in self._places()}) > COLUMNS:
            self.height += HEIGHT_STEP

    def draw(self, axes: Axes) -> None:
        """Draw all rows into axes of the legend's width and height."""
        axes.axis("off")
        axes.set(xlim=(0.0, self._width), ylim=(self.height, 0.0))
        for row, (column, y) in zip(self._rows, self._places(), strict=True):
            row.draw(axes, column * (self._column + COLUMN_GAP), y, self._column)

    def _tall(self, start: int) -> float:
        """Return the height of a row and of all that must stay below it in its column."""
        row = self._rows[start]
        return row.height + (self._tall(start + 1) if row.joined and start + 1 < len(self._rows) else 0.0)

    def _places(self) -> list[tuple[int, float]]:
        """Return the column of each row, and the distance of its first line from the top."""
        places, column, y, follows = [], 0, 0.0, False
        for number, row in enumerate(self._rows):
            if y > 0.0 and not follows and y + self._tall(number) > self.height + 1e-9:
                column, y = column + 1, 0.0
            places.append((column, y + 0.12))
            y, follows = y + row.height, row.joined
        return places

    def _sensors(self, deployment: Deployment) -> Iterator[_Row]:
        if deployment.sensors:
            yield self._heading("Sensors", "sees of the road")
        markers = markers_of(deployment)
        for sensor in deployment.sensors:
            last = sensor is deployment.sensors[-1]
            yield self._sensor(sensor, markers[sensor.model.key], AFTER if last else 0.0)

    def _sensor(self, sensor: Sensor, marker: str, after: float) -> _Row:
        room = self._column - LABEL_X
        names = wrapped(sensor.model.name, room - SHARE_ROOM, SIZE)
        below = wrapped(f"{sensor.height:.3g} m high{sensor.turned}, {sensor.position_name}", room, SMALL)
        texts: list[tuple[float, float, str, Style]] = [
            *((TEXT_X, 0.0, sensor.label, BOLD), (np.inf, 0.0, f"{sensor.alone:.0%}", BOLD)),
            *((LABEL_X, number * LINE, line, {}) for number, line in enumerate(names)),
            *((LABEL_X, len(names) * LINE + n * SMALL_LINE - 0.02, line, ASIDE) for n, line in enumerate(below)),
        ]
        sign = partial(_mark, SENSOR_MARK | {"marker": marker, "markersize": 8.0, "mew": 0.8})
        return _Row(tuple(texts), len(names) * LINE + len(below) * SMALL_LINE + 0.04 + after, sign)

    def _targets(self, site: Site, deployment: Deployment) -> Iterator[_Row]:
        shown = of_placement(deployment)
        yield self._heading(shown.title)
        for words, colour, share in reversed(list(zip(shown.words, shown.colours, shown.shares, strict=True))):
            yield self._line(words, partial(_swatch, {"facecolor": colour}), percent(share))
        yield self._small(f"share of the road, in {counted(len(site.targets), 'square')} of {site.targets.spacing:g} m")

    def _map(self, geometry: SceneGeometry, site: Site) -> Iterator[_Row]:
        yield self._heading("Map")
        swatches: list[tuple[str, Style]] = [("region of interest", {"edgecolor": INK, "linewidth": 1.1})]
        if any(mesh.name.startswith(OTHER_LEVELS) for mesh in geometry.ground):
            swatches.append(("road on another level", OTHER_ROAD))
        dashed: Style = {"edgecolor": WEIGHTED, "linewidth": 1.4, "linestyle": (0, (4, 1.5))}
        swatches += [(words, dashed) for words in _weighted(geometry.weighted_regions)]
        if geometry.forbidden_areas:
            swatches.append(("no sensor here", {"edgecolor": FORBIDDEN, "hatch": "////", "linewidth": 0.9}))
        if geometry.mandatory_areas:
            swatches.append(("at least one sensor here", {"edgecolor": MANDATORY, "hatch": "....", "linewidth": 0.9}))
        rows = [self._line(words, partial(_swatch, {"facecolor": "none"} | style)) for words, style in swatches]
        for count, mark, words in _positions(geometry, site):
            if count:
                larger = mark | {"markersize": mark["markersize"] * 1.4}
                rows.append(self._line(words, partial(_mark, larger)))
        yield from rows[:-1]
        yield replace(rows[-1], height=rows[-1].height + AFTER)

    def _heights(self, content: MapContent) -> Iterator[_Row]:
        yield self._heading("Obstacles", "height above the road")
        assumed = any(mesh.height_assumed for mesh in content.geometry.occluders)
        highest = float(content.heights.vmax or 0.0)
        ticks = tuple(
            (2.2 * share, 0.22, f"{highest * share:g}{unit}", {"ha": align, "size": SMALL})
            for share, align, unit in ((0.0, "left", ""), (0.5, "center", ""), (1.0, "right", " m"))
        )
        yield _Row(ticks, 0.44 + AFTER * (not assumed), partial(_ramp, content.heights), joined=assumed)
        if assumed:
            row = self._line("height assumed", partial(_swatch, ASSUMED_HEIGHT))
            yield replace(row, height=row.height + AFTER)

    def _notes(self, notes: Sequence[str]) -> Iterator[_Row]:
        if notes:
            yield self._heading("Notes")
        for note in notes:
            yield self._small(note[:1].upper() + note[1:])

    def _heading(self, words: str, aside: str = "") -> _Row:
        lines = wrapped(words, self._column, HEADING_SIZE, "bold")
        below = (len(lines) - 1) * LINE
        texts = [(0.0, n * LINE, line, BOLD | {"size": HEADING_SIZE}) for n, line in enumerate(lines)]
        return _Row((*texts, (np.inf, 0.0, aside, ASIDE)), HEADING_LINE + below, self._rule(below + 0.14), joined=True)

    def _rule(self, down: float) -> Sign:
        return lambda axes, x, y: axes.plot((x, x + self._column), (y + down,) * 2, color=SOFT_INK, linewidth=0.6)

    def _line(self, words: str, sign: Sign, share: str = "") -> _Row:
        """Return a row with a sign on the left, words, and a share on the right."""
        lines = wrapped(words, self._column - TEXT_X - (SHARE_ROOM if share else 0.0), SIZE)
        texts: list[tuple[float, float, str, Style]] = [(TEXT_X, n * LINE, line, {}) for n, line in enumerate(lines)]
        return _Row((*texts, (np.inf, 0.0, share, BOLD)), len(lines) * LINE, sign)

    def _small(self, words: str) -> _Row:
        lines = wrapped(words, self._column, SMALL)
        return _Row(
            tuple((0.0, n * SMALL_LINE, line, ASIDE) for n, line in enumerate(lines)), len(lines) * SMALL_LINE + AFTER
        )


def _mark(style: Style, axes: Axes, x: float, y: float) -> None:
    axes.plot(x + 0.12, y, clip_on=False, **style)


def _swatch(style: Style, axes: Axes, x: float, y: float) -> None:
    axes.add_patch(Rectangle((x + 0.02, y - 0.07), 0.2, 0.14, **style))


def _ramp(norm: Normalize, axes: Axes, x: float, y: float) -> None:
    ramp = HEIGHT_CMAP(norm(np.linspace(0.0, float(norm.vmax or 0.0), 128)[None, :]))
    axes.imshow(ramp, extent=(x, x + 2.2, y + 0.1, y - 0.06), aspect="auto", interpolation="nearest")


def _together(rows: list[_Row]) -> list[_Row]:
    """Return the rows of a section, all in one column unless there are too many."""
    if len(rows) > MOST_TOGETHER:
        return rows
    return [replace(row, joined=row is not rows[-1]) for row in rows]


def _weighted(regions: Sequence[NamedArea]) -> Iterator[str]:
    """Yield the words for the weighted regions of each weight."""
    for weight in sorted({area.weight for area in regions}):
        names = [area.name for area in regions if area.weight == weight]
        name = names[0] if len(names) == 1 else counted(len(names), "area")
        yield f"{name} (weight {weight:g} if weights are used)"


def _positions(geometry: SceneGeometry, site: Site) -> Iterator[tuple[int, Style, str]]:
    """Yield number, mark and legend of each kind of position; assumed poles count that carry no sensor, too."""
    candidates = site.candidates
    existing = candidates.pole_source[candidates.on_pole & (candidates.pole_source != ASSUMED)]
    assumed = sum(pole.source == ASSUMED for pole in geometry.poles)
    used = (candidates.pole_source == ASSUMED).any()
    posts = int(np.count_nonzero(~candidates.on_pole))
    poles = ("pole from the map", "poles from the map") if (existing == FROM_MAP).all() else ("existing pole",)
    yield posts, SIDEWALK_MARK, counted(posts, "possible new post")
    yield len(existing), POLE_MARK, counted(len(existing), *poles)
    yield assumed, ASSUMED_MARK, f"{counted(assumed, 'assumed pole')}{'' if used else ', not used'}"
