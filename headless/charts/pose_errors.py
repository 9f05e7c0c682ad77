"""Charts of coverage under pose errors, and of the price of robust placements."""

import os
from collections.abc import Sequence
from pathlib import Path
from textwrap import fill

from headless.charts.traffic import save_time_map, save_traffic_chart

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import PercentFormatter

from seip_addon.core.choosing.placement.objective import Solution
from seip_addon.core.choosing.robustness.comparison import Comparison, EvaluatedPlacement
from seip_addon.core.choosing.robustness.pose_study import PoseStudy
from seip_addon.core.counts import counted
from seip_addon.core.estimates import IntervalEstimate
from seip_addon.core.output.pictures.chart_style import (
    DASHED,
    add_legend,
    colour,
    interval_ends,
    mark,
    new_figure,
    save_chart,
    style_axes,
)
from seip_addon.core.output.pictures.palette import SERIES_COLOURS, SOFT_INK
from seip_addon.core.output.results.file_names import POSE_ERROR_PICTURES, TRAFFIC_PICTURES
from seip_addon.core.workflows.survey import Survey


def save_evaluation_charts(folder: Path, survey: Survey, solution: Solution) -> None:
    """Draw the evaluation of a solution in a folder, as PNG, and remove the charts of an earlier result there."""
    evaluation, name = solution.evaluation, survey.site.name
    for picture in (*POSE_ERROR_PICTURES, *TRAFFIC_PICTURES):
        (folder / picture).unlink(missing_ok=True)
    if evaluation is None:
        return
    if evaluation.pose_study is not None:
        spread, losses, frontier = (folder / picture for picture in POSE_ERROR_PICTURES)
        save_spread_chart(spread, [evaluation], f"{name}: coverage under pose errors")
        save_loss_chart(losses, evaluation.pose_study, f"{name}: what costs coverage")
        save_frontier_chart(frontier, [evaluation], f"{name}: what robustness costs and saves")
    if evaluation.scenarios.kind == "traffic":
        time_seen, traffic = (folder / picture for picture in TRAFFIC_PICTURES)
        title = f"{name}: share of time seen, {evaluation.robust.road_users:.0f} road users at a time"
        save_time_map(time_seen, survey.geometry, survey.site, solution.deployment, evaluation.robust, title)
        sensors = counted(len(solution.deployment.sensors), "sensor")
        save_traffic_chart(traffic, evaluation, sensors, f"{name}: empty road and traffic")


FIGURE_SIZE = (7.6, 4.4)  # inches

X_LETTERS, Y_LETTERS, LEGEND_LETTERS = 80, 34, 44
"""Characters per line below the axis, next to it, and in one of two columns of the legend."""


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


def save_frontier_chart(path: str | os.PathLike[str], comparisons: Sequence[Comparison], title: str) -> None:
    """Draw the 5 % quantile over unseen draws against the planned coverage of each placement, as PNG."""
    figure, (axes,) = new_figure(*FIGURE_SIZE)
    for row, (label, placed) in enumerate(_labelled(comparisons)):
        low = placed.low
        axes.plot([placed.planned] * 2, [low.low, low.high], color=colour(row), linewidth=1.2)
        axes.plot(placed.planned, low.value, mark(row), color=colour(row), label=label)
    style_axes(
        axes, "coverage as planned", fill(f"5 % quantile of {_outcome(comparisons)} over unseen draws", Y_LETTERS)
    )
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(PercentFormatter(1.0, decimals=1))
    add_legend(figure, [axes], columns=2)
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
    axes.plot(interval_ends(estimate), [height, height], color=shown, linewidth=2.4)
    axes.plot(estimate.value, height, marker=marker, color=shown, linestyle="none", label=label)
