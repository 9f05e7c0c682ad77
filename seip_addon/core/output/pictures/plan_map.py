"""The map of a plan: surfaces, coverage, obstacles, areas, candidates and names of streets."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.patches import PathPatch, Wedge
from matplotlib.path import Path
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...choosing.placement.deployment import Deployment
from ...geometry.plan import closed, outline
from ...site.scene_geometry import ASSUMED, OTHER_LEVELS, Mesh, SceneGeometry
from ...site.site import Site
from ...site.targets import target_squares
from .colours import of_placement
from .drawing import MARK_RADIUS, Style, Window, draw_polygons, is_writable, text_width
from .palette import ASSUMED_POLE_COLOUR, FORBIDDEN, INK, MANDATORY, PAPER, POLE_COLOUR, WEIGHTED

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


@dataclass(frozen=True, eq=False)
class MapContent:
    """Content of a plan.

    Parameters
    ----------
    heights : Normalize
        Scale of the obstacles' colours, metres above the road.
    """

    geometry: SceneGeometry
    site: Site
    deployment: Deployment
    heights: Normalize


def map_content(geometry: SceneGeometry, site: Site, deployment: Deployment, window: Window) -> MapContent:
    """Return the content of a plan, with the scale of the obstacles' heights within a window."""
    triangles = _obstacles(geometry.occluders, shapely.box(*window))
    height = _above_road(site, triangles).max(initial=0.0)
    return MapContent(geometry, site, deployment, Normalize(0.0, 5.0 * math.ceil(max(10.0, height) / 5.0)))


def draw_map(axes: Axes, content: MapContent, window: Window, width: float) -> None:
    """Draw the part of the plane in a window, without sensors; the axes are ``width`` inches wide."""
    geometry, site = content.geometry, content.site
    axes.set(facecolor=LAND)
    shown = shapely.box(*window)
    _draw_surfaces(axes, geometry, shown)
    shown_as = of_placement(content.deployment)
    colours, squares = np.array(shown_as.colours)[shown_as.of], target_squares(site.targets)[:, :, :2]
    draw_polygons(axes, squares, facecolors=colours, edgecolors="none", antialiaseds=False, zorder=TARGET)
    _draw_obstacles(axes, content, shown)
    _draw_areas(axes, geometry, site.region)
    _draw_candidates(axes, geometry, site)
    _draw_headings(axes, content.deployment, (window[2] - window[0]) / width)


def draw_street_names(
    axes: Axes, geometry: SceneGeometry, window: Window, width: float, taken: Sequence[Window] = ()
) -> list[Window]:
    """Write the names of streets along them where they fit, off boxes that are taken, and return their own boxes.

    Names with letters that the type lacks are left out.
    """
    inch = (window[2] - window[0]) / width
    boxes: list[Window] = []
    for place in geometry.places:
        if place.crossing or not is_writable(place.name):
            continue
        parts = [part for part in shapely.get_parts(place.polygon) if part.area > 0]
        cuts = [shapely.get_parts(shapely.intersection(part, shapely.box(*window))) for part in parts]
        inside = [max(cut, key=lambda one: float(one.area), default=shapely.Polygon()) for cut in cuts]
        whole, shown = max(zip(parts, inside, strict=True), key=lambda both: float(both[1].area), default=(None, None))
        if whole is None or shown is None or shown.is_empty:
            continue
        along = _direction(whole)
        reach = shapely.get_coordinates(shown) @ along
        middle = np.array(shown.centroid.coords[0])
        length = text_width(place.name, NAME_SIZE) * inch
        spare = (float(np.ptp(reach)) - MIN_NAME_ROOM * length) / 2
        half = np.abs(along) * length / 2 + NAME_SIZE / 72 * inch * 0.7
        tried = [middle + share * max(spare, 0.0) * along for share in NAME_SHIFTS]
        free = [at for at in tried if not any(_overlap((*(at - half), *(at + half)), box) for box in (*taken, *boxes))]
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


def _overlap(one: Window, other: Window) -> bool:
    """Return whether two boxes overlap, each given by left, bottom, right and top."""
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def mark_boxes(sensors: Float, inch: float) -> list[Window]:
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


def _draw_obstacles(plan: Axes, content: MapContent, shown: BaseGeometry) -> None:
    """Draw obstacles, darker the higher they are."""
    occluders = content.geometry.occluders
    triangles = _obstacles(occluders, shown)
    colours = HEIGHT_CMAP(content.heights(_above_road(content.site, triangles)))
    style = {"facecolors": colours, "edgecolors": "none", "antialiaseds": False}
    # Below the coverage: what a tree or a bridge covers of the studied road is seen through it, under its outline.
    draw_polygons(plan, triangles[:, :, :2], **style, zorder=TARGET - 0.5)
    draw_area(plan, outline(triangles), facecolor="none", edgecolor="#3d4542", linewidth=0.5, zorder=OBSTACLE)
    for mesh in occluders:
        if mesh.height_assumed:
            draw_area(plan, _footprint(mesh, shown), **ASSUMED_HEIGHT, zorder=OBSTACLE)


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
