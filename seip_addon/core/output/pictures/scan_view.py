"""A bird's-eye view of a frame of scans: which sensor measured what, and how strong the returns are."""

import os
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from ...base.counts import counted
from ...sensing.scans.frame import Frame, Labels
from ...sensing.scans.sensor import MountedSensor
from .drawing import (
    LABEL_SIZE,
    SENSOR_MARK,
    Style,
    add_axes,
    box_corners,
    draw_area,
    draw_corners,
    draw_polygons,
    new_page,
    plain_legend,
    save_png,
    window_around,
)
from .palette import (
    INK,
    MAX_INTENSITY,
    PAPER,
    SEEN_COLOURS,
    SOFT_INK,
    By,
    cloud_colours,
    sensor_colour,
    strength_ramp,
)

DPI = 160
MAP_SIDE, MARGIN, HEAD, FOOT = 8.0, 0.3, 0.95, 0.55  # inches
MARGIN_SHARE = 0.04  # of the region's size, shown around it
PIXELS = 1100  # of a cloud's picture, along a side
BACKGROUND_COLOUR = "#101820"
SEEN_COLOUR, UNSEEN_COLOUR = PAPER, SEEN_COLOURS[0]


def save_scan_view(
    path: str | os.PathLike[str],
    frame: Frame,
    region: BaseGeometry,
    sensors: Sequence[MountedSensor],
    attribution: Sequence[str] = (),
) -> None:
    """Draw a frame twice, its points coloured by sensor and by intensity, with the boxes of its road users, as PNG.

    Parameters
    ----------
    region : shapely geometry
        Region of interest in plan; the picture shows this and a little around it.
    sensors : sequence of MountedSensor
        In the order of the frame's numbers.
    attribution : sequence of str
        Credits that the sources of the scene demand.
    """
    west, south, east, north = region.bounds
    window = window_around(region.bounds, MARGIN_SHARE * max(east - west, north - south))
    left, bottom, right, top = window
    tall = MAP_SIDE * (top - bottom) / (right - left)
    figure = new_page((2 * MAP_SIDE + 3 * MARGIN, tall + HEAD + FOOT), DPI)
    kinds: tuple[By, ...] = ("sensor", "intensity")
    for number, by in enumerate(kinds):
        axes = add_axes(figure, MARGIN + number * (MAP_SIDE + MARGIN), FOOT, MAP_SIDE, tall, window)
        axes.set(facecolor=BACKGROUND_COLOUR)
        _draw_points(axes, frame.points, cloud_colours(frame, by)[:, :3])
        draw_area(axes, region, facecolor="none", edgecolor=SOFT_INK, linewidth=0.9)
        _draw_boxes(axes, frame.labels)
        colours = [sensor_colour(one) if by == "sensor" else PAPER for one in range(len(sensors))]
        _draw_sensors(axes, sensors, colours)
        draw_corners(axes, attribution if number else (), north=False)
    _write_around(figure, frame, sensors)
    save_png(path, figure)


def _draw_points(axes: Axes, points: NDArray[np.float32], colour: NDArray[np.float32]) -> None:
    """Paint points as pixels, the highest last: one picture is smaller and faster than a mark for each point."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    shape = (round(PIXELS * (top - bottom) / (right - left)), PIXELS)
    column = np.floor((points[:, 0] - left) / (right - left) * shape[1]).astype(np.int64)
    row = np.floor((points[:, 1] - bottom) / (top - bottom) * shape[0]).astype(np.int64)
    shown = np.flatnonzero((column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0]))
    shown = shown[np.argsort(points[shown, 2], kind="stable")]
    picture = np.empty((*shape, 3))
    picture[:] = to_rgb(BACKGROUND_COLOUR)
    picture[row[shown], column[shown]] = colour[shown]
    axes.imshow(picture, extent=(left, right, bottom, top), origin="lower", interpolation="nearest", aspect="auto")


def _draw_boxes(axes: Axes, labels: Labels) -> None:
    """Draw each box in plan with a line from its middle to its front; those without returns in another colour."""
    corners = box_corners(np.column_stack([labels.centre[:, :2], labels.size[:, :2], labels.yaw]))
    noses = np.stack([labels.centre[:, :2], corners[:, [0, 3]].mean(axis=1)], axis=1)
    edge = np.where(labels.points.sum(axis=1) > 0, SEEN_COLOUR, UNSEEN_COLOUR)
    for shapes, closed in ((corners, True), (noses, False)):
        draw_polygons(axes, shapes, closed=closed, facecolors="none", edgecolors=edge, linewidths=0.8)


def _draw_sensors(axes: Axes, sensors: Sequence[MountedSensor], colours: Sequence[str]) -> None:
    for sensor, colour in zip(sensors, colours, strict=True):
        axes.plot(*sensor.xyz[:2], marker="o", **SENSOR_MARK | {"mfc": colour, "mec": INK, "markersize": 8.0})
        place = (float(sensor.xyz[0]), float(sensor.xyz[1]))
        style: Style = {"color": PAPER, "size": LABEL_SIZE, "weight": "bold", "parse_math": False}
        axes.annotate(sensor.label, place, xytext=(7, 5), textcoords="offset points", **style)


def _write_around(figure: Figure, frame: Frame, sensors: Sequence[MountedSensor]) -> None:
    width, height = figure.get_size_inches()
    style = {"x": MARGIN / width, "ha": "left", "va": "top"}
    unseen = int((frame.labels.points.sum(axis=1) == 0).sum())
    users = f"{counted(len(frame.labels), 'road user')}, {unseen} without a return"
    counts = f"{counted(len(frame), 'point')} of {counted(len(sensors), 'sensor')}  ·  {users}"
    figure.text(y=1 - 0.20 / height, s=f"Scan at {frame.time:.2f} s", size=17, weight="bold", color=INK, **style)
    figure.text(y=1 - 0.58 / height, s=counts, size=11, color=SOFT_INK, **style)
    shown = range(len(sensors))
    marks = [Line2D([], [], color=sensor_colour(number), marker="o", linestyle="none") for number in shown]
    types = [f"{sensor.label}  {sensor.model.short_name}" for sensor in sensors]
    plain_legend(figure, marks, types, loc="lower left", bbox_to_anchor=(MARGIN / width, 0.0), ncols=8)
    bar = figure.add_axes(((2 * MARGIN + MAP_SIDE) / width, 0.3 / height, 3.0 / width, 0.12 / height))
    bar.imshow(strength_ramp(np.linspace(0.0, 1.0, 256))[None], aspect="auto", extent=(0, 1, 0, 1))
    shares = np.array([0.0, 0.05, 0.25, 1.0])
    words = [*(f"{share * MAX_INTENSITY:g}" for share in shares[:-1]), f"{MAX_INTENSITY:g} and more"]
    bar.set(yticks=(), xticks=np.sqrt(shares))
    bar.set_xticklabels(words, size=8, color=INK)
    bar.set_title("intensity", size=8, color=INK, pad=2)
    boxes = [Line2D([], [], color=colour, linewidth=1.5) for colour in (SEEN_COLOUR, UNSEEN_COLOUR)]
    dark: Style = {"frameon": True, "facecolor": BACKGROUND_COLOUR, "labelcolor": SEEN_COLOUR, "ncols": 2}
    right: Style = {"loc": "lower right", "bbox_to_anchor": (1 - MARGIN / width, 0.0)}
    plain_legend(figure, boxes, ["road user with returns", "without a return"], **dark, **right)
