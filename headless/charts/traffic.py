"""Charts of coverage in traffic, for nominal and for traffic-aware placements."""

import os

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.ticker import PercentFormatter

from seip_addon.core.choosing.placement.deployment import Deployment
from seip_addon.core.choosing.robustness.comparison import Comparison, EvaluatedPlacement
from seip_addon.core.estimates import IntervalEstimate
from seip_addon.core.geometry.plan import closed, outline
from seip_addon.core.output.pictures.chart_style import (
    interval_ends,
    limits_around,
    new_figure,
    save_chart,
    style_axes,
)
from seip_addon.core.output.pictures.drawing import draw_attribution, draw_polygons, draw_sensors
from seip_addon.core.output.pictures.palette import INK, SEEN_COLOURS, SERIES_COLOURS, SOFT_INK
from seip_addon.core.output.pictures.plan_map import MAX_GAP, draw_area
from seip_addon.core.site.scene_geometry import SceneGeometry, joined
from seip_addon.core.site.site import Site
from seip_addon.core.site.target_squares import target_squares

TIME_CMAP = LinearSegmentedColormap.from_list("time", (SEEN_COLOURS[0], "#f7e3ae", *SEEN_COLOURS[1:]))
"""Colour map from never to always visible: from the colour of uncovered targets to that of targets seen by two."""

OBSTACLE_COLOUR = "#8b9285"
PICTURE_SIDE = 6.4  # inches
MARGIN_SHARE = 0.04  # of the region's size, shown around it
BAR_STEP = 0.26  # from one bar to the next, of the width of 1.2 that is shown


def save_time_map(
    path: str | os.PathLike[str],
    geometry: SceneGeometry,
    site: Site,
    deployment: Deployment,
    placed: EvaluatedPlacement,
    title: str,
) -> None:
    """Draw the share of time for which each target is visible, as PNG."""
    limits, shape = limits_around(site.region.bounds, MARGIN_SHARE)
    figure, (panel,) = new_figure(PICTURE_SIDE + 0.9, PICTURE_SIDE * shape + 0.9)
    panel.set(**limits)
    panel.set_title(f"road: {placed.mean.describe(1)}, empty {placed.nominal:.1%}", color=INK, fontsize=10)
    panel.set(xticks=(), yticks=())
    squares, colours = target_squares(site.targets)[:, :, :2], TIME_CMAP(placed.seen[1:].mean(axis=0))
    draw_polygons(panel, squares, facecolors=colours, edgecolors="none", antialiaseds=False, zorder=1)
    _draw_place(panel, geometry)
    figure.draw_without_rendering()  # after the last change of the layout that moves data on the page
    where = np.array([sensor.xyz[:2] for sensor in deployment.sensors]).reshape(-1, 2)
    draw_sensors(panel, deployment, where, site.targets.xyz[:, :2], zorder=4)
    draw_attribution(panel, site.attribution)
    bar = figure.colorbar(ScalarMappable(Normalize(0, 1), TIME_CMAP), ax=panel, shrink=0.7, pad=0.01)
    bar.ax.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    bar.set_label("share of time for which it is seen", color=INK)
    save_chart(path, figure, title)


def save_traffic_chart(path: str | os.PathLike[str], comparison: Comparison, sensors: str, title: str) -> None:
    """Draw coverage on the empty road and in traffic, for placements optimised without and with traffic, as PNG.

    Parameters
    ----------
    sensors : str
        Number and types of the sensors, like ``2 × type1``.
    """
    figure, (shares, changes) = new_figure(11.5, 4.6, 2)
    empty, traffic = comparison.nominal, comparison.robust
    _bar(shares, -1, IntervalEstimate(empty.nominal, empty.nominal, empty.nominal), "empty road")
    _bar(shares, 0, empty.mean, "in traffic")
    _bar(shares, 1, traffic.mean, "in traffic, placed on traffic")
    shares.set_ylabel("share of the road seen", color=INK)
    _dot(changes, -0.5, negative(empty.loss), 1, "change by traffic")
    _dot(changes, 0.5, comparison.gain, 2, "gain by placing on traffic")
    changes.axhline(0.0, color=SOFT_INK, linewidth=0.8, zorder=0)
    changes.set_ylabel("change, 95 % interval", color=INK)
    for axes, decimals in ((shares, 0), (changes, 1)):
        axes.set_xticks([0], [sensors])
        axes.set_xlim(-0.6, 0.6)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=decimals))
        style_axes(axes, grid="y")
        axes.legend(frameon=False, fontsize=9, loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3)
    save_chart(path, figure, title)


def negative(estimate: IntervalEstimate) -> IntervalEstimate:
    """Return an estimate with the opposite sign."""
    return IntervalEstimate(-estimate.value, -estimate.high, -estimate.low)


def _draw_place(panel: Axes, geometry: SceneGeometry) -> None:
    """Draw obstacles and the region's border."""
    shown = shapely.box(*panel.get_xlim()[:1], *panel.get_ylim()[:1], *panel.get_xlim()[1:], *panel.get_ylim()[1:])
    standing = shapely.intersection(outline(joined(geometry.occluders)), shown)
    draw_area(panel, standing, facecolor=OBSTACLE_COLOUR, edgecolor="#3d4542", linewidth=0.4, alpha=0.75, zorder=2)
    draw_area(panel, closed(geometry.region, MAX_GAP), facecolor="none", edgecolor=INK, linewidth=1.0, zorder=3)


def _bar(axes: Axes, place: int, estimate: IntervalEstimate, label: str) -> None:
    x = place * BAR_STEP
    colour = (SEEN_COLOURS[1], SERIES_COLOURS[1], SERIES_COLOURS[2])[place + 1]
    axes.bar(x, estimate.value, width=0.9 * BAR_STEP, color=colour, label=label)
    axes.plot([x, x], interval_ends(estimate), color=INK, linewidth=1.4)


def _dot(axes: Axes, place: float, estimate: IntervalEstimate, colour: int, label: str) -> None:
    x = place * BAR_STEP
    axes.plot([x, x], interval_ends(estimate), color=SERIES_COLOURS[colour], linewidth=2.4)
    axes.plot(x, estimate.value, "o", color=SERIES_COLOURS[colour], label=label)
