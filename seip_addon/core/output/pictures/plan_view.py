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

from ...base.counts import counted
from ...choosing.placement.deployment import Deployment
from ...site.scene_geometry import ASSUMED, FROM_MAP, OTHER_LEVELS, NamedArea, SceneGeometry
from ...site.site import Site
from .colours import of_placement
from .drawing import (
    SENSOR_MARK,
    Style,
    Window,
    add_axes,
    corner_boxes,
    credits_of,
    draw_corners,
    draw_sensors,
    heading_of,
    markers_of,
    new_page,
    percent,
    save_png,
    window_around,
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
COLUMN = (MAP_WIDTH - (COLUMNS - 1) * COLUMN_GAP) / COLUMNS  # width, inches
SIZE, SMALL, HEADING_SIZE = 10.0, 9.0, 11.5  # points
LINE, SMALL_LINE, HEADING_LINE, AFTER = 0.23, 0.19, 0.4, 0.16  # inches
TEXT_X, LABEL_X, SHARE_ROOM = 0.34, 0.78, 0.55  # inches: of text beside a mark, of a sensor's type, for its share
MOST_TOGETHER = 12  # rows of a section that stay in one column
HEIGHT_STEP = 0.1  # inches, by which a legend grows until its columns suffice

BOLD: Style = {"weight": "bold"}
ASIDE: Style = {"size": SMALL, "color": SOFT_INK}
Sign = Callable[[Axes, float, float], object]
"""Draws a sign into axes in inches, at the left end and the middle of a row's first line."""


def save_plan_view(
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
    window, map_height = _window(shown)
    content = map_content(geometry, site, deployment, window)
    heading, legend = heading_of(site, deployment, MAP_WIDTH), PlanLegend(content, notes)
    size = (MAP_WIDTH + 2 * MARGIN, heading.height + map_height + legend.height + 2 * MARGIN)
    figure = new_page(size, DPI)
    heading.draw(figure, MARGIN)
    plan = add_axes(figure, MARGIN, legend.height + 2 * MARGIN, MAP_WIDTH, map_height, window)
    draw_map(plan, content, window, MAP_WIDTH)
    inch = (window[2] - window[0]) / MAP_WIDTH
    taken = draw_corners(plan, credits_of(site, created))
    names = draw_street_names(plan, geometry, window, MAP_WIDTH, [*taken, *mark_boxes(sensors, inch)])
    draw_sensors(
        plan,
        deployment,
        sensors,
        site.targets.xyz[:, :2],
        zorder=SENSOR,
        taken=[*taken, *names],
    )
    legend.draw(add_axes(figure, MARGIN, MARGIN, MAP_WIDTH, legend.height))
    return figure


def _window(shown: BaseGeometry) -> tuple[Window, float]:
    """Return the part of the plane to show, region and sensors with a margin, and the height of its map in inches.

    The margin is larger where the scale or the north arrow would hide part of the region.
    """
    left, bottom, right, top = shown.bounds
    margin = max(MARGIN_SHARE * max(right - left, top - bottom), MIN_MARGIN)
    first = window_around(shown.bounds, margin, (MIN_MAP_HEIGHT / MAP_WIDTH, MAX_MAP_HEIGHT / MAP_WIDTH))
    x, y, width, height = first[0] + first[2], first[1] + first[3], first[2] - first[0], first[3] - first[1]
    map_height = MAP_WIDTH * height / width
    rooms = [(room * width, room * height) for room in ROOMS]
    windows = [((x - wide) / 2, (y - high) / 2, (x + wide) / 2, (y + high) / 2) for wide, high in rooms]
    for one in windows:
        if not any(shown.intersects(shapely.box(*box)) for box in corner_boxes(one, (one[2] - one[0]) / MAP_WIDTH)):
            return one, map_height
    return windows[0], map_height


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

    def draw(self, axes: Axes, x: float, y: float) -> None:
        if self.sign is not None:
            self.sign(axes, x, y)
        for left, down, words, style in self.texts:
            plain: Style = {"size": SIZE, "color": INK, "va": "center", "parse_math": False}
            plain["ha"] = "right" if left > COLUMN else "left"
            axes.text(x + min(left, COLUMN), y + down, words, **plain | style)

    def followed_by(self, room: float) -> "_Row":
        return replace(self, height=self.height + room)


class PlanLegend:
    """Legend of a plan, `MAP_WIDTH` inches wide, laid out in columns as low as its rows allow; notes come last."""

    def __init__(self, content: MapContent, notes: Sequence[str]) -> None:
        site, deployment = content.site, content.deployment
        sections = (
            _sensor_rows(deployment),
            _target_rows(site, deployment),
            _map_rows(content.geometry, site),
            _height_rows(content),
            [*([_heading("Notes")] if notes else []), *(_small(note[:1].upper() + note[1:]) for note in notes)],
        )
        for rows in sections:
            if len(rows) <= MOST_TOGETHER:
                rows[:-1] = [replace(row, joined=True) for row in rows[:-1]]
        self._rows = [row for rows in sections for row in rows]
        self.height = max(*map(self._tall, range(len(self._rows))), sum(row.height for row in self._rows) / COLUMNS)
        while len({column for column, _ in self._places()}) > COLUMNS:
            self.height += HEIGHT_STEP

    def draw(self, axes: Axes) -> None:
        """Draw all rows into axes of the legend's width and height."""
        axes.axis("off")
        axes.set(xlim=(0.0, MAP_WIDTH), ylim=(self.height, 0.0))
        for row, (column, y) in zip(self._rows, self._places(), strict=True):
            row.draw(axes, column * (COLUMN + COLUMN_GAP), y)

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


def _sensor_rows(deployment: Deployment) -> list[_Row]:
    markers, room = markers_of(deployment), COLUMN - LABEL_X
    rows = []
    for sensor in deployment.sensors:
        names = wrapped(sensor.model.name, room - SHARE_ROOM, SIZE)
        below = wrapped(f"{sensor.height:.3g} m high{sensor.turned}, {sensor.position_name}", room, SMALL)
        texts: list[tuple[float, float, str, Style]] = [
            *((TEXT_X, 0.0, sensor.label, BOLD), (np.inf, 0.0, f"{sensor.alone:.0%}", BOLD)),
            *((LABEL_X, number * LINE, line, {}) for number, line in enumerate(names)),
            *((LABEL_X, len(names) * LINE + n * SMALL_LINE - 0.02, line, ASIDE) for n, line in enumerate(below)),
        ]
        sign = partial(_mark, SENSOR_MARK | {"marker": markers[sensor.model.key], "markersize": 8.0, "mew": 0.8})
        rows.append(_Row(tuple(texts), len(names) * LINE + len(below) * SMALL_LINE + 0.04, sign))
    return [_heading("Sensors", "sees of the road"), *rows[:-1], rows[-1].followed_by(AFTER)] if rows else []


def _target_rows(site: Site, deployment: Deployment) -> list[_Row]:
    shown = of_placement(deployment)
    classes = reversed(list(zip(shown.words, shown.colours, shown.shares, strict=True)))
    rows = [_line(words, partial(_swatch, {"facecolor": colour}), percent(share)) for words, colour, share in classes]
    squares = f"share of the road, in {counted(len(site.targets), 'square')} of {site.targets.spacing:g} m"
    return [_heading(shown.title), *rows, _small(squares)]


def _map_rows(geometry: SceneGeometry, site: Site) -> list[_Row]:
    swatches: list[tuple[str, Style]] = [("region of interest", {"edgecolor": INK, "linewidth": 1.1})]
    if any(mesh.name.startswith(OTHER_LEVELS) for mesh in geometry.ground):
        swatches.append(("road on another level", OTHER_ROAD))
    dashed: Style = {"edgecolor": WEIGHTED, "linewidth": 1.4, "linestyle": (0, (4, 1.5))}
    swatches += [(words, dashed) for words in _weighted(geometry.weighted_regions)]
    if geometry.forbidden_areas:
        swatches.append(("no sensor here", {"edgecolor": FORBIDDEN, "hatch": "////", "linewidth": 0.9}))
    if geometry.mandatory_areas:
        swatches.append(("at least one sensor here", {"edgecolor": MANDATORY, "hatch": "....", "linewidth": 0.9}))
    rows = [_line(words, partial(_swatch, {"facecolor": "none"} | style)) for words, style in swatches]
    for count, mark, words in _positions(geometry, site):
        if count:
            rows.append(_line(words, partial(_mark, mark | {"markersize": mark["markersize"] * 1.4})))
    return [_heading("Map"), *rows[:-1], rows[-1].followed_by(AFTER)]


def _height_rows(content: MapContent) -> list[_Row]:
    highest = float(content.heights.vmax or 0.0)
    ticks = tuple(
        (2.2 * share, 0.22, f"{highest * share:g}{unit}", {"ha": align, "size": SMALL})
        for share, align, unit in ((0.0, "left", ""), (0.5, "center", ""), (1.0, "right", " m"))
    )
    rows = [_heading("Obstacles", "height above the road"), _Row(ticks, 0.44, partial(_ramp, content.heights))]
    if any(mesh.height_assumed for mesh in content.geometry.occluders):
        rows.append(_line("height assumed", partial(_swatch, ASSUMED_HEIGHT)))
    return [*rows[:-1], rows[-1].followed_by(AFTER)]


def _heading(words: str, aside: str = "") -> _Row:
    lines = wrapped(words, COLUMN, HEADING_SIZE, "bold")
    below = (len(lines) - 1) * LINE

    def rule(axes: Axes, x: float, y: float) -> None:
        axes.plot((x, x + COLUMN), (y + below + 0.14,) * 2, color=SOFT_INK, linewidth=0.6)

    texts = [(0.0, n * LINE, line, BOLD | {"size": HEADING_SIZE}) for n, line in enumerate(lines)]
    return _Row((*texts, (np.inf, 0.0, aside, ASIDE)), HEADING_LINE + below, rule, joined=True)


def _line(words: str, sign: Sign, share: str = "") -> _Row:
    """Return a row with a sign on the left, words, and a share on the right."""
    lines = wrapped(words, COLUMN - TEXT_X - (SHARE_ROOM if share else 0.0), SIZE)
    texts: list[tuple[float, float, str, Style]] = [(TEXT_X, n * LINE, line, {}) for n, line in enumerate(lines)]
    return _Row((*texts, (np.inf, 0.0, share, BOLD)), len(lines) * LINE, sign)


def _small(words: str) -> _Row:
    lines = wrapped(words, COLUMN, SMALL)
    texts = tuple((0.0, n * SMALL_LINE, line, ASIDE) for n, line in enumerate(lines))
    return _Row(texts, len(lines) * SMALL_LINE + AFTER)


def _mark(style: Style, axes: Axes, x: float, y: float) -> None:
    axes.plot(x + 0.12, y, clip_on=False, **style)


def _swatch(style: Style, axes: Axes, x: float, y: float) -> None:
    axes.add_patch(Rectangle((x + 0.02, y - 0.07), 0.2, 0.14, **style))


def _ramp(norm: Normalize, axes: Axes, x: float, y: float) -> None:
    ramp = HEIGHT_CMAP(norm(np.linspace(0.0, float(norm.vmax or 0.0), 128)[None, :]))
    axes.imshow(ramp, extent=(x, x + 2.2, y + 0.1, y - 0.06), aspect="auto", interpolation="nearest")


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
