"""Charts and tables of a coverage study, for a report."""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from ..coverage_study import NUMBERS, WEIGHTS, Case, Claim, CoverageStudy
from ..storage import whole_file
from .palette import INK, PAPER, SOFT_INK

SERIES = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
"""Colours of sensor types, told apart by colour-blind people (Okabe and Ito 2008)."""

MARKS = ("o", "s", "^", "D", "v", "P")

COLUMNS = (
    "sensor",
    "height_m",
    "count",
    "central_weight",
    "sensors_used",
    "heights_used_m",
    "coverage",
    "central_coverage",
    "seen_twice",
    "objective",
    "bound",
    "gap",
    "status",
    "greedy_objective",
    "price_usd",
)


def save_height_chart(path: str | os.PathLike[str], study: CoverageStudy, title: str) -> None:
    """Draw coverage against mounting height, a panel for each number of sensors, as PNG."""
    figure = Figure((11, 4.2), dpi=160, facecolor=PAPER, layout="constrained")
    panels = figure.subplots(1, len(NUMBERS), sharey=True)
    ticks = [*(f"{height:g}" for height in study.heights), "free"]
    for panel, count in zip(panels, NUMBERS, strict=True):
        for row, sensor in enumerate(study.sensors):
            cases = [study.case(sensor, count, height) for height in (*study.heights, None)]
            _line(panel, row, sensor, range(len(cases)), [case.deployment.coverage for case in cases])
            for x, case in enumerate(cases):
                # What the solver could not rule out, above what it found.
                panel.vlines(x, *(value / study.targets for value in case.span), color=SERIES[row], linewidth=1.2)
        panel.set_title(f"N = {count}", color=INK, fontsize=10)
        panel.set_xticks(range(len(ticks)), ticks)
        panel.set_xlabel("mounting height (m)", color=INK)
        _dress(panel)
    panels[0].set_ylabel("share of targets seen", color=INK)
    panels[-1].legend(frameon=False, fontsize=9, loc="lower right")
    figure.suptitle(f"{title}: coverage by sensor type, height and number", color=INK, fontsize=12)
    _save(figure, path)


def save_weight_chart(path: str | os.PathLike[str], study: CoverageStudy, title: str) -> None:
    """Draw whole and central coverage against the weight of the centre, a panel for each type, as PNG."""
    figure = Figure((11, 4.2), dpi=160, facecolor=PAPER, layout="constrained")
    panels = figure.subplots(1, len(study.sensors), sharey=True, squeeze=False)[0]
    weights = (1.0, *WEIGHTS)
    for panel, sensor in zip(panels, study.sensors, strict=True):
        for row, count in enumerate(NUMBERS):
            found = [study.case(sensor, count, weight=weight).deployment for weight in weights]
            _line(panel, row, f"N = {count}, centre", range(len(weights)), [d.central or 0.0 for d in found])
            _line(panel, row, f"N = {count}, whole", range(len(weights)), [d.coverage for d in found], dashed=True)
        panel.set_title(sensor, color=INK, fontsize=10)
        panel.set_xticks(range(len(weights)), ["1\n(vanilla)", *(f"{weight:g}" for weight in WEIGHTS)])
        panel.set_xlabel("weight of the centre", color=INK)
        _dress(panel)
    panels[0].set_ylabel("share of targets seen", color=INK)
    panels[-1].legend(frameon=False, fontsize=8, loc="lower right")
    figure.suptitle(f"{title}: vanilla against weighted placement", color=INK, fontsize=12)
    _save(figure, path)


def save_study_table(path: str | os.PathLike[str], study: CoverageStudy, heights: Sequence[float]) -> None:
    """Write one row for each case as CSV; ``heights`` are those of the site's poses, (c,) metres."""
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(_row(case, heights) for case in study.cases)


def _row(case: Case, heights: Sequence[float]) -> list[object]:
    chosen = case.placement.chosen
    central = case.deployment.central
    return [
        case.sensor,
        "free" if case.height is None else f"{case.height:g}",
        case.count,
        f"{case.weight:g}",
        len(chosen),
        " ".join(f"{heights[pose]:g}" for pose in chosen),
        f"{case.deployment.coverage:.6f}",
        "" if central is None else f"{central:.6f}",
        f"{case.deployment.seen_twice:.6f}",
        f"{case.placement.objective:.12g}",
        f"{case.placement.bound:.12g}",
        f"{case.placement.gap:.6g}",
        case.placement.status,
        f"{case.greedy.objective:.12g}",
        f"{case.deployment.price:.2f}",
    ]


def save_claims(path: str | os.PathLike[str], claims: Sequence[Claim], title: str) -> None:
    """Write the claims with their verdicts and figures as a Markdown table."""
    lines = [
        f"# {title}: claims of the study on this site",
        "",
        "| # | claim | verdict | figures |",
        "|---|---|---|---|",
    ]
    lines += [f"| {c.number} | {c.text} | **{c.verdict}** | {c.evidence} |" for c in claims]
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _line(  # one drawn line is all of these
    panel: Axes, row: int, label: str, x: Sequence[int], y: Sequence[float], *, dashed: bool = False
) -> None:
    style = {"linestyle": (0, (4, 2)), "mfc": PAPER, "linewidth": 1.0} if dashed else {"linewidth": 1.6}
    panel.plot(
        x, y, color=SERIES[row % len(SERIES)], marker=MARKS[row % len(MARKS)], markersize=5, label=label, **style
    )


def _dress(panel: Axes) -> None:
    panel.set_ylim(0, 1.03)
    panel.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    panel.grid(axis="y", color="#e3e6e8", linewidth=0.8)
    panel.tick_params(colors=SOFT_INK)
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)


def _save(figure: Figure, path: str | os.PathLike[str]) -> None:
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="png", metadata={"Software": None})
