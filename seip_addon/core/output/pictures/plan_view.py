"""The plan of a site: map, title and legend with the sensors, shares of the road, and what lines and marks mean."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import shapely
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle, Wedge
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...base.counts import counted
from ...choosing.placement.deployment import Deployment
from ...geometry.plan import closed, outline
from ...site.scene_geometry import ASSUMED, FROM_MAP, OTHER_LEVELS, Mesh, NamedArea, SceneGeometry
from ...site.site import Site
from ...site.targets import target_squares
from .drawing import (
    MARK_RADIUS,
    SENSOR_MARK,
    Style,
    Window,
    add_axes,
    corner_boxes,
    credits_of,
    draw_area,
    draw_corners,
    draw_polygons,
    draw_sensors,
    heading_of,
    is_writable,
    markers_of,
    new_page,
    percent,
    text_width,
    window_around,
    wrapped,
)
from .palette import (
    ASSUMED_POLE_COLOUR,
    FORBIDDEN,
    INK,
    MANDATORY,
    PAPER,
    POLE_COLOUR,
    SOFT_INK,
    WEIGHTED,
    of_placement,
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

ARROW_LENGTH, WEDGE_LENGTH = 0.34, 0.5  # inches
LAND, PAVEMENT, ROAD, KERB = "#edefe9", "#e2dacb", "#dcdfe3", "#8f949a"
MAX_GAP = 0.06  # metres
MIN_PLAN_AREA = 1e-6  # square metres in plan, below which a triangle is a wall's
NAME_SIZE = 9.5  # points, of the names of streets
MIN_NAME_ROOM = 1.15  # length of a street on the map, in lengths of its name, from which on it is named
NAME_SHIFTS = (0.0, 0.4, -0.4, 0.8, -0.8)  # of the name along its street, in shares of the room on each side

HEIGHT_CMAP = LinearSegmentedColormap.from_list("heights", ("#d2d0c4", "#8b9285", "#4b5350"))
SIDEWALK_MARK: Style = {"linestyle": "none", "marker": "o", "markersize": 2.6, "mfc": PAPER, "mec": INK, "mew": 0.5}
ASSUMED_HEIGHT: Style = {"facecolor": "none", "edgecolor": "#c9cdc4", "hatch": "\\\\\\", "linewidth": 0.4}
OTHER_ROAD: Style = {"facecolor": "#d6d9d8", "edgecolor": "#b4b9ba", "linewidth": 0.4}
"""A road on another level than the studied one."""
POLE_MARK: Style = {"linestyle": "none", "marker": "D", "markersize": 3.8, "mfc": POLE_COLOUR, "mec": INK, "mew": 0.6}
ASSUMED_MARK: Style = POLE_MARK | {"mfc": PAPER, "mec": ASSUMED_POLE_COLOUR, "mew": 0.9}

SURFACE, EDGE, TARGET, OBSTACLE, BORDER, CANDIDATE, TEXT, SENSOR = range(8)


def draw_plan(
    geometry: SceneGeometry, site: Site, deployment: Deployment, notes: Sequence[str] = (), *, created: str = ""
) -> Figure:
    """Draw the site with its candidates, the chosen sensors and what they see.

    Parameters
    ----------
    notes : sequence of str
        Notes for the reader of the plan, one sentence each.
    created : str
        Time of the placement (ISO 8601), whose date the plan carries.
    """
    sensors = np.array([sensor.xyz[:2] for sensor in deployment.sensors]).reshape(-1, 2)
    window, map_height = _window(shapely.union_all([site.region, *shapely.points(sensors)]))
    shown, inch = shapely.box(*window), (window[2] - window[0]) / MAP_WIDTH
    obstacles = _obstacles(geometry.occluders, shown)
    above = _above_road(site, obstacles)
    heights = Normalize(0.0, 5.0 * math.ceil(max(10.0, above.max(initial=0.0)) / 5.0))
    heading, legend = heading_of(site, deployment, MAP_WIDTH), _Legend(geometry, site, deployment, heights, notes)
    size = (MAP_WIDTH + 2 * MARGIN, heading.height + map_height + legend.height + 2 * MARGIN)
    figure = new_page(size, DPI)
    heading.draw(figure, MARGIN)
    plan = add_axes(figure, MARGIN, legend.height + 2 * MARGIN, MAP_WIDTH, map_height, window)
    plan.set(facecolor=LAND)
    _draw_surfaces(plan, geometry, shown)
    seen, squares = of_placement(deployment), target_squares(site.targets)[:, :, :2]
    plain: Style = {"edgecolors": "none", "antialiaseds": False}
    draw_polygons(plan, squares, facecolors=np.array(seen.colours)[seen.of], zorder=TARGET, **plain)
    # Below the coverage: what a tree or a bridge covers of the studied road is seen through it, under its outline.
    draw_polygons(plan, obstacles[:, :, :2], facecolors=HEIGHT_CMAP(heights(above)), zorder=TARGET - 0.5, **plain)
    draw_area(plan, outline(obstacles), facecolor="none", edgecolor="#3d4542", linewidth=0.5, zorder=OBSTACLE)
    for mesh in geometry.occluders:
        if mesh.height_assumed:
            draw_area(plan, _footprint(mesh, shown), **ASSUMED_HEIGHT, zorder=OBSTACLE)
    _draw_areas(plan, geometry, site.region)
    _draw_candidates(plan, geometry, site)
    _draw_headings(plan, deployment, inch)
    taken = draw_corners(plan, credits_of(site, created))
    taken += _draw_street_names(plan, geometry, window, [*taken, *_mark_boxes(sensors, inch)])
    draw_sensors(plan, deployment, sensors, site.targets.xyz[:, :2], zorder=SENSOR, taken=taken)
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


def _draw_street_names(axes: Axes, geometry: SceneGeometry, window: Window, taken: Sequence[Window]) -> list[Window]:
    """Write the names of streets along them where they fit, off boxes that are taken, and return their own boxes.

    Names with letters that the type lacks are left out.
    """
    inch = (window[2] - window[0]) / MAP_WIDTH
    boxes: list[Window] = []
    for place in geometry.places:
        if place.crossing or not is_writable(place.name):
            continue
        parts = [part for part in shapely.get_parts(place.polygon) if part.area > 0]
        pairs = [(part, cut) for part in parts for cut in shapely.get_parts(part.intersection(shapely.box(*window)))]
        if not pairs:
            continue
        whole, shown = max(pairs, key=lambda pair: float(pair[1].area))
        along = _direction(whole)
        reach = shapely.get_coordinates(shown) @ along
        middle = np.array(shown.centroid.coords[0])
        length = text_width(place.name, NAME_SIZE) * inch
        spare = (float(np.ptp(reach)) - MIN_NAME_ROOM * length) / 2
        half = np.abs(along) * length / 2 + NAME_SIZE / 72 * inch * 0.7
        tried = [middle + share * max(spare, 0.0) * along for share in NAME_SHIFTS]
        others = shapely.box(*np.reshape([*taken, *boxes], (-1, 4)).T)
        free = [at for at in tried if not shapely.box(*(at - half), *(at + half)).intersects(others).any()]
        if spare < 0 or not free:
            continue
        angle = (math.degrees(math.atan2(along[1], along[0])) + 90.0) % 180.0 - 90.0
        halo = [patheffects.withStroke(linewidth=2.6, foreground=PAPER)]
        style: Style = {"ha": "center", "va": "center", "rotation": angle, "size": NAME_SIZE, "color": INK}
        x, y = free[0].tolist()
        style |= {"path_effects": halo, "parse_math": False, "clip_on": True, "zorder": TEXT - 0.5}
        axes.text(x, y, place.name, **style)
        boxes.append((*(free[0] - half), *(free[0] + half)))
    return boxes


def _mark_boxes(sensors: Float, inch: float) -> list[Window]:
    """Return the boxes of the marks of sensors (k, 2), left, bottom, right and top of each."""
    half = MARK_RADIUS / 72 * inch
    return [(x - half, y - half, x + half, y + half) for x, y in sensors.tolist()]


def _direction(street: BaseGeometry) -> Float:
    """Return the direction of the longer side of the narrowest rectangle around a street, (2,)."""
    sides = np.diff(shapely.get_coordinates(shapely.minimum_rotated_rectangle(street)), axis=0)[:2]
    longer = sides[int(np.argmax(np.hypot(*sides.T)))]
    along: Float = longer / np.hypot(*longer)
    return along


def _draw_surfaces(plan: Axes, geometry: SceneGeometry, shown: BaseGeometry) -> None:
    others = [_footprint(mesh, shown) for mesh in geometry.ground if mesh.name.startswith(OTHER_LEVELS)]
    other_roads = closed(shapely.union_all(others), MAX_GAP)
    draw_area(plan, other_roads, **OTHER_ROAD, zorder=SURFACE)
    pavement = shapely.intersection(geometry.candidate_areas, shown)
    draw_area(plan, closed(pavement, MAX_GAP), facecolor=PAVEMENT, edgecolor=KERB, linewidth=0.4, zorder=SURFACE)
    roads = shapely.union_all([_footprint(mesh, shown) for mesh in geometry.roads])
    draw_area(plan, closed(roads, MAX_GAP), facecolor=ROAD, edgecolor=KERB, linewidth=0.6, zorder=EDGE)


def _footprint(mesh: Mesh, shown: BaseGeometry) -> BaseGeometry:
    """Return what a mesh covers in plan, near the part that is shown."""
    near = shapely.intersects(shapely.polygons(mesh.triangles[:, :, :2]), shown)
    return outline(mesh.triangles[near])


def _obstacles(occluders: Sequence[Mesh], shown: BaseGeometry) -> Float:
    """Return the triangles (n, 3, 3) of obstacles that a part of the plane shows, the highest last."""
    triangles = np.concatenate([np.empty((0, 3, 3)), *(mesh.triangles for mesh in occluders)])
    flat = shapely.polygons(triangles[:, :, :2])
    triangles = triangles[(shapely.area(flat) > MIN_PLAN_AREA) & shapely.intersects(flat, shown)]
    top = triangles[:, :, 2].max(axis=1)
    order = np.argsort(top, kind="stable")
    ordered: Float = triangles[order]
    return ordered


def _above_road(site: Site, triangles: Float) -> Float:
    """Return the height of the top of each triangle (n, 3, 3) above the road next to it."""
    targets = site.targets.xyz
    middles = shapely.points(triangles.mean(axis=1)[:, :2])
    nearest = shapely.STRtree(shapely.points(targets[:, :2])).nearest(middles)
    height: Float = triangles[:, :, 2].max(axis=1) - targets[nearest, 2]
    return height


def _draw_areas(plan: Axes, geometry: SceneGeometry, region: BaseGeometry) -> None:
    draw_area(plan, closed(region, MAX_GAP), facecolor="none", edgecolor=INK, linewidth=1.1, zorder=BORDER)
    for areas, colour, hatch in (
        (geometry.forbidden_areas, FORBIDDEN, "////"),
        (geometry.mandatory_areas, MANDATORY, "...."),
    ):
        for area in areas:
            draw_area(plan, area.polygon, facecolor="none", edgecolor=colour, hatch=hatch, linewidth=0.9, zorder=BORDER)
    for area in geometry.weighted_regions:
        draw_area(plan, area.polygon, facecolor="none", edgecolor=PAPER, linewidth=2.8, zorder=BORDER)
        dashed = {"edgecolor": WEIGHTED, "linewidth": 1.5, "linestyle": (0, (5, 2))}
        draw_area(plan, area.polygon, facecolor="none", **dashed, zorder=BORDER)


def _draw_candidates(plan: Axes, geometry: SceneGeometry, site: Site) -> None:
    """Draw candidate positions, and assumed poles whether they are candidates or not."""
    position, on_pole = site.candidates.position, site.candidates.on_pole
    existing = on_pole & (site.candidates.pole_source != ASSUMED)
    assumed = np.array([pole.base[:2] for pole in geometry.poles if pole.source == ASSUMED]).reshape(-1, 2)
    for places, style in (
        (position[~on_pole], SIDEWALK_MARK),
        (position[existing], POLE_MARK),
        (assumed, ASSUMED_MARK),
    ):
        plan.plot(places[:, 0], places[:, 1], zorder=CANDIDATE, **style)


def _draw_headings(plan: Axes, deployment: Deployment, inch: float) -> None:
    """Draw an arrow for each sensor with a preferred direction, and a wedge for a limited field of view."""
    for sensor in deployment.sensors:
        x, y, _ = sensor.xyz.tolist()
        if not sensor.model.all_round:
            yaw, half = math.degrees(sensor.yaw), math.degrees(sensor.model.field_of_view) / 2
            wedge = Wedge((x, y), WEDGE_LENGTH * inch, yaw - half, yaw + half, facecolor=INK, edgecolor=INK, alpha=0.25)
            plan.add_patch(wedge).set_zorder(SENSOR - 0.3)
        if sensor.tilt != 0.0 or not sensor.model.all_round:
            ahead = (x + ARROW_LENGTH * inch * math.cos(sensor.yaw), y + ARROW_LENGTH * inch * math.sin(sensor.yaw))
            style = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.6, "shrinkA": 0.0, "shrinkB": 0.0}
            plan.annotate("", xy=ahead, xytext=(x, y), arrowprops=style, zorder=SENSOR - 0.2)


@dataclass(frozen=True, eq=False)
class _Row:
    """A row of the legend.

    Parameters
    ----------
    texts : tuple of (float, float, str, Style)
        Inches from the left and from the first line downwards, text, and style; a position of ``inf`` is the right end.
    height : float, inches
    """

    texts: tuple[tuple[float, float, str, Style], ...]
    height: float
    sign: Sign | None = None

    def draw(self, axes: Axes, x: float, y: float) -> None:
        if self.sign is not None:
            self.sign(axes, x, y)
        for left, down, words, style in self.texts:
            plain: Style = {"size": SIZE, "color": INK, "va": "center", "parse_math": False}
            plain["ha"] = "right" if left > COLUMN else "left"
            axes.text(x + min(left, COLUMN), y + down, words, **plain | style)


class _Legend:
    """Legend of a plan, `MAP_WIDTH` inches wide, laid out in columns as low as its rows allow; notes come last."""

    def __init__(
        self, geometry: SceneGeometry, site: Site, deployment: Deployment, heights: Normalize, notes: Sequence[str]
    ) -> None:
        sections = (
            _sensor_rows(deployment),
            _target_rows(site, deployment),
            _map_rows(geometry, site),
            _height_rows(geometry, heights),
            [*([_heading("Notes")] if notes else []), *(_small(note[:1].upper() + note[1:]) for note in notes)],
        )
        self._groups: list[list[_Row]] = []  # rows that stay in one column
        for rows in filter(None, sections):
            together = len(rows) if len(rows) <= MOST_TOGETHER else 2  # a heading and the row below it
            self._groups += [rows[:together], *([row] for row in rows[together:])]
        whole = sum(row.height for group in self._groups for row in group)
        self.height = max(*(_height(group) for group in self._groups), whole / COLUMNS)
        while len({column for _, column, _ in self._places()}) > COLUMNS:
            self.height += HEIGHT_STEP

    def draw(self, axes: Axes) -> None:
        """Draw all rows into axes of the legend's width and height."""
        axes.axis("off")
        axes.set(xlim=(0.0, MAP_WIDTH), ylim=(self.height, 0.0))
        for row, column, y in self._places():
            row.draw(axes, column * (COLUMN + COLUMN_GAP), y)

    def _places(self) -> Iterator[tuple[_Row, int, float]]:
        """Yield each row with its column, and the distance of its first line from the top."""
        column, y = 0, 0.0
        for group in self._groups:
            if y > 0.0 and y + _height(group) > self.height + 1e-9:
                column, y = column + 1, 0.0
            for row in group:
                yield row, column, y + 0.12
                y += row.height


