"""Close-ups of each sensor on the plan and in the rendered view."""

from __future__ import annotations

import io
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from ...arrays import Float
from ...choosing.placement.deployment import Deployment, Sensor
from ...site.scene_geometry import SceneGeometry
from ...site.site import Site
from ...storage.files import whole_file
from .drawing import (
    MARK_RADIUS,
    SENSOR_MARK,
    Style,
    Window,
    add_axes,
    as_png,
    draw_attribution,
    draw_callouts,
    draw_corners,
    markers_of,
    new_page,
)
from .palette import INK, PAPER
from .plan_map import SENSOR, MapContent, draw_map, draw_street_names, map_content

TILE = (640, 480)
"""Width and height of a close-up, pixels."""
MOST = 60
"""Largest number of sensors on a sheet: readers refuse larger pictures."""
DPI = 160
SIZE = (TILE[0] / DPI, TILE[1] / DPI)  # of a close-up, inches
REACH = 20.0  # metres from the sensor to the left and right border of its plan
VIEW_REACH = 9.0  # metres around the sensor that its view shows
SLOPES = np.array((0.52, 0.39))  # tangents of half the field of view
ELEVATIONS = np.radians((24.0, 38.0, 55.0, 75.0))
TURNS = np.radians((0.0, 30.0, -30.0, 60.0, -60.0, 100.0, -100.0, 150.0))
"""Directions tried for the camera: height above the horizon, and from that of the road."""


def viewpoints(site: Site, sensor: Sensor) -> list[Viewpoint]:
    """Return camera positions for a close-up of a sensor, the best first: from over the road, rather low."""
    nearest = site.targets.xyz[np.argmin(np.hypot(*(site.targets.xyz - sensor.xyz)[:, :2].T))]
    away = nearest[:2] - sensor.foot[:2]
    towards = float(np.arctan2(away[1], away[0]))
    ring = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    ground = sensor.foot + VIEW_REACH * np.column_stack((np.cos(ring), np.sin(ring), np.zeros(12)))
    points = np.vstack((ground, sensor.foot, sensor.xyz + np.array((0.0, 0.0, 1.0))))
    return [frame(points, towards + turn, elevation, SLOPES) for elevation in ELEVATIONS for turn in TURNS]


def draw_plans(geometry: SceneGeometry, site: Site, deployment: Deployment) -> list[Image.Image]:
    """Return the plan of each sensor's surroundings, of the size `TILE`, for at most `MOST` sensors."""
    content = map_content(geometry, site, deployment, site.region.buffer(REACH).bounds)
    return [_plan(content, sensor) for sensor in deployment.sensors[:MOST]]


def save_close_ups(
    path: str | os.PathLike[str],
    plans: Sequence[Image.Image],
    views: Sequence[Image.Image],
    places: Mapping[str, tuple[float, float]],
    attribution: Sequence[str],
) -> None:
    """Write a sheet with the plan and the view of each sensor's surroundings, as PNG; without views only the plans.

    Parameters
    ----------
    plans, views : sequence of Image
        Of the size `TILE`, in the order of the sensors. No file is written without sensors.
    places : mapping of str to (float, float)
        Position of each sensor on its view, by its label and in the same order, in shares of width and height from the
        lower left.
    """
    if not plans:
        return
    rows = [[plan] for plan in plans]
    for row, view, (label, place) in zip(rows, views, places.items(), strict=False):
        row.append(_labelled(view, label, place, attribution))
    with whole_file(path) as temporary:
        close_up_sheet(rows).save(temporary, format="PNG")


def _plan(content: MapContent, sensor: Sensor) -> Image.Image:
    """Return the plan of a sensor's surroundings."""
    width, height = SIZE
    x, y = sensor.xyz[:2].tolist()
    up = REACH * height / width
    window = (x - REACH, y - up, x + REACH, y + up)
    figure = new_page(SIZE, DPI)
    axes = add_axes(figure, 0.0, 0.0, width, height, window)
    draw_map(axes, content, window, width)
    taken = draw_corners(axes, content.site.attribution, longest=1.0, north=False)
    points = np.array([one.xyz[:2] for one in content.deployment.sensors])
    marks = [(*(point - 1.5), *(point + 1.5)) for point in points]
    names = draw_street_names(axes, content.geometry, window, width, [*taken, *marks])
    _mark(axes, content, sensor, window, [*taken, *names])
    return _drawn(figure)


def _mark(axes: Axes, content: MapContent, sensor: Sensor, window: Window, taken: Sequence[Window]) -> None:
    """Mark and label the sensor of a close-up and its neighbours."""
    box = shapely.box(*window)
    shown = [one for one in content.deployment.sensors if box.contains(shapely.Point(one.xyz[:2]))]
    points = np.array([one.xyz[:2] for one in shown])
    draw_callouts(axes, points, [one.label for one in shown], points, SENSOR - 0.5, taken)
    markers = markers_of(content.deployment)
    for one in shown:
        style = SENSOR_MARK | {"markersize": SENSOR_MARK["markersize"] * (1.25 if one is sensor else 0.8)}
        axes.plot(*one.xyz[:2], marker=markers[one.model.key], zorder=SENSOR, **style)


