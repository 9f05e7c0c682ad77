"""Picture of a verification: what differs from the plan."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes

from ...sensing.recordings.comparison import AGREES, FARTHER, NEARER, VEHICLE
from ...sensing.recordings.verification import Verification
from ...sensing.scans.sensor import MountedSensor
from ...site.scene_geometry import SceneGeometry
from .drawing import box_corners, draw_attribution, draw_polygons, limits_around, new_figure, save_chart
from .palette import COMPARED_COLOURS, GONE_COLOUR, INK, NEW_COLOUR, SENSOR_BODY, SOFT_INK, STATIC_COLOUR

_KINDS = {"new": NEW_COLOUR, "gone": GONE_COLOUR, VEHICLE: STATIC_COLOUR}
_WORDS = {"new": "not in the scene", "gone": "no longer there", VEHICLE: "standing vehicle"}
_SIDE, _DPI = 8.0, 150
_MARGIN = 0.1
_POINT = 0.4
_MOST_POINTS = 60_000


def save_changes_picture(
    path: str | os.PathLike[str], geometry: SceneGeometry, planned: Sequence[MountedSensor], found: Verification
) -> None:
    """Draw the recorded surroundings in plan, what differs from the scene, and the sensors."""
    limits, shape = limits_around(geometry.region.bounds, _MARGIN)
    figure, (panel,) = new_figure(_SIDE, _SIDE * shape + 0.9, dpi=_DPI)
    region = [shapely.get_coordinates(part.exterior) for part in shapely.get_parts(geometry.region)]
    draw_polygons(panel, region, facecolor="#f1f3f4", edgecolor=SOFT_INK, linewidth=0.6, zorder=0)
    _draw_points(panel, found)
    for kind, edge in _KINDS.items():
        boxes = np.array([change.box[[0, 1, 3, 4, 6]] for change in found.changes if change.kind == kind])
        if len(boxes):
            draw_polygons(panel, box_corners(boxes), facecolor="none", edgecolor=edge, linewidth=1.6, zorder=4)
            panel.plot([], [], color=edge, linewidth=1.6, label=_WORDS[kind])
    shown = shapely.box(limits["xlim"][0], limits["ylim"][0], limits["xlim"][1], limits["ylim"][1])
    for change in found.changes:
        if change.kind != VEHICLE and shown.intersects(shapely.Point(change.box[:2])):
            style: dict[str, Any] = {"color": INK, "fontsize": 8, "ha": "center"}
            panel.annotate(change.name, tuple(change.box[:2].tolist()), (0, 9), textcoords="offset points", **style)
    places = np.array([one.sensor.xyz[:2] for one in found.comparisons])
    panel.scatter(
        places[:, 0], places[:, 1], s=60, color=SENSOR_BODY, edgecolor=INK, zorder=5, label="sensor as installed"
    )
    plan = np.array([one.xyz[:2] for one in planned])
    panel.scatter(plan[:, 0], plan[:, 1], s=60, marker="x", color=INK, zorder=5, label="sensor as planned")
    panel.set(**limits, xticks=(), yticks=())
    draw_attribution(panel, geometry.attribution)
    save_chart(path, figure, f"{geometry.name}: recording and scene", [panel])


def _draw_points(panel: Axes, found: Verification) -> None:
    for result, tone, words in (
        (AGREES, COMPARED_COLOURS[1], "as in the scene"),
        (NEARER, _KINDS["new"], "nearer than the scene"),
        (FARTHER, _KINDS["gone"], "farther than the scene"),
    ):
        points = [
            one.sensor.xyz[:2] + one.directions[rays, :2] * one.measured[rays, None]
            for one in found.comparisons
            for rays in [np.flatnonzero(one.result == result)]
        ]
        xy = np.concatenate(points)
        xy = xy[:: max(1, len(xy) // _MOST_POINTS)]
        panel.scatter(xy[:, 0], xy[:, 1], s=_POINT, color=tone, linewidth=0, zorder=2, rasterized=True)
        panel.scatter([], [], s=20, color=tone, label=words)
