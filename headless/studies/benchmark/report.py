"""The benchmark's results as a Markdown page."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from headless.studies.benchmark.placement import SolverRun
from headless.studies.benchmark.scans import ROAD_USERS, SENSORS, ScanCost
from headless.studies.benchmark.visibility import ENGINES, Cost
from headless.studies.markdown import table

from seip_addon.core.storage.files import whole_file


@dataclass(frozen=True)
class Requirement:
    """A requirement of the project and the figure measured for it.

    Parameters
    ----------
    quantity : str
        Compared quantity.
    required, measured : str
        Required and measured value.
    met : bool
    """

    quantity: str
    required: str
    measured: str
    met: bool


@dataclass(frozen=True, eq=False)
class Findings:
    """All that the benchmark measured.

    Parameters
    ----------
    setting : dict
        Scene and sizes measured, number of cores, and versions.
    visibility : dict of str to Cost
        Cost of visibility by method.
    runs : sequence of SolverRun
        Runs of placement methods: on the site, in a street grid with few and with many sensors, and in the largest.
    scans : dict of str to ScanCost
        Cost of the scanned frames by method and ray caster.
    """

    setting: Mapping[str, Any]
    visibility: Mapping[str, Cost]
    runs: Sequence[SolverRun]
    scans: Mapping[str, ScanCost]


def requirements(findings: Findings) -> list[Requirement]:
    """Compare the measurements with the requirements."""
    costs = findings.visibility
    pairs = (("lazy bvh", "full bvh", 20), ("lazy embree", "full bvh", 100), ("lazy embree", "full embree", 10))
    checks = [
        _ratio(f"{a} against {b}, same V", costs[b].expense.cpu / costs[a].expense.cpu, required)
        for a, b, required in pairs
    ]
    _, few, many, largest = dict.fromkeys(run.instance for run in findings.runs)
    by_name = {(run.instance, run.method): run for run in findings.runs}
    us, cbc = by_name[few, "ours"], by_name[few, "PuLP + CBC"]
    same = us.proven and us.objective >= cbc.objective
    stopped = "" if cbc.proven else ", CBC stopped at the time limit"
    ratio = cbc.expense.cpu / us.expense.cpu
    checks.append(_ratio(f"ours against plain PuLP + CBC, {few}", ratio, 20, holds=same, note=stopped))
    checks.append(_small_gap(by_name[many, "ours"], 0.01, 60, None))
    checks.append(_small_gap(by_name[largest, "ours"], 0.015, 120, 4096))
    plain = findings.scans["full bvh"]
    for engine in ENGINES:
        times = plain.expense.cpu / findings.scans[f"cached {engine}"].expense.cpu
        checks.append(_ratio(f"scanned frames, {engine} with cached returns against full scans with bvh", times, 15))
    most = max(cost.differing / cost.rays for cost in findings.scans.values())
    name = "returns that differ from the full scan's"
    return [*checks, Requirement(name, "1 in a million", f"{most * 1e6:.2g} in a million", most <= 1e-6)]


def save_page(path: str | os.PathLike[str], findings: Findings) -> None:
    """Write the page."""
    parts = [
        *_summary(findings),
        *_about_visibility(findings),
        *_about_placement(findings),
        *_about_scans(findings),
    ]
    with whole_file(path) as temporary:
        temporary.write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def _summary(findings: Findings) -> list[str]:
    versions = ", ".join(f"{name} {version}" for name, version in findings.setting["versions"].items())
    text = (
        "Written by `make benchmark`. Seconds are processor time and depend on the machine. So do ratios, "
        "although compared methods ran in turn in one process. "
        f"Here: {findings.setting['cores']} cores, {versions}."
    )
    rows = [
        (one.quantity, one.required, one.measured, "met" if one.met else "**not met**")
        for one in requirements(findings)
    ]
    return ["# Benchmark", text, table(("", "required", "measured", ""), rows)]


def _about_visibility(findings: Findings) -> list[str]:
    setting = findings.setting
    text = (
        f"{setting['scene']}: {setting['targets']:,} targets, {setting['poses']:,} poses, {setting['triangles']:,} "
        f"triangles. Times are for {setting['positions']} positions spread evenly over the site, with every sensor "
        "type at each: the plain loop (full scans with BVHTree) would take hours for all of them. At each position, "
        "each lazy result was compared bit for bit with its full scan. Any method has to cast at least one ray for "
        "each visible target."
    )
    plain = findings.visibility["full bvh"].expense.cpu
    rows = [
        (
            method,
            f"{plain / cost.expense.cpu:.3g}",
            f"{cost.expense.cpu:.3g}",
            f"{cost.expense.wall:.3g}",
            f"{cost.rays:,}",
            f"{cost.rays / cost.seen:.1f}" if cost.seen else "–",
        )
        for method, cost in findings.visibility.items()
    ]
    head = ("method", "times as fast as the plain loop", "s", "wall-clock s", "rays", "rays per visible target")
    return ["## Visibility", text, table(head, rows)]


def _about_placement(findings: Findings) -> list[str]:
    text = (
        f"Ours had {findings.setting['effort']:g} units of counted work, of about a second each, and the other methods "
        "as many seconds of wall-clock time; on the largest instance twice that. The gap is to the lowest bound that "
        "any method proved for the instance; the own gap is to the bound of the method itself. The plain program is "
        "the textbook one, with a binary variable for each pose and each target. Greedy is lazy (Minoux 1978), and "
        "local search improves it by swaps (Teitz and Bart 1968). Memory is the growth of the process beyond the "
        "memory it held before; it does not include CBC, which runs as a separate program."
    )
    us = {run.instance: run.expense.cpu for run in findings.runs if run.method == "ours"}
    rows = [
        (
            run.instance,
            run.method,
            f"{run.expense.cpu / us[run.instance]:.3g}",
            f"{run.expense.cpu:.3g}",
            f"{run.expense.wall:.3g}",
            "–" if run.memory is None else f"{run.memory:.0f}",
            f"{run.objective:.0f}" if run.objective else "nothing found in time",
            f"{run.gap:.2%}" if run.objective else "–",
            "proven" if run.proven else f"{run.own_gap:.2%}" if math.isfinite(run.own_gap) else "no bound",
        )
        for run in findings.runs
    ]
    head = ("instance", "method", "ours is … times as fast", "s", "wall-clock s", "MB", "covers", "gap", "own gap")
    return ["## Placement", text, table(head, rows)]


def _about_scans(findings: Findings) -> list[str]:
    setting, plain = findings.setting, findings.scans["full bvh"].expense.cpu
    text = (
        f"{setting['frames']} frames of {SENSORS} {setting['scanned_by']} sensors and {ROAD_USERS} road users that all "
        "drive, noise and labels included. *Full*: each frame builds a tree of the whole scene and casts every ray. "
        "*Cached*: returns of the static scene are cached, and road users are cast in their own axes, only by rays "
        "that pass their bounding boxes. Stationary road users are cached as well, which this test does not show. "
        "Returns are the same to 0.1 mm, except for rays that graze an edge or a surface."
    )
    rows = [
        (
            method,
            f"{setting['frames'] / cost.expense.cpu:.3g}",
            f"{plain / cost.expense.cpu:.3g}",
            f"{setting['frames'] / cost.expense.wall:.3g}",
            f"{cost.differing} of {cost.rays:,}",
        )
        for method, cost in findings.scans.items()
    ]
    head = ("method", "frames per second", "times as fast as full bvh", "per wall-clock second", "differing rays")
    return ["## Scans of traffic", text, table(head, rows)]


def _ratio(quantity: str, ratio: float, required: float, *, holds: bool = True, note: str = "") -> Requirement:
    measured = f"{ratio:.3g}×{note}" + ("" if holds else ", not the same optimum")
    return Requirement(quantity, f"{required:g}×", measured, holds and ratio >= required)


def _small_gap(run: SolverRun, gap: float, seconds: float, memory: float | None) -> Requirement:
    required = f"proven, or a gap under {gap:.1%} in {seconds:g} s" + (f" and {memory / 1024:g} GB" if memory else "")
    wall = run.expense.wall
    measured = f"{'proven' if run.proven else f'gap {run.own_gap:.2%}'} in {wall:.0f} s"
    met = run.own_gap < gap and wall < seconds * 1.1  # the solver checks the limit only between steps
    if memory and run.memory:
        measured += f" and {run.memory / 1024:.1f} GB"
        met &= run.memory < memory
    return Requirement(f"ours, {run.instance}", required, measured, met)
