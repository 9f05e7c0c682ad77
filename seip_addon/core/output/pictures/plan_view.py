"""Plan view of a placement with scale, north, candidates and coverage."""

import math
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Rectangle, Wedge
from matplotlib.path import Path
from shapely.geometry.base import BaseGeometry

from ...arrays import Float
from ...choosing.placement.deployment import Deployment
from ...geometry.plan import closed, outline
from ...site.scene_geometry import ASSUMED, OTHER_LEVELS, Mesh, SceneGeometry
from ...site.site import Site
from ...site.target_squares import target_squares
from .coverage_colours import of_placement
from .drawing import add_axes, draw_attribution, draw_polygons, draw_sensors, draw_title, save_png
from .palette import FORBIDDEN, INK, MANDATORY, PAPER, SOFT_INK, WEIGHTED
from .plan_legend import PlanLegend
from .plan_style import (
    ASSUMED_HEIGHT,
    ASSUMED_MARK,
    HEIGHT_CMAP,
    OTHER_ROAD,
    POLE_MARK,
    SIDEWALK_MARK,
    Style,
)

DPI = 160
MARGIN, HEAD = 0.3, 0.95  # inches
ARROW_LENGTH, WEDGE_LENGTH = 0.34, 0.5  # inches
MIN_MAP_WIDTH, MAX_MAP_WIDTH = 9.6, 15.0  # inches
MIN_MAP_HEIGHT, MAX_MAP_HEIGHT = 6.6, 10.5  # inches
MARGIN_SHARE = 0.06  # of the region's size, shown around it
ROOMS = (1.0, 1.03, 1.06, 1.1, 1.15, 1.2, 1.3, 1.4)  # by which more is shown until no corner's writing hides the region
Window = tuple[float, float, float, float]

LAND, PAVEMENT, ROAD, KERB = "#eaece6", "#d9d5cc", "#b9bcc0", "#8f949a"
MAX_GAP = 0.06  # metres
MIN_PLAN_AREA = 1e-6  # square metres in plan, below which a triangle is a wall's

SURFACE, EDGE, TARGET, OBSTACLE, BORDER, CANDIDATE, TEXT, SENSOR = range(8)


def save_plan_view(
    path: str | os.PathLike[str], geometry: SceneGeometry, site: Site, deployment: Deployment, notes: Sequence[str] = ()
) -> None:
    """Draw the site with its candidates, the chosen sensors and what they see, as PNG.

    The same arguments give the same bytes.

    Parameters
    ----------
    notes : sequence of str
        Notes for the reader of the plan, one sentence each.
    """
    figure = draw_plan(geometry, site, deployment, notes)
    save_png(path, figure)


def draw_plan(geometry: SceneGeometry, site: Site, deployment: Deployment, notes: Sequence[str] = ()) -> Figure:
    """Return the plan as a figure."""
    map_width, map_height = _map_size(site.region)
    window = _window(site.region, map_width, map_height)
    trial = PlanLegend(Figure().add_axes((0.0, 0.0, 1.0, 1.0)), map_height)
    trial.draw(geometry, site, deployment, Normalize(0.0, 1.0), notes)  # its width decides the page's
    figure = Figure((map_width + trial.width + 3 * MARGIN, map_height + HEAD + MARGIN), dpi=DPI, facecolor=PAPER)
    FigureCanvasAgg(figure)  # measures text
    plan = add_axes(figure, MARGIN, MARGIN, map_width, map_height)
    plan.spines[:].set(color=SOFT_INK, linewidth=0.8)
    plan.set(xlim=(window[0], window[2]), ylim=(window[1], window[3]), facecolor=LAND)
    shown = shapely.box(*window)

    _draw_surfaces(plan, geometry, shown)
    _draw_targets(plan, site, deployment)
    norm = _draw_obstacles(plan, geometry.occluders, site, shown)
    _draw_areas(plan, geometry, site.region)
    _draw_candidates(plan, geometry, site)
    sensors = np.array([sensor.xyz[:2] for sensor in deployment.sensors]).reshape(-1, 2)
    draw_sensors(plan, deployment, sensors, site.targets.xyz[:, :2], zorder=SENSOR)
    inch = (window[2] - window[0]) / map_width
    _draw_headings(plan, deployment, inch)
    draw_scale(plan, inch)
    _draw_north(plan, inch)
    draw_attribution(plan, site.attribution)
    draw_title(figure, site, deployment, MARGIN)
    panel = add_axes(figure, map_width + 2 * MARGIN, MARGIN, trial.width, map_height)
    PlanLegend(panel, map_height).draw(geometry, site, deployment, norm, notes)
    return figure


