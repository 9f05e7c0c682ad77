"""Plan view of one frame with road users, detections and errors."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.path import Path
from shapely.geometry.base import BaseGeometry

from seip_addon.core.base.arrays import Boolean, Float
from seip_addon.core.output.pictures.drawing import (
    SENSOR_MARK,
    box_corners,
    draw_attribution,
    draw_polygons,
    limits_around,
    new_figure,
    save_chart,
)
from seip_addon.core.output.pictures.palette import INK, SOFT_INK

TRUTH_COLOUR, DETECTED_COLOUR, IGNORED_COLOUR = "#00875a", "#d1242f", "#a9b1b8"
TRUTH_FILL = TRUTH_COLOUR + "22"
HIT_COLOUR, GROUND_COLOUR = "#9aa3ab", "#f1f3f4"
PICTURE_SIDE, DPI = 5.6, 200  # inches
MARGIN_SHARE = 0.03  # of the region's size, shown around it
MAX_POINTS = 150_000  # largest number of drawn returns of a cloud, evenly chosen: more would cover each other
RING_RADIUS = 4.0  # metres, radius of the rings around errors
MIN_NOSE_LENGTH = 0.3  # metres, least length of the stroke that marks a box's front

CLOUD, REGION, IGNORED, TRUTH, DETECTION, ERROR, SENSOR = range(7)


@dataclass(frozen=True, eq=False)
class ErrorView:
    """One frame with its road users, detections and errors.

    Parameters
    ----------
    cloud : (n, 2) float array, metres
        Returns in plan.
    sensors : (s, 2) float64, metres
    truth : (g, 5) float64
        Road users in plan: x, y of the middle, length, width (metres), yaw (radians, counter-clockwise from +x).
    wanted, missed : (g,) bool
        Whether each road user had to be found, and whether it had to be and was missed.
    detected : (k, 5) float64
        Detections in plan.
    false : (k,) bool
        Whether each detection is false.
    """

    name: str
    cloud: Float
    region: BaseGeometry
    sensors: Float
    truth: Float
    wanted: Boolean
    missed: Boolean
    detected: Float
    false: Boolean


def save_error_view(
    path: str | os.PathLike[str], views: Sequence[ErrorView], title: str, attribution: Sequence[str] = ()
) -> None:
    """Draw frames from above: the cloud grey, road users green, detections red, errors ringed, as PNG.

    Parameters
    ----------
    attribution : sequence of str
        Credits required by the sources of the scene.
    """
    limits, shape = limits_around(shapely.total_bounds([view.region for view in views]), MARGIN_SHARE)
    figure, panels = new_figure(PICTURE_SIDE * len(views), PICTURE_SIDE * shape + 1.1, len(views), dpi=DPI)
    for panel, view in zip(panels, views, strict=True):
        panel.set(**limits)
        _draw(panel, view)
        draw_attribution(panel, attribution)
    columns = 6 if len(views) > 1 else 3  # one frame is too narrow for all in a row
    legend = figure.legend(handles=_legend(), frameon=False, fontsize=9, loc="outside lower center", ncols=columns)
    for text in legend.get_texts():
        text.set_color(INK)
    save_chart(path, figure, title)


def _draw(panel: Axes, view: ErrorView) -> None:
    cloud = view.cloud[:: max(1, -(-len(view.cloud) // MAX_POINTS))]
    panel.plot(cloud[:, 0], cloud[:, 1], linestyle="none", marker=",", color=HIT_COLOUR, zorder=CLOUD, rasterized=True)
    for part in shapely.get_parts(view.region):
        ring = np.asarray(part.exterior.coords)
        panel.fill(ring[:, 0], ring[:, 1], facecolor=GROUND_COLOUR, edgecolor="none", zorder=CLOUD - 1)
        panel.plot(ring[:, 0], ring[:, 1], color=INK, linewidth=0.9, zorder=REGION)
    _boxes(panel, view.truth[~view.wanted], IGNORED_COLOUR, IGNORED, linewidth=0.7)
    _boxes(panel, view.truth[view.wanted], TRUTH_COLOUR, TRUTH, linewidth=1.2, facecolor=TRUTH_FILL)
    _boxes(panel, view.detected, DETECTED_COLOUR, DETECTION, linewidth=0.9)
    _rings(panel, view.truth[view.missed], TRUTH_COLOUR, dashed=True)
    _rings(panel, view.detected[view.false], DETECTED_COLOUR, dashed=False)
    panel.plot(*view.sensors.T, zorder=SENSOR, marker="o", **SENSOR_MARK | {"markersize": 8.0})
    panel.set(xticks=(), yticks=())
    panel.spines[:].set(color=SOFT_INK, linewidth=0.6)
    words = f"{_count(view.missed, 'missed')} of {int(view.wanted.sum())}, {_count(view.false, 'false')}"
    panel.set_title(view.name, color=INK, fontsize=10.5, parse_math=False, loc="left")
    panel.set_title(words, color=SOFT_INK, fontsize=9, loc="right")


def _boxes(panel: Axes, boxes: Float, colour: str, zorder: int, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
    """Draw boxes, each with a stroke from its middle to its front."""
    draw_polygons(panel, box_corners(boxes), **{"facecolor": "none"} | style, edgecolor=colour, zorder=zorder)
    ahead = np.column_stack([np.cos(boxes[:, 4]), np.sin(boxes[:, 4])]) * np.maximum(boxes[:, 2:3] / 2, MIN_NOSE_LENGTH)
    strokes = np.stack([boxes[:, :2], boxes[:, :2] + ahead], axis=1)
    line: dict[str, Any] = {"edgecolor": colour, "facecolor": "none", "linewidth": 0.7}
    draw_polygons(panel, strokes, closed=False, zorder=zorder, **line)


def _rings(panel: Axes, boxes: Float, colour: str, *, dashed: bool) -> None:
    angle = np.linspace(0, 2 * np.pi, 49)
    radius = np.maximum(RING_RADIUS, 0.62 * boxes[:, 2])[:, None]
    rings = boxes[:, None, :2] + radius[..., None] * np.column_stack([np.cos(angle), np.sin(angle)])
    stroke = (0, (3, 1.6)) if dashed else "-"
    draw_polygons(panel, rings, facecolor="none", edgecolor=colour, linewidth=1.3, linestyle=stroke, zorder=ERROR)


def _count(which: Boolean, word: str) -> str:
    return f"{int(which.sum())} {word}"


def _legend() -> list[Patch | Line2D]:
    ring: dict[str, Any] = {"linestyle": "none", "markersize": 11, "mfc": "none", "mew": 1.3}
    dashes = Path.make_compound_path(*(Path.arc(start, start + 27) for start in range(0, 360, 45)))
    return [
        Patch(facecolor=TRUTH_FILL, edgecolor=TRUTH_COLOUR, label="road user"),
        Patch(facecolor="none", edgecolor=DETECTED_COLOUR, label="detection"),
        Line2D([], [], mec=TRUTH_COLOUR, label="missed", marker=dashes, **ring),
        Line2D([], [], mec=DETECTED_COLOUR, label="false", marker="o", **ring),
        Patch(facecolor="none", edgecolor=IGNORED_COLOUR, label="does not count"),
        Line2D([], [], marker="o", label="sensor", **SENSOR_MARK | {"markersize": 8.0}),
    ]
