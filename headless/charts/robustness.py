"""Charts of coverage under pose errors and in traffic."""

import math
import os
from collections.abc import Sequence
from pathlib import Path
from textwrap import fill

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.ticker import PercentFormatter

from seip_addon.core.base.estimates import IntervalEstimate
from seip_addon.core.choosing.placement.deployment import Deployment
from seip_addon.core.choosing.placement.objective import Solution
from seip_addon.core.choosing.robustness.comparison import Comparison, EvaluatedPlacement
from seip_addon.core.choosing.robustness.pose_study import PoseStudy
from seip_addon.core.geometry.plan import closed, outline
from seip_addon.core.output.pictures.drawing import (
    DASHED,
    add_legend,
    colour,
    draw_area,
    draw_attribution,
    draw_polygons,
    draw_sensors,
    limits_around,
    mark,
    new_figure,
    save_chart,
    style_axes,
)
from seip_addon.core.output.pictures.palette import INK, SEEN_COLOURS, SERIES_COLOURS, SOFT_INK
from seip_addon.core.output.pictures.plan_view import MAX_GAP
from seip_addon.core.output.results.file_names import POSE_ERROR_PICTURES, TRAFFIC_PICTURE
from seip_addon.core.site.scene_geometry import SceneGeometry, joined
from seip_addon.core.site.targets import target_squares
from seip_addon.core.workflows.survey import Survey

FIGURE_SIZE = (7.6, 4.4)  # inches

X_LETTERS, LEGEND_LETTERS = 80, 44
"""Characters per line below the axis, and in one of two columns of the legend."""

TIME_CMAP = LinearSegmentedColormap.from_list("time", (SEEN_COLOURS[0], "#f7e3ae", *SEEN_COLOURS[1:]))
"""Colour map from never to always visible: from the colour of uncovered targets to that of targets seen by two."""

OBSTACLE_COLOUR = "#8b9285"
PICTURE_SIDE = 6.4  # inches
MARGIN_SHARE = 0.04  # of the region's size, shown around it


def save_evaluation_charts(folder: Path, survey: Survey, solution: Solution) -> None:
    """Draw the evaluation of a solution in a folder, as PNG, and remove the charts of an earlier result there."""
    evaluation, name = solution.evaluation, survey.site.name
    for picture in (*POSE_ERROR_PICTURES, TRAFFIC_PICTURE):
        (folder / picture).unlink(missing_ok=True)
    if evaluation is None:
        return
    if evaluation.pose_study is not None:
        spread, losses = (folder / picture for picture in POSE_ERROR_PICTURES)
        save_spread_chart(spread, [evaluation], f"{name}: coverage under pose errors")
        save_loss_chart(losses, evaluation.pose_study, f"{name}: what costs coverage")
    if evaluation.scenarios.kind == "traffic":
        title = f"{name}: share of time seen, {evaluation.robust.road_users:.0f} road users at a time"
        save_time_map(folder / TRAFFIC_PICTURE, survey, solution.deployment, evaluation.robust, title)


def save_spread_chart(path: str | os.PathLike[str], comparisons: Sequence[Comparison], title: str) -> None:
    """Draw the distribution of coverage over unseen draws for each placement, as PNG.

    Steps are empirical distribution functions. A mark on the 5 % line is the quantile with its interval; a tick on the
    axis is the planned coverage. For placements optimised for failures or multi-cover, coverage is after a failure, or
    by several sensors.
    """
    figure, (axes,) = new_figure(*FIGURE_SIZE)
    for row, (label, placed) in enumerate(_labelled(comparisons)):
        ordered = np.sort(placed.held_out)
        below = np.arange(1, len(ordered) + 1) / len(ordered)
        axes.step(ordered, below, where="post", color=colour(row), linewidth=1.6)
        _interval(axes, placed.low, 0.05, colour(row), mark(row), label)
        axes.plot(placed.nominal, 0.0, marker="|", markersize=14, color=colour(row), clip_on=False)
    axes.axhline(0.05, color=SOFT_INK, linewidth=0.8, linestyle=DASHED, zorder=0)
    outcome = fill(f"{_outcome(comparisons)}, share of the targets' weight (tick: as planned)", X_LETTERS)
    style_axes(axes, outcome, "share of draws that cover less")
    axes.set_ylim(0, 1)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=1))
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    add_legend(figure, [axes], columns=2)
    save_chart(path, figure, title)