def _labelled(view: Image.Image, label: str, place: tuple[float, float], attribution: Sequence[str]) -> Image.Image:
    """Return a rendered close-up with a ring round the sensor and its label."""
    width, height = SIZE
    figure = new_page(SIZE, DPI)
    axes = add_axes(figure, 0.0, 0.0, width, height)
    axes.axis("off")
    paper = Image.new("RGB", TILE, "#e9edf0")
    paper.paste(view, mask=view.getchannel("A") if view.mode == "RGBA" else None)
    axes.imshow(np.asarray(paper), extent=(0.0, width, 0.0, height), interpolation="nearest", aspect="auto")
    axes.set(xlim=(0.0, width), ylim=(0.0, height))
    point = np.array(place) * (width, height)
    draw_callouts(axes, point[None], [label], point[None], 2.0)
    ring: Style = {"marker": "o", "mfc": "none", "markersize": 2.6 * MARK_RADIUS, "linestyle": "none"}
    axes.plot(*point, mec=PAPER, mew=4.0, zorder=3.0, **ring)
    axes.plot(*point, mec=INK, mew=2.0, zorder=3.1, **ring)
    draw_attribution(axes, attribution)
    return _drawn(figure)


def _drawn(figure: Figure) -> Image.Image:
    with Image.open(io.BytesIO(as_png(figure))) as drawn:
        return drawn.convert("RGB")


def close_up_sheet(rows: Sequence[Sequence[Image.Image]]) -> Image.Image:
    """Return a sheet of close-ups, each of the size `TILE`, the same number in each row."""
    sheet = Image.new("RGB", (len(rows[0]) * TILE[0], len(rows) * TILE[1]), PAPER)
    for number, row in enumerate(rows):
        for column, picture in enumerate(row):
            sheet.paste(picture, (column * TILE[0], number * TILE[1]))
    return sheet.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)


def close_ups(sheet: bytes, count: int) -> list[tuple[bytes, ...]]:
    """Return the pictures of each sensor on a sheet, as PNG: its plan, and its view if the sheet has views.

    Raises
    ------
    ValueError
        The sheet is not one of ``count`` sensors.
    """
    with Image.open(io.BytesIO(sheet), formats=("PNG",)) as picture:
        across, rows = picture.width // TILE[0], min(count, MOST)
        if picture.size != (across * TILE[0], rows * TILE[1]) or across not in {1, 2}:
            raise ValueError(f"a sheet of {picture.width} by {picture.height} pixels, not of {count} sensors")
        tiles = []
        for row in range(rows):
            corners = [(column * TILE[0], row * TILE[1]) for column in range(across)]
            contents = [io.BytesIO() for _ in corners]
            for (left, top), content in zip(corners, contents, strict=True):
                picture.crop((left, top, left + TILE[0], top + TILE[1])).save(content, format="PNG")
            tiles.append(tuple(content.getvalue() for content in contents))
        return tiles


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """A perspective camera at a place (3,), metres.

    The columns of ``axes`` (3, 3) are right, up and backwards, orthonormal; ``slopes`` (2,) are the tangents of half
    the field of view, across and upwards.
    """

    place: Float
    axes: Float
    slopes: Float

    def project(self, points: Float) -> Float:
        """Return the positions of points (n, 3) on the picture, (n, 2) in shares of its size from the lower left."""
        seen = (points - self.place) @ self.axes
        return 0.5 + seen[:, :2] / (-2.0 * seen[:, 2:] * self.slopes)


def frame(points: Float, azimuth: float, elevation: float, slopes: Float) -> Viewpoint:
    r"""Return the nearest viewpoint in a direction that has all points in its picture.

    With right, up and backwards coordinates :math:`r, u, b` of a point and :math:`c_r, c_u, c_b` of the camera, the
    point is in the picture when :math:`|r - c_r| \le s_r (c_b - b)` and the same for :math:`u`. The largest :math:`r +
    s_r b` and :math:`-r + s_r b` over all points therefore give :math:`c_r` and the least :math:`c_b` directly; the
    larger of the two :math:`c_b` is taken.

    Parameters
    ----------
    points : (n, 3) float64, metres
    azimuth, elevation : float, radians
        Direction from the points to the camera; azimuth counter-clockwise from +x.
    """
    level, rise = math.cos(elevation), math.sin(elevation)
    back = np.array((level * math.cos(azimuth), level * math.sin(azimuth), rise))
    right = np.array((-math.sin(azimuth), math.cos(azimuth), 0.0))
    axes = np.column_stack((right, np.cross(back, right), back))
    seen = points @ axes
    high = (seen[:, :2] + slopes * seen[:, 2:]).max(axis=0)
    low = (-seen[:, :2] + slopes * seen[:, 2:]).max(axis=0)
    place = axes @ np.append((high - low) / 2.0, ((high + low) / (2.0 * slopes)).max())
    return Viewpoint(place, axes, slopes)
