"""The benchmark's results as JSON and as a Markdown page."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

from headless.studies.benchmark.growth import Growth
from headless.studies.benchmark.placement import SolverRun
from headless.studies.benchmark.resource_usage import Expense
from headless.studies.benchmark.scans import ROAD_USERS, SENSORS, ScanCost
from headless.studies.benchmark.sensor_models import PrecisionFront, SensorModelFindings, SiteFront
from headless.studies.benchmark.sensor_report import sensor_model_parts, table
from headless.studies.benchmark.visibility import ENGINES, Cost, Degradation

from seip_addon.core.errors import SeipError
from seip_addon.core.estimates import Interval, IntervalEstimate
from seip_addon.core.storage.files import whole_file


@dataclass(frozen=True)
class Bar:
    """A requirement of the project and the figure measured for it.

    Parameters
    ----------
    what : str
        Compared quantity.
    asked, measured : str
        Required and measured value.
    met : bool
    """

    what: str
    asked: str
    measured: str
    met: bool


@dataclass(frozen=True, eq=False)
class Findings:
    """All that the benchmark measured.

    Parameters
    ----------
    setting : dict
        Scene and sizes measured, number of cores, and versions.
    limits : dict of str to float
        Time of the lazy engine by caster, as a multiple of the time of one cast per visible target.
    """

    setting: dict[str, Any]
    costs: Mapping[str, Cost]
    degradations: Mapping[str, Degradation]
    limits: Mapping[str, float]
    runs: Sequence[SolverRun]
    growths: Sequence[Growth]
    scans: Mapping[str, ScanCost]
    sensor_models: SensorModelFindings | None = None


def bars(
    costs: Mapping[str, Cost], runs: Sequence[SolverRun], names: Sequence[str], scans: Mapping[str, ScanCost]
) -> list[Bar]:
    """Compare the measurements with the requirements.

    Parameters
    ----------
    names : three str
        Names of the instances with few sensors, with many sensors, and of the largest one.
    """
    pairs = (("lazy bvh", "full bvh", 20), ("lazy embree", "full bvh", 100), ("lazy embree", "full embree", 10))
    checks = [
        _ratio(f"{a} against {b}, same V", costs[b].seconds / costs[a].seconds, required) for a, b, required in pairs
    ]
    by_name = {(run.instance, run.way): run for run in runs}
    few, many, largest = names
    us, cbc = by_name[few, "ours"], by_name[few, "PuLP + CBC"]
    same = us.proven and us.objective >= cbc.objective
    ratio = cbc.expense.cpu / us.expense.cpu
    stopped = "" if cbc.proven else ", CBC stopped at the time limit"
    checks.append(_ratio(f"ours against plain PuLP + CBC, {few}", ratio, 20, holds=same, note=stopped))
    checks += _small_gap(by_name[many, "ours"], 0.01, 60, None), _small_gap(by_name[largest, "ours"], 0.015, 120, 4096)
    plain = scans["full bvh"]
    for engine in ENGINES:
        times = scans[f"cached {engine}"].rate / plain.rate
        checks.append(_ratio(f"scanned frames, {engine} with cached returns against full scans with bvh", times, 15))
    most = max(cost.differing / cost.rays for cost in scans.values())
    few_differ = f"{most * 1e6:.2g} in a million, each grazes an edge or a surface"
    return [*checks, Bar("returns that differ from the full scan's", "1 in a million", few_differ, most <= 1e-6)]


def save_json(path: str | os.PathLike[str], findings: Findings, checks: Sequence[Bar]) -> None:
    """Write all figures as JSON; values that are not finite become null."""
    runs = [asdict(run) | {"gap": run.gap, "own_gap": run.own_gap, "proven": run.proven} for run in findings.runs]
    growths = [
        asdict(g) | {"time_exponent": g.time_exponent, "memory_exponent": g.memory_exponent} for g in findings.growths
    ]
    record = {
        "setting": findings.setting,
        "bars": [asdict(bar) for bar in checks],
        "visibility": {way: asdict(cost) for way, cost in findings.costs.items()},
        "harm": {name: asdict(degradation) for name, degradation in findings.degradations.items()},
        "times_the_limit": dict(findings.limits),
        "placement": runs,
        "growth": growths,
        "scans": {way: asdict(cost) | {"rate": cost.rate} for way, cost in findings.scans.items()},
        "sensor_models": asdict(findings.sensor_models) if findings.sensor_models else None,
    }
    with whole_file(path) as temporary:
        temporary.write_text(json.dumps(_finite(record), indent=1) + "\n", encoding="utf-8")


def load_json(path: str | os.PathLike[str]) -> tuple[Findings, list[Bar]]:
    """Read a file of `save_json`: findings, and the requirements that they were compared with.

    Raises
    ------
    SeipError
        The file is missing or is not a benchmark's.
    """
    try:
        record = json.loads(Path(path).read_text(encoding="utf-8"))
        return _findings(record), [Bar(**bar) for bar in record["bars"]]
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise SeipError(f"{path} is not a benchmark's file ({error}): delete it and rerun the benchmark") from error


def save_page(path: str | os.PathLike[str], findings: Findings, checks: Sequence[Bar], pictures: str) -> None:
    """Write the page; ``pictures`` is the folder of the charts, as seen from the page."""
    parts = [
        *_summary(findings.setting, checks),
        *_about_visibility(findings, pictures),
        *_about_placement(findings, pictures),
        *_about_growth(findings, pictures),
        *_about_scans(findings),
        *(sensor_model_parts(findings.sensor_models, pictures) if findings.sensor_models else []),
    ]
    with whole_file(path) as temporary:
        temporary.write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def _summary(setting: Mapping[str, Any], checks: Sequence[Bar]) -> list[str]:
    versions = ", ".join(f"{name} {version}" for name, version in setting["versions"].items())
    text = (
        "Written by `make benchmark`. Seconds are processor time and depend on the machine. Ratios hardly depend on "
        "it: compared methods ran in turn in one process. "
        f"Here: {setting['cores']} cores, {versions}."
    )
    rows = [(bar.what, bar.asked, bar.measured, "met" if bar.met else "**not met**") for bar in checks]
    return ["# Benchmark", text, table(("", "required", "measured", ""), rows)]


def _about_visibility(findings: Findings, pictures: str) -> list[str]:
    setting, plain, exact = findings.setting, findings.costs["full bvh"], findings.degradations["exact"]
    text = (
        f"{setting['scene']}: {setting['targets']:,} targets, {setting['poses']:,} poses, {setting['triangles']:,} "
        f"triangles. Times are for {setting['places']} positions spread evenly over the site, with every sensor type "
        "at each: the plain loop (full scans with BVHTree) would take hours for all of them. At each position, each "
        "lazy result was compared bit for bit with its full scan. Errors are for the whole grid: wrong pairs of pose "
        f"and target, per pair that is visible in the exact grid. The placement of {setting['count']} "
        f"{setting['sensor']} sensors is optimised on the simplified grid and evaluated on the exact one."
    )
    costs = table(
        ("method", "times as fast as the plain loop", "s", "wall-clock s", "rays", "rays per visible target"),
        [_cost_row(way, cost, plain) for way, cost in findings.costs.items()],
    )
    degradation = table(
        ("simplification", "wrong pairs", "claimed coverage", "exact coverage", "lost", "poses kept", ""),
        [_degradation_row(name, degradation, exact) for name, degradation in findings.degradations.items()],
    )
    times = "; ".join(f"with {engine} it takes {n:.1f} times that" for engine, n in findings.limits.items())
    limit = f"Any method has to cast at least one ray for each visible target. The lazy engine: {times}."
    picture = f"![processor time against error of visibility]({pictures}/visibility.png)"
    return ["## Visibility", text, picture, costs, degradation, limit]


def _about_placement(findings: Findings, pictures: str) -> list[str]:
    text = (
        f"Ours had {findings.setting['effort']:g} units of counted work, of about a second each, and the other methods "
        "as many seconds of wall-clock time; on the largest instance twice that. The gap is to the lowest bound that "
        "any method proved for the instance; the own gap is to the bound of the method itself. The plain program is "
        "the textbook one, with a binary variable for each pose and each target. Memory is the growth of the process "
        "beyond the memory it held before; it does not include CBC, which runs as a separate program."
    )
    head = ("instance", "method", "ours is … times as fast", "s", "wall-clock s", "MB", "covers", "gap", "own gap", "")
    picture = f"![processor time against gap of placement]({pictures}/placement.png)"
    return ["## Placement", text, picture, table(head, _run_rows(findings.runs))]


def _about_growth(findings: Findings, pictures: str) -> list[str]:
    text = (
        "Each size ran in a process of its own. For corridors, visibility was computed at a sample of positions and "
        "scaled up to all. An exponent of b means that twice the size costs 2^b times as much (least squares over all "
        "sizes); a fixed cost that does not depend on the size makes it smaller."
    )
    head = ("work", "growing size", "sizes", "s", "exponent", "MB", "exponent of memory")
    picture = f"![growth of time and memory]({pictures}/growth.png)"
    return ["## Growth", text, picture, table(head, [_growth_row(growth) for growth in findings.growths])]


def _about_scans(findings: Findings) -> list[str]:
    plain = findings.scans["full bvh"]
    text = (
        f"Frames of {SENSORS} {findings.setting['scanned_by']} sensors and {ROAD_USERS} road users that all drive, "
        "noise and labels included. *Full*: each frame builds a tree of the whole scene and casts every ray. *Cached*: "
        "returns of the static scene are cached, and road users are cast in their own axes, only by rays that pass "
        "their bounding boxes. (Stationary road users are cached as well, which this test does not show.) Returns are "
        "the same to 0.1 mm, except for rays that graze an edge, or a surface so edge-on that the single precision of "
        "the full scan's corners moves its return."
    )
    rows = [
        (
            way,
            f"{cost.rate:.3g}",
            f"{cost.rate / plain.rate:.3g}",
            f"{cost.frames / cost.expense.wall:.3g}",
            f"{cost.differing} of {cost.rays:,}",
        )
        for way, cost in findings.scans.items()
    ]
    head = ("method", "frames per second", "ratio to full bvh", "per wall-clock second", "differing rays")
    return ["## Scans of traffic", text, table(head, rows)]


def _ratio(what: str, ratio: float, required: float, *, holds: bool = True, note: str = "") -> Bar:
    measured = f"{ratio:.3g}×{note}" + ("" if holds else ", not the same optimum")
    return Bar(what, f"{required:g}×", measured, holds and ratio >= required)


def _small_gap(run: SolverRun, gap: float, seconds: float, memory: float | None) -> Bar:
    required = f"proven, or a gap under {gap:.1%} in {seconds:g} s" + (f" and {memory / 1024:g} GB" if memory else "")
    wall = run.expense.wall
    measured = f"{'proven' if run.proven else f'gap {run.own_gap:.2%}'} in {wall:.0f} s"
    met = run.own_gap < gap and wall < seconds * 1.1  # the solver checks the limit only between steps
    if memory and run.memory:
        measured += f" and {run.memory / 1024:.1f} GB"
        met &= run.memory < memory
    return Bar(f"ours, {run.instance}", required, measured, met)


def _cost_row(way: str, cost: Cost, plain: Cost) -> tuple[str, ...]:
    return (
        way,
        f"{plain.seconds / cost.seconds:.3g}",
        f"{cost.seconds:.3g}",
        f"{cost.expense.wall:.3g}",
        f"{cost.rays:,}",
        f"{cost.rays / cost.seen:.1f}" if cost.seen else "–",
    )


def _degradation_row(name: str, degradation: Degradation, exact: Degradation) -> tuple[str, ...]:
    return (
        name,
        f"{degradation.wrong:.2%}",
        f"{degradation.claimed:.2%}",
        f"{degradation.coverage:.2%}",
        f"{exact.coverage - degradation.coverage:.2%}",
        f"{degradation.kept} of {exact.kept}",
        "" if degradation.proven else "placement not proven the best",
    )


def _run_rows(runs: Sequence[SolverRun]) -> list[tuple[str, ...]]:
    us = {run.instance: run.expense.cpu for run in runs if run.way == "ours"}
    return [
        (
            run.instance,
            run.way,
            f"{run.expense.cpu / us[run.instance]:.3g}",
            f"{run.expense.cpu:.3g}",
            f"{run.expense.wall:.3g}",
            "–" if run.memory is None else f"{run.memory:.0f}",
            f"{run.objective:.0f}" if run.objective else "–",
            f"{run.gap:.2%}" if run.objective else "–",
            "proven" if run.proven else f"{run.own_gap:.2%}" if math.isfinite(run.own_gap) else "no bound",
            run.note,
        )
        for run in runs
    ]


def _growth_row(growth: Growth) -> tuple[str, ...]:
    memory, exponent = growth.memory, growth.memory_exponent
    return (
        growth.what,
        growth.size_of,
        " ".join(f"{size:,.0f}" if size > 100 else f"{size:.3g}" for size in growth.size),
        " ".join(f"{seconds:.3g}" for seconds in growth.seconds),
        f"{growth.time_exponent:.2f}",
        " ".join("–" if mega is None else f"{mega:.0f}" for mega in memory),
        "–" if exponent is None else f"{exponent:.2f}",
    )


def _findings(record: Mapping[str, Any]) -> Findings:
    runs = [
        SolverRun(**_fields(SolverRun, run) | {"expense": Expense(**run["expense"]), "bound": _infinite(run["bound"])})
        for run in record["placement"]
    ]
    growths = [Growth(**_fields(Growth, _with_tuples(one))) for one in record["growth"]]
    return Findings(
        record["setting"],
        _costs(Cost, record["visibility"]),
        {name: Degradation(**one) for name, one in record["harm"].items()},
        record["times_the_limit"],
        runs,
        growths,
        _costs(ScanCost, record["scans"]),
        _sensor_models(record.get("sensor_models")),
    )


def _sensor_models(record: Mapping[str, Any] | None) -> SensorModelFindings | None:
    if record is None:
        return None
    sites = tuple(SiteFront(**dict(one) | {"costs": _costs(Cost, one["costs"])}) for one in record["sites"])
    own = record["precision"]
    if own is not None:
        estimates = {
            name: {way: IntervalEstimate(one["value"], *_ends(one)) for way, one in part.items()}
            for name, part in own.items()
            if name in {"precision", "change"}
        }
        own = PrecisionFront(**own | {"costs": _costs(Cost, own["costs"])} | estimates)
    return SensorModelFindings(**dict(record) | {"sites": sites, "precision": own})


def _with_tuples(record: Mapping[str, Any]) -> dict[str, Any]:
    return {name: tuple(part) if isinstance(part, list) else part for name, part in record.items()}


AnyCost = TypeVar("AnyCost", Cost, ScanCost)


def _costs(kind: type[AnyCost], record: Mapping[str, Any]) -> dict[str, AnyCost]:
    return {way: kind(**_fields(kind, cost) | {"expense": Expense(**cost["expense"])}) for way, cost in record.items()}


def _fields(kind: type[Any], record: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries of a record that are fields of a dataclass; the others are derived from them."""
    return {field.name: record[field.name] for field in fields(kind)}


def _ends(estimate: Mapping[str, Any]) -> Interval:
    return (-math.inf if estimate["low"] is None else estimate["low"]), _infinite(estimate["high"])


def _infinite(value: float | None) -> float:
    return math.inf if value is None else value


def _finite(value: Any) -> Any:  # noqa: ANN401 - whatever JSON can hold
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