def save_loss_chart(path: str | os.PathLike[str], study: PoseStudy, title: str) -> None:
    """Draw the mean loss of coverage by each sensor's own error, and by each kind of error, as PNG."""
    figure, (axes,) = new_figure(*FIGURE_SIZE)
    sensors = list(zip(study.labels, study.loss_by_sensor(), strict=True))
    kinds = list(study.loss_by_kind().items())
    rows = [(f"{label} alone", loss, SERIES_COLOURS[1]) for label, loss in sensors]
    rows += [(f"{kind} alone", loss, SERIES_COLOURS[0]) for kind, loss in kinds]
    for place, (_, loss, shown) in enumerate(rows):
        _interval(axes, loss, place, shown, "o", None)
    axes.axvline(0.0, color=SOFT_INK, linewidth=0.8, zorder=0)
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    axes.invert_yaxis()
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=2))
    style_axes(axes, "mean loss of coverage, 95 % interval")
    save_chart(path, figure, title)


def save_time_map(
    path: str | os.PathLike[str], survey: Survey, deployment: Deployment, placed: EvaluatedPlacement, title: str
) -> None:
    """Draw the share of time for which each target is visible, as PNG."""
    site = survey.site
    limits, shape = limits_around(site.region.bounds, MARGIN_SHARE)
    figure, (panel,) = new_figure(PICTURE_SIDE + 0.9, PICTURE_SIDE * shape + 0.9)
    panel.set(**limits)
    panel.set_title(f"road: {placed.mean.describe(1)}, empty {placed.nominal:.1%}", color=INK, fontsize=10)
    panel.set(xticks=(), yticks=())
    squares, colours = target_squares(site.targets)[:, :, :2], TIME_CMAP(placed.seen[1:].mean(axis=0))
    draw_polygons(panel, squares, facecolors=colours, edgecolors="none", antialiaseds=False, zorder=1)
    _draw_place(panel, survey.geometry)
    figure.draw_without_rendering()  # after the last change of the layout that moves data on the page
    where = np.array([sensor.xyz[:2] for sensor in deployment.sensors]).reshape(-1, 2)
    draw_sensors(panel, deployment, where, site.targets.xyz[:, :2], zorder=4)
    draw_attribution(panel, site.attribution)
    bar = figure.colorbar(ScalarMappable(Normalize(0, 1), TIME_CMAP), ax=panel, shrink=0.7, pad=0.01)
    bar.ax.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    bar.set_label("share of time for which it is seen", color=INK)
    save_chart(path, figure, title)


def _labelled(comparisons: Sequence[Comparison]) -> list[tuple[str, EvaluatedPlacement]]:
    """Return each placement with its name; of several nominal optima, each with its evaluated quantity."""
    nominal = list(dict.fromkeys(one.nominal for one in comparisons))
    named = [(f"{one.name}: {one.risk.describe_outcome()}" if len(nominal) > 1 else one.name, one) for one in nominal]
    named += [(one.robust.name, one.robust) for one in comparisons]
    return [(fill(name, LEGEND_LETTERS), placed) for name, placed in named]


def _outcome(comparisons: Sequence[Comparison]) -> str:
    """Return the name of the evaluated quantity if it is the same for all placements, otherwise "coverage"."""
    outcomes = {one.robust.risk.describe_outcome() for one in comparisons}
    return outcomes.pop() if len(outcomes) == 1 else "coverage"


def _interval(
    axes: Axes, estimate: IntervalEstimate, height: float, shown: str, marker: str, label: str | None
) -> None:
    low, high = (end if math.isfinite(end) else estimate.value for end in (estimate.low, estimate.high))
    axes.plot([low, high], [height, height], color=shown, linewidth=2.4)
    axes.plot(estimate.value, height, marker=marker, color=shown, linestyle="none", label=label)


def _draw_place(panel: Axes, geometry: SceneGeometry) -> None:
    """Draw obstacles and the region's border."""
    shown = shapely.box(*panel.get_xlim()[:1], *panel.get_ylim()[:1], *panel.get_xlim()[1:], *panel.get_ylim()[1:])
    standing = shapely.intersection(outline(joined(geometry.occluders)), shown)
    draw_area(panel, standing, facecolor=OBSTACLE_COLOUR, edgecolor="#3d4542", linewidth=0.4, alpha=0.75, zorder=2)
    draw_area(panel, closed(geometry.region, MAX_GAP), facecolor="none", edgecolor=INK, linewidth=1.0, zorder=3)