def _height(rows: Sequence[_Row]) -> float:
    return sum(row.height for row in reversed(rows))


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
    return [_heading("Sensors", "sees of the road"), *rows[:-1], _spaced(rows[-1])] if rows else []


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
    return [_heading("Map"), *rows[:-1], _spaced(rows[-1])]


def _height_rows(geometry: SceneGeometry, heights: Normalize) -> list[_Row]:
    highest = float(heights.vmax or 0.0)
    ticks = tuple(
        (2.2 * share, 0.22, f"{highest * share:g}{unit}", {"ha": align, "size": SMALL})
        for share, align, unit in ((0.0, "left", ""), (0.5, "center", ""), (1.0, "right", " m"))
    )
    rows = [_heading("Obstacles", "height above the road"), _Row(ticks, 0.44, partial(_ramp, heights))]
    if any(mesh.height_assumed for mesh in geometry.occluders):
        rows.append(_line("height assumed", partial(_swatch, ASSUMED_HEIGHT)))
    return [*rows[:-1], _spaced(rows[-1])]


def _heading(words: str, aside: str = "") -> _Row:
    lines = wrapped(words, COLUMN, HEADING_SIZE, "bold")
    below = (len(lines) - 1) * LINE

    def rule(axes: Axes, x: float, y: float) -> None:
        axes.plot((x, x + COLUMN), (y + below + 0.14,) * 2, color=SOFT_INK, linewidth=0.6)

    texts = [(0.0, n * LINE, line, BOLD | {"size": HEADING_SIZE}) for n, line in enumerate(lines)]
    return _Row((*texts, (np.inf, 0.0, aside, ASIDE)), HEADING_LINE + below, rule)


def _line(words: str, sign: Sign, share: str = "") -> _Row:
    """Return a row with a sign on the left, words, and a share on the right."""
    lines = wrapped(words, COLUMN - TEXT_X - (SHARE_ROOM if share else 0.0), SIZE)
    texts: list[tuple[float, float, str, Style]] = [(TEXT_X, n * LINE, line, {}) for n, line in enumerate(lines)]
    return _Row((*texts, (np.inf, 0.0, share, BOLD)), len(lines) * LINE, sign)


def _small(words: str) -> _Row:
    lines = wrapped(words, COLUMN, SMALL)
    texts = tuple((0.0, n * SMALL_LINE, line, ASIDE) for n, line in enumerate(lines))
    return _Row(texts, len(lines) * SMALL_LINE + AFTER)


def _spaced(row: _Row) -> _Row:
    """Return the last row of a section, with the room below it."""
    return replace(row, height=row.height + AFTER)


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