def _map_size(region: BaseGeometry) -> tuple[float, float]:
    """Return width and height of the map on the page in inches, as near to the region's shape as fits."""
    _, _, width, height = _bounds(region)
    map_height = min(max(MIN_MAP_WIDTH * height / width, MIN_MAP_HEIGHT), MAX_MAP_HEIGHT)
    return min(max(map_height * width / height, MIN_MAP_WIDTH), MAX_MAP_WIDTH), map_height


def _window(region: BaseGeometry, map_width: float, map_height: float) -> Window:
    """Return the part of the plane to show: the region with a margin, on a map of given size in inches.

    The margin is larger where the scale or the north arrow would hide part of the region.
    """
    x, y, width, height = _bounds(region)
    shape = map_height / map_width
    width, height = max(width, height / shape), max(height, width * shape)
    windows = [
        (x - room * width / 2, y - room * height / 2, x + room * width / 2, y + room * height / 2) for room in ROOMS
    ]
    return next((one for one in windows if not region.intersects(_papers(one, map_width))), windows[0])


def _papers(window: Window, map_width: float) -> BaseGeometry:
    """Return where scale and north arrow lie on a map of a width in inches."""
    left, bottom, right, top = window
    inch = (right - left) / map_width
    scale, north = _scale_paper(left, bottom, inch), _north_paper(right, top, inch)
    return shapely.union_all([shapely.box(x, y, x + width, y + height) for x, y, width, height in (scale, north)])


def _bounds(region: BaseGeometry) -> tuple[float, float, float, float]:
    """Return the middle, width and height of the region with some room around it."""
    left, bottom, right, top = region.bounds
    around = 2 * MARGIN_SHARE * max(right - left, top - bottom)
    return (left + right) / 2, (bottom + top) / 2, right - left + around, top - bottom + around


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


def _draw_targets(plan: Axes, site: Site, deployment: Deployment) -> None:
    shown = of_placement(deployment)
    colours = np.array(shown.colours)[shown.of]
    squares = target_squares(site.targets)[:, :, :2]
    draw_polygons(plan, squares, facecolors=colours, edgecolors="none", antialiaseds=False, zorder=TARGET)


def _draw_obstacles(plan: Axes, occluders: Sequence[Mesh], site: Site, shown: BaseGeometry) -> Normalize:
    """Draw obstacles, darker the higher they are, and return the scale of heights."""
    triangles = np.concatenate([np.empty((0, 3, 3)), *(mesh.triangles for mesh in occluders)])
    flat = shapely.polygons(triangles[:, :, :2])
    drawn = (shapely.area(flat) > MIN_PLAN_AREA) & shapely.intersects(flat, shown)
    triangles, flat = triangles[drawn], flat[drawn]
    height = triangles[:, :, 2].max(axis=1) - _road_level(site, triangles.mean(axis=1))
    norm = Normalize(0.0, 5.0 * math.ceil(max(10.0, height.max(initial=0.0)) / 5.0))
    order = np.argsort(triangles[:, :, 2].max(axis=1), kind="stable")
    style = {"facecolors": HEIGHT_CMAP(norm(height[order])), "edgecolors": "none", "antialiaseds": False}
    draw_polygons(plan, triangles[order, :, :2], **style, zorder=OBSTACLE)
    draw_area(plan, outline(triangles), facecolor="none", edgecolor="#3d4542", linewidth=0.5, zorder=OBSTACLE)
    for mesh in occluders:
        if mesh.height_assumed:
            draw_area(plan, _footprint(mesh, shown), **ASSUMED_HEIGHT, zorder=OBSTACLE)
    return norm


