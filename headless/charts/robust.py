"""Charts of coverage under pose errors, and of the price of robust placements."""

from __future__ import annotations

import os
from collections.abc import Sequence
from textwrap import fill

from headless.coverage_study.charts import MARKS, SERIES

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from seip_addon.core.pictures.drawing import save_png
from seip_addon.core.pictures.palette import INK, PAPER, SOFT_INK
from seip_addon.core.robustness.estimates import IntervalEstimate
from seip_addon.core.robustness.pose_study import PoseStudy
from seip_addon.core.robustness.robust_study import Contender, RobustStudy

SIZE = (7.6, 4.4)  # inches

AXIS, UPRIGHT, LEGEND = 80, 34, 44
"""Letters to a line below the axis, beside it, and in one of two columns of the legend."""


def save_spread_chart(path: str | os.PathLike[str], study: RobustStudy, title: str) -> None:
    """Draw the distribution of coverage over unseen draws for each placement, as PNG.

    Steps are empirical distribution functions; a mark on the 5 % line is the quantile with its interval, a tick
    on the axis what the placement covers as planned. Coverage is what a placement is judged by: after a loss, or by
    several sensors, where it was chosen for that.
    """
    figure, axes = _figure(title)
    for row, contender in enumerate((*study.nominal, *study.robust)):
        colour = SERIES[row % len(SERIES)]
        ordered = np.sort(contender.unseen)
        axes.step(ordered, np.arange(1, len(ordered) + 1) / len(ordered), where="post", color=colour, linewidth=1.6)
        _interval(axes, contender.low, 0.05, colour, MARKS[row % len(MARKS)], _named(study, contender))
        axes.plot(contender.undisturbed, 0.0, marker="|", markersize=14, color=colour, clip_on=False)
    axes.axhline(0.05, color=SOFT_INK, linewidth=0.8, linestyle=(0, (4, 2)), zorder=0)
    axes.set_ylabel("share of draws that cover less", color=INK)
    axes.set_xlabel(fill(f"{_outcome(study)}, share of the targets' weight (tick: as planned)", AXIS), color=INK)
    axes.set_ylim(0, 1)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=1))
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    _legend(figure, axes)
    save_png(path, figure)


def save_blame_chart(path: str | os.PathLike[str], study: PoseStudy, title: str) -> None:
    """Draw what each sensor's own error, and each kind of error, costs of the coverage on average, as PNG."""
    figure, axes = _figure(title)
    sensors = list(zip(study.labels, study.loss_by_sensor(), strict=True))
    kinds = list(study.loss_by_kind().items())
    rows = [(f"{label} alone", loss, SERIES[1]) for label, loss in sensors]
    rows += [(f"{kind} alone", loss, SERIES[0]) for kind, loss in kinds]
    for place, (_, loss, colour) in enumerate(rows):
        _interval(axes, loss, place, colour, "o", None)
    axes.axvline(0.0, color=SOFT_INK, linewidth=0.8, zorder=0)
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    axes.invert_yaxis()
    axes.set_xlabel("mean loss of coverage, 95 % interval", color=INK)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=2))
    save_png(path, figure)


def save_frontier_chart(path: str | os.PathLike[str], study: RobustStudy, title: str) -> None:
    """Draw the 5 % quantile over unseen draws against the planned coverage of each placement, as PNG."""
    figure, axes = _figure(title)
    for row, contender in enumerate((*study.nominal, *study.robust)):
        low, colour = contender.low, SERIES[row % len(SERIES)]
        axes.plot([contender.planned] * 2, [low.low, low.high], color=colour, linewidth=1.2)
        axes.plot(
            contender.planned,
            low.value,
            marker=MARKS[row % len(MARKS)],
            color=colour,
            linestyle="none",
            label=_named(study, contender),
        )
    axes.set_xlabel("coverage as planned", color=INK)
    axes.set_ylabel(fill(f"5 % quantile of {_outcome(study)} over unseen draws", UPRIGHT), color=INK)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(PercentFormatter(1.0, decimals=1))
    _legend(figure, axes)
    save_png(path, figure)


def _outcome(study: RobustStudy) -> str:
    """Name what placements are judged by, if it is one thing."""
    return study.nominal[0].judged_by.describe_outcome() if len(study.nominal) == 1 else "coverage"


def _named(study: RobustStudy, contender: Contender) -> str:
    """Name a placement, and the nominal optimum, of which there are several then, with what it is judged by."""
    several = len(study.nominal) > 1 and contender in study.nominal
    name = f"{contender.name}: {contender.judged_by.describe_outcome()}" if several else contender.name
    return fill(name, LEGEND)


def _figure(title: str) -> tuple[Figure, Axes]:
    figure = Figure(SIZE, dpi=160, facecolor=PAPER, layout="constrained")
    axes = figure.subplots()
    figure.suptitle(title, color=INK, fontsize=12, parse_math=False)
    axes.grid(color="#e3e6e8", linewidth=0.8)
    axes.tick_params(colors=SOFT_INK)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return figure, axes


def _interval(  # what is drawn, where, and how
    axes: Axes, estimate: IntervalEstimate, height: float, colour: str, mark: str, label: str | None
) -> None:
    axes.plot(_ends(estimate), [height, height], color=colour, linewidth=2.4)
    axes.plot(estimate.value, height, marker=mark, color=colour, linestyle="none", label=label)


def _ends(estimate: IntervalEstimate) -> Sequence[float]:
    """Return the ends of an interval; where draws leave one open it ends at the value."""
    return [end if np.isfinite(end) else estimate.value for end in (estimate.low, estimate.high)]


def _legend(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    legend = figure.legend(handles, labels, frameon=False, fontsize=9, loc="outside lower center", ncols=2)
    for text in legend.get_texts():
        text.set_parse_math(False)
