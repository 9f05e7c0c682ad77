"""The map of blind spots, a picture that only a report has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import ListedColormap

from ...base.arrays import Float
from ..pictures.drawing import (
    Style,
    add_axes,
    as_png,
    draw_callouts,
    draw_corners,
    new_page,
    window_around,
)
from ..pictures.palette import INK, PAPER, SEEN_COLOURS
from .blind_spots import BlindSpot
from .evidence import Evidence

DPI = 150
MAP_WIDTH = 7.2  # inches
MAP_SHAPES = (4.0 / MAP_WIDTH, 8.0 / MAP_WIDTH)  # least and largest height, in widths
MARGIN = 6.0  # metres around the road
NUMBER_SIZE = 10.0  # points


def blind_spot_map(evidence: Evidence, spots: Sequence[BlindSpot]) -> bytes:
    """Return the road by how many sensors see it, with the sensors and numbered blind spots, as PNG."""
    targets = evidence.site.targets
    x, y = targets.xyz[:, 0], targets.xyz[:, 1]
    sensors = np.array([sensor.local_m[:2] for sensor in evidence.sensors]).reshape(-1, 2)
    points = np.vstack((targets.xyz[:, :2], sensors))
    window = window_around((*points.min(axis=0).tolist(), *points.max(axis=0).tolist()), MARGIN, MAP_SHAPES)
    page = (MAP_WIDTH, MAP_WIDTH * (window[3] - window[1]) / (window[2] - window[0]))
    figure = new_page(page, DPI)
    axes = add_axes(figure, 0.0, 0.0, *page, window)

    column = np.round((x - x.min()) / targets.spacing).astype(np.int64)
    row = np.round((y - y.min()) / targets.spacing).astype(np.int64)
    cells = np.full((row.max() + 1, column.max() + 1), np.nan)
    cells[row, column] = np.minimum(evidence.seen_by, 2)
    half = targets.spacing / 2
    frame = (x.min() - half, x.max() + half, y.min() - half, y.max() + half)
    style: Style = {"cmap": ListedColormap(SEEN_COLOURS), "vmin": 0, "vmax": 2, "interpolation": "nearest"}
    axes.imshow(cells, origin="lower", extent=frame, aspect="auto", **style)
    axes.set(xlim=(window[0], window[2]), ylim=(window[1], window[3]))  # which the image has changed
    taken = draw_corners(axes, evidence.record.site.attribution)
    middles, inch = np.array([spot.middle[:2] for spot in spots]), (window[2] - window[0]) / MAP_WIDTH
    taken += [(*(middle - 0.12 * inch), *(middle + 0.12 * inch)) for middle in middles]
    axes.plot(*sensors.T, linestyle="none", marker="^", markersize=10, mfc=INK, mec=PAPER, mew=1.2, zorder=4.0)
    labels = [sensor.id for sensor in evidence.sensors]
    draw_callouts(axes, sensors, labels, targets.xyz[:, :2], 3.0, taken)
    circle: Style = {"boxstyle": "circle,pad=0.22", "facecolor": PAPER, "edgecolor": INK, "linewidth": 1.2}
    style = {"ha": "center", "va": "center", "size": NUMBER_SIZE, "weight": "bold", "color": INK, "zorder": 5.0}
    for number, (right, up) in enumerate(_apart(middles, 0.24 * inch).tolist(), start=1):
        axes.text(right, up, str(number), bbox=circle, **style)
    return as_png(figure)


def _apart(points: Float, distance: float) -> Float:
    """Return points (n, 2) moved as little as a few steps allow until no two are nearer than a distance."""
    moved = points.copy()
    for _ in range(50):
        for number in range(1, len(moved)):
            away = moved[number] - moved[:number]
            gaps = np.hypot(*away.T)
            nearest = int(np.argmin(gaps))
            if gaps[nearest] < distance:
                way = away[nearest] / gaps[nearest] if gaps[nearest] > 0 else np.array((0.0, 1.0))
                moved[number] = moved[nearest] + distance * 1.02 * way
    return moved