def _road_level(site: Site, points: Float) -> Float:
    """Return the height of the road at the target next to each point."""
    targets = site.targets.xyz
    nearest = shapely.STRtree(shapely.points(targets[:, :2])).nearest(shapely.points(points[:, :2]))
    level: Float = targets[nearest, 2]
    return level


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


def draw_area(plan: Axes, area: BaseGeometry, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
    """Draw a polygon with its holes, or several."""
    polygons = [part for part in shapely.get_parts(area) if part.geom_type == "Polygon" and not part.is_empty]
    rings = [ring for part in polygons for ring in (part.exterior, *part.interiors)]
    if rings:
        path = Path.make_compound_path(*(Path(np.asarray(ring.coords)[:, :2], closed=True) for ring in rings))
        plan.add_patch(PathPatch(path, **style))


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


def draw_scale(plan: Axes, inch: float) -> None:
    """Draw a scale bar of a round length, at most two inches long; ``inch`` is an inch of the plan in metres."""
    length = _scale_length(inch)
    left, bottom = plan.get_xlim()[0] + 0.25 * inch, plan.get_ylim()[0] + 0.25 * inch
    _draw_paper(plan, *_scale_paper(plan.get_xlim()[0], plan.get_ylim()[0], inch))
    for part in range(4):
        style: Style = {"facecolor": INK if part % 2 == 0 else PAPER, "edgecolor": INK, "linewidth": 0.7}
        plan.add_patch(Rectangle((left + part * length / 4, bottom), length / 4, 0.08 * inch, zorder=TEXT, **style))
    for at, words in ((0.0, "0"), (length / 2, f"{length / 2:g}"), (length, f"{length:g} m")):
        plan.text(left + at, bottom + 0.13 * inch, words, ha="center", va="bottom", size=8, color=INK, zorder=TEXT)


def _scale_length(inch: float) -> float:
    """Return the largest round length, metres, of at most two inches of the plan."""
    decade = 10.0 ** math.floor(math.log10(2 * inch))
    return max(step * decade for step in (1, 2, 5) if step * decade <= 2 * inch)


def _scale_paper(left: float, bottom: float, inch: float) -> tuple[float, float, float, float]:
    """Return left, bottom, width and height of what the scale is drawn on, in the map's lower left corner."""
    return left + 0.12 * inch, bottom + 0.13 * inch, _scale_length(inch) + 0.45 * inch, 0.52 * inch


def _north_paper(right: float, top: float, inch: float) -> tuple[float, float, float, float]:
    """Return left, bottom, width and height of what the north arrow is drawn on, in the map's upper right corner."""
    return right - 0.62 * inch, top - 0.92 * inch, 0.48 * inch, 0.8 * inch


def _draw_paper(plan: Axes, left: float, bottom: float, width: float, height: float) -> None:
    style: Style = {"facecolor": PAPER, "alpha": 0.9, "edgecolor": "none", "zorder": TEXT}
    plan.add_patch(Rectangle((left, bottom), width, height, **style))


def _draw_north(plan: Axes, inch: float) -> None:
    """Draw an arrow along +y, which is north in map coordinates."""
    right, top = plan.get_xlim()[1], plan.get_ylim()[1]
    x, y = right - 0.38 * inch, top - 0.82 * inch
    _draw_paper(plan, *_north_paper(right, top, inch))
    arrow = np.array([(0.0, 0.42), (0.12, 0.0), (0.0, 0.09), (-0.12, 0.0)]) * inch + (x, y)
    plan.fill(arrow[:, 0], arrow[:, 1], facecolor=INK, edgecolor="none", zorder=TEXT)
    plan.text(x, y + 0.46 * inch, "N", ha="center", va="bottom", size=9, weight="bold", color=INK, zorder=TEXT)
