"""Close-ups of each sensor on the plan and in the rendered view."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

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
from .viewpoint import MOST, TILE

DPI = 160
SIZE = (TILE[0] / DPI, TILE[1] / DPI)  # of a close-up, inches
REACH = 20.0  # metres from the sensor to the left and right border of its plan


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
