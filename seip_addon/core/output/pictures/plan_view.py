"""The plan of a site: map, title and legend with the sensors, shares of the road, and what lines and marks mean."""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

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
from .coverage_colours import of_placement
from .drawing import (
    SENSOR_MARK,
    Style,
    add_axes,
    credits_box,
    credits_of,
    draw_attribution,
    draw_sensors,
    heading_of,
    markers_of,
    new_page,
    percent,
    save_png,
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
from .scale_bar import draw_north, draw_scale, north_paper, scale_paper

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

Draw = Callable[["_Column"], None]


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
    """A part of the legend that stays in one column: its height in inches, and what draws it at the column's place.

    Parameters
    ----------
    joined : bool
        Whether the next row stays in the same column, as below a heading.
    """

    height: float
    draw: Draw
    joined: bool = False


@dataclass
class _Column:
    """A place in the legend at which a row is drawn, inches from its upper left corner, and the width of the column."""

    axes: Axes
    x: float
    y: float
    width: float

    def text(self, x: float, words: str, *, down: float = 0.0, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
        plain: Style = {"size": SIZE, "color": INK, "ha": "left", "va": "center", "parse_math": False}
        self.axes.text(self.x + x, self.y + down, words, **plain | style)

    def swatch(self, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
        self.axes.add_patch(Rectangle((self.x + 0.02, self.y - 0.07), 0.2, 0.14, **style))

    def mark(self, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
        self.axes.plot(self.x + 0.12, self.y, clip_on=False, **style)


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
        self._column_width = (width - (COLUMNS - 1) * COLUMN_GAP) / COLUMNS
        self._width = width
        assumed = any(mesh.height_assumed for mesh in content.geometry.occluders)
        sections = (
            self._sensors(content.deployment),
            self._targets(content.site, content.deployment),
            self._map(content.geometry, content.site),
            self._heights(content.heights, assumed=assumed),
            self._notes(notes),
        )
        self._rows = [row for section in sections for row in _together(list(section))]
        self.height = max(*map(self._tall, range(len(self._rows))), self._least_height())
        while len({column for column, _ in self._places()}) > COLUMNS:
            self.height += HEIGHT_STEP

    def draw(self, axes: Axes) -> None:
        """Draw all rows into axes of the legend's width and height."""
        axes.axis("off")
        axes.set(xlim=(0.0, self._width), ylim=(self.height, 0.0))
        for row, (column, y) in zip(self._rows, self._places(), strict=True):
            row.draw(_Column(axes, column * (self._column_width + COLUMN_GAP), y, self._column_width))

    def _least_height(self) -> float:
        return sum(row.height for row in self._rows) / COLUMNS

    def _tall(self, start: int) -> float:
        """Return the height of a row and of all that must stay below it in its column."""
        height = self._rows[start].height
        while self._rows[start].joined and start + 1 < len(self._rows):
            start += 1
            height += self._rows[start].height
        return height

    def _places(self) -> list[tuple[int, float]]:
        """Return the column of each row, and the distance of its middle line from the top."""
        places, column, y = [], 0, 0.0
        for number, row in enumerate(self._rows):
            follows = number > 0 and self._rows[number - 1].joined
            if y > 0.0 and not follows and y + self._tall(number) > self.height + 1e-9:
                column, y = column + 1, 0.0
            places.append((column, y + 0.12))
            y += row.height
        return places

    def _sensors(self, deployment: Deployment) -> Iterator[_Row]:
        """Yield a row for each sensor, and a heading in front."""
        if not deployment.sensors:
            return
        yield self._heading("Sensors", "sees of the road")
        markers = markers_of(deployment)
        for last, sensor in zip((*(False,) * (len(deployment.sensors) - 1), True), deployment.sensors, strict=True):
            yield self._sensor(sensor, markers[sensor.model.key], AFTER if last else 0.0)

    def _sensor(self, sensor: Sensor, marker: str, after: float) -> _Row:
        room = self._column_width - LABEL_X
        lines = wrapped(sensor.model.name, room - SHARE_ROOM, SIZE)
        below = wrapped(f"{sensor.height:.3g} m high{sensor.turned}, {sensor.position_name}", room, SMALL)

        def draw(at: _Column) -> None:
            at.mark(marker=marker, **SENSOR_MARK | {"markersize": 8.0, "mew": 0.8})
            at.text(TEXT_X, sensor.label, weight="bold")
            at.text(at.width, f"{sensor.alone:.0%}", ha="right", weight="bold")
            for number, line in enumerate(lines):
                at.text(LABEL_X, line, down=number * LINE)
            for number, line in enumerate(below):
                at.text(LABEL_X, line, down=len(lines) * LINE + number * SMALL_LINE - 0.02, size=SMALL, color=SOFT_INK)

        return _Row(len(lines) * LINE + len(below) * SMALL_LINE + 0.04 + after, draw)

    def _targets(self, site: Site, deployment: Deployment) -> Iterator[_Row]:
        shown = of_placement(deployment)
        yield self._heading(shown.title)
        for words, colour, share in reversed(list(zip(shown.words, shown.colours, shown.shares, strict=True))):
            yield self._swatch(words, percent(share), facecolor=colour)
        squares = f"share of the road, in {counted(len(site.targets), 'square')} of {site.targets.spacing:g} m"
        yield self._small(squares)

    def _map(self, geometry: SceneGeometry, site: Site) -> Iterator[_Row]:
        yield self._heading("Map")
        rows = [self._swatch("region of interest", facecolor="none", edgecolor=INK, linewidth=1.1)]
        if any(mesh.name.startswith(OTHER_LEVELS) for mesh in geometry.ground):
            rows.append(self._swatch("road on another level", **OTHER_ROAD))
        dashed: Style = {"facecolor": "none", "edgecolor": WEIGHTED, "linewidth": 1.4, "linestyle": (0, (4, 1.5))}
        rows += [self._swatch(words, **dashed) for words in _weighted(geometry.weighted_regions)]
        for areas, colour, hatch, words in (
            (geometry.forbidden_areas, FORBIDDEN, "////", "no sensor here"),
            (geometry.mandatory_areas, MANDATORY, "....", "at least one sensor here"),
        ):
            if areas:
                rows.append(self._swatch(words, facecolor="none", edgecolor=colour, hatch=hatch, linewidth=0.9))
        rows += [self._marked(words, mark) for count, mark, words in _positions(geometry, site) if count]
        yield from rows[:-1]
        yield _Row(rows[-1].height + AFTER, rows[-1].draw)

    def _heights(self, norm: Normalize, *, assumed: bool) -> Iterator[_Row]:
        yield self._heading("Obstacles", "height above the road")
        highest = float(norm.vmax or 0.0)

        def draw(at: _Column) -> None:
            ramp = np.linspace(0.0, highest, 128)[None, :]
            extent = (at.x, at.x + 2.2, at.y + 0.1, at.y - 0.06)
            at.axes.imshow(HEIGHT_CMAP(norm(ramp)), extent=extent, aspect="auto", interpolation="nearest")
            for share, align in ((0.0, "left"), (0.5, "center"), (1.0, "right")):
                unit = " m" if share == 1.0 else ""
                at.text(2.2 * share, f"{highest * share:g}{unit}", down=0.22, ha=align, size=SMALL)

        yield _Row(0.44 + AFTER * (not assumed), draw, joined=assumed)
        if assumed:
            row = self._swatch("height assumed", **ASSUMED_HEIGHT)
            yield _Row(row.height + AFTER, row.draw)

    def _notes(self, notes: Sequence[str]) -> Iterator[_Row]:
        if notes:
            yield self._heading("Notes")
        for note in notes:
            yield self._small(note[:1].upper() + note[1:])

    def _heading(self, words: str, aside: str = "") -> _Row:
        lines = wrapped(words, self._column_width, HEADING_SIZE, "bold")
        below = (len(lines) - 1) * LINE

        def draw(at: _Column) -> None:
            for number, line in enumerate(lines):
                at.text(0.0, line, weight="bold", size=HEADING_SIZE, down=number * LINE)
            at.text(at.width, aside, size=SMALL, color=SOFT_INK, ha="right")
            at.axes.plot((at.x, at.x + at.width), (at.y + below + 0.14,) * 2, color=SOFT_INK, linewidth=0.6)

        return _Row(HEADING_LINE + below, draw, joined=True)

    def _swatch(self, words: str, share: str = "", **style: Any) -> _Row:  # noqa: ANN401 - matplotlib's own
        return self._line(words, share, lambda at: at.swatch(**style))

    def _marked(self, words: str, mark: Style) -> _Row:
        return self._line(words, "", lambda at: at.mark(**mark | {"markersize": mark["markersize"] * 1.4}))

    def _line(self, words: str, share: str, sign: Draw) -> _Row:
        """Return a row with a sign on the left, words, and a share on the right."""
        lines = wrapped(words, self._column_width - TEXT_X - (SHARE_ROOM if share else 0.0), SIZE)

        def draw(at: _Column) -> None:
            sign(at)
            at.text(at.width, share, ha="right", weight="bold")
            for number, line in enumerate(lines):
                at.text(TEXT_X, line, down=number * (LINE - 0.02))

        return _Row(LINE + (len(lines) - 1) * (LINE - 0.02), draw)

    def _small(self, words: str) -> _Row:
        lines = wrapped(words, self._column_width, SMALL)

        def draw(at: _Column) -> None:
            for number, line in enumerate(lines):
                at.text(0.0, line, down=number * SMALL_LINE, size=SMALL, color=SOFT_INK)

        return _Row(len(lines) * SMALL_LINE + AFTER, draw)


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
