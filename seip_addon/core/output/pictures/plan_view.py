"""Plan view of a placement with scale, north, candidates and coverage, and insets where sensors are close."""

import os
from collections.abc import Sequence
from functools import partial

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from shapely.geometry.base import BaseGeometry

from ...arrays import Float, Integer
from ...choosing.placement.deployment import Deployment
from ...site.scene_geometry import SceneGeometry
from ...site.site import Site
from .drawing import (
    SENSOR_MARK,
    add_axes,
    credits_box,
    credits_of,
    draw_attribution,
    draw_callouts,
    draw_sensors,
    heading_of,
    markers_of,
    new_page,
    save_png,
)
from .palette import INK, PAPER
from .plan_legend import PlanLegend
from .plan_map import (
    SENSOR,
    TEXT,
    MapContent,
    Window,
    draw_map,
    draw_street_names,
    map_content,
    mark_boxes,
    overlap,
)
from .plan_style import Style
from .scale_bar import draw_north, draw_scale, north_paper, scale_paper

DPI = 160
MARGIN = 0.3  # inches
MAP_WIDTH = 9.6  # inches: a page of A4 shows type at 0.7 of its size
MIN_MAP_HEIGHT, MAX_MAP_HEIGHT = 5.2, 10.0  # inches
MARGIN_SHARE = 0.06  # of the region's size, shown around it
MIN_MARGIN = 3.0  # metres, likewise
ROOMS = (1.0, 1.03, 1.06, 1.1, 1.15, 1.2, 1.3, 1.4)  # by which more is shown until no corner's writing hides the region
CLOSE = 0.2  # inches between two sensors from which on their marks do not touch
INSET_SIDE, MAX_INSETS = 2.3, 3  # inches, number
MIN_INSET_SIDE = 12.0  # metres
DISTANCE_COST = 0.01  # of an inch from what an inset enlarges, where hiding all of the road would cost 1
INSET_STEPS = 14  # places tried for an inset along each side of the map


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
    foot = legend.height + 2 * MARGIN
    plan = add_axes(figure, MARGIN, foot, MAP_WIDTH, map_height)
    draw_map(plan, content, window, MAP_WIDTH)
    inch = (window[2] - window[0]) / MAP_WIDTH
    draw_scale(plan, inch)
    draw_north(plan, inch)
    credit = credits_of(site, created)
    draw_attribution(plan, credit)
    taken = [_corners(*paper) for paper in _papers(window)]
    taken += [credits_box(plan, credit)] if credit else []
    insets = _insets(sensors, site.targets.xyz[:, :2], window, inch, taken)
    taken += [box for _, box in insets]
    names = draw_street_names(plan, geometry, window, MAP_WIDTH, [*taken, *mark_boxes(sensors, inch)])
    draw_sensors(
        plan,
        deployment,
        sensors,
        site.targets.xyz[:, :2],
        zorder=SENSOR,
        taken=np.array([*taken, *names]).reshape(-1, 4),
    )
    for letter, (part, box) in zip("ABC", insets, strict=False):
        _draw_inset(figure, plan, content, letter, part, box, foot)
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


def _insets(
    sensors: Float, road: Float, window: Window, inch: float, taken: Sequence[Window]
) -> list[tuple[Window, Window]]:
    """Return the part of the map that each inset enlarges, and where on the map the inset is.

    An inset shows sensors whose marks touch on the map. It is where it hides least of the road (t, 2), and left out
    where it would hide sensors or another inset.
    """
    found: list[tuple[Window, Window]] = []
    for group in _groups(sensors, CLOSE * inch)[:MAX_INSETS]:
        middle = (group.min(axis=0) + group.max(axis=0)) / 2
        half = max(MIN_INSET_SIDE / 2, 0.75 * float(np.ptp(group, axis=0).max()))
        if 2 * half >= INSET_SIDE * inch:  # would not enlarge anything
            continue
        part = (*(middle - half), *(middle + half))
        side = INSET_SIDE * inch
        others = [*taken, part, *(box for _, box in found)]
        places = _inset_places(window, side, inch)
        free = [box for box in places if not any(overlap(box, other) for other in others)]
        free = [box for box in free if not _inside(sensors, box).any()]
        if free:
            found.append((part, min(free, key=partial(_inset_cost, middle, road, inch))))
    return found


def _inset_cost(middle: Float, road: Float, inch: float, box: Window) -> float:
    """Return the cost of an inset's place: the share of the road (t, 2) that it hides, and its distance."""
    away = float(np.hypot(*(np.array(box).reshape(2, 2).mean(axis=0) - middle))) / inch
    return float(_inside(road, box).mean()) + DISTANCE_COST * away


def _groups(points: Float, reach: float) -> list[Float]:
    """Return groups of two points or more (k, 2) that are connected by steps of at most a reach, largest first."""
    near = np.hypot(*np.moveaxis(points[:, None] - points[None], 2, 0)) <= reach
    label = np.arange(len(points))
    for _ in points:
        label = np.where(near, label[None], len(points)).min(axis=1, initial=len(points))
    groups = [points[label == one] for one in np.unique(label)]
    return sorted((group for group in groups if len(group) > 1), key=lambda group: -len(group))


def _inset_places(window: Window, side: float, inch: float) -> list[Window]:
    """Return squares of a side in metres along the borders of a map."""
    gap = 0.12 * inch
    low = np.array(window[:2]) + gap
    high = np.array(window[2:]) - gap - side
    across, upwards = (np.linspace(a, b, INSET_STEPS) for a, b in zip(low, high, strict=True))
    edges = [(x, y) for x in across for y in (low[1], high[1])] + [(x, y) for y in upwards for x in (low[0], high[0])]
    return [(float(x), float(y), float(x) + side, float(y) + side) for x, y in edges]


def _inside(points: Float, box: Window) -> Integer:
    inside: Integer = np.all((points > box[:2]) & (points < box[2:]), axis=1)
    return inside


def _draw_inset(  # noqa: PLR0913, PLR0917  # what it shows, and where
    figure: Figure, plan: Axes, content: MapContent, letter: str, part: Window, box: Window, foot: float
) -> None:
    """Draw a part of the map enlarged, with the labels of its sensors, and frame that part on the map."""
    inch = (plan.get_xlim()[1] - plan.get_xlim()[0]) / MAP_WIDTH
    left = MARGIN + (box[0] - plan.get_xlim()[0]) / inch
    bottom = foot + (box[1] - plan.get_ylim()[0]) / inch
    inset = add_axes(figure, left, bottom, INSET_SIDE, INSET_SIDE)
    draw_map(inset, content, part, INSET_SIDE)
    inset.spines[:].set(color=INK, linewidth=1.4)
    draw_scale(inset, (part[2] - part[0]) / INSET_SIDE, 0.5)
    shown = [sensor for sensor in content.deployment.sensors if _inside(sensor.xyz[None, :2], part).any()]
    points = np.array([sensor.xyz[:2] for sensor in shown])
    draw_callouts(inset, points, [sensor.label for sensor in shown], points, SENSOR - 0.5)
    markers = markers_of(content.deployment)
    for sensor in shown:
        inset.plot(*sensor.xyz[:2], marker=markers[sensor.model.key], zorder=SENSOR, **SENSOR_MARK)
    style: Style = {"size": 11, "weight": "bold", "color": PAPER, "zorder": TEXT + 2}
    tab: Style = {"boxstyle": "square,pad=0.25", "facecolor": INK, "edgecolor": "none"}
    inset.text(0.03, 0.97, letter, ha="left", va="top", transform=inset.transAxes, bbox=tab, **style)
    frame: Style = {"facecolor": "none", "edgecolor": INK, "linewidth": 1.2, "zorder": TEXT}
    plan.add_patch(Rectangle(part[:2], part[2] - part[0], part[3] - part[1], **frame))
    plan.text(part[0], part[3], letter, ha="right", va="top", bbox=tab, **style | {"size": 9})
