"""Charts of the benchmark."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from headless.studies.benchmark.pareto_front import Method
from headless.studies.benchmark.pictures import save_growth_chart, save_trade_off_chart
from headless.studies.benchmark.placement import SolverRun
from headless.studies.benchmark.report import Findings
from headless.studies.benchmark.visibility import ENGINES, Cost, Degradation

DEFAULT_ENGINE = "lazy embree"
ENGINE_NAMES = {"bvh": "BVHTree", "embree": "Embree"}


def save_charts(pictures: Path, findings: Findings) -> None:
    """Draw visibility, placement and growth into a folder, as PNG."""
    degradation, setting = findings.degradations, findings.setting
    save_trade_off_chart(
        pictures / "visibility.png",
        {
            "wrong pairs of pose and target, per seen pair": [
                _way(n, c, _degradation(degradation, n).wrong) for n, c in findings.costs.items()
            ],
            "coverage lost by the placement (share of targets)": [
                _way(n, c, max(0.0, degradation["exact"].coverage - _degradation(degradation, n).coverage))
                for n, c in findings.costs.items()
            ],
        },
        f"Visibility of {setting['scene']}: processor time of {setting['places']} sampled places against error",
        "full: every ray cast · lazy: only rays that can matter, the same grid as the full scan's, bit for bit",
        linear_below=1e-3,
    )
    instances = dict.fromkeys(run.instance for run in findings.runs)
    save_trade_off_chart(
        pictures / "placement.png",
        {f"gap: {name}": _ways_to_place(findings.runs, name) for name in instances},
        f"Placement: processor time against the gap to the best bound, {setting['effort']:g} s for each",
        "the largest instance: twice that",
        linear_below=1e-4,
    )
    lines = [(f"{g.what}, {g.size_of}", g) for g in findings.growths]
    save_growth_chart(
        pictures / "growth.png",
        {
            "processor time (s)": [(name, g.size, g.seconds) for name, g in lines],
            "memory (MB)": [
                (name, g.size, [m for m in g.memory if m]) for name, g in lines if g.memory_exponent is not None
            ],
        },
        "Growth of time and memory with size",
    )


def _way(name: str, cost: Cost, error: float) -> Method:
    scan, _, what = name.partition(" ")
    family = f"{'exact' if what in ENGINES else 'simplified, Embree'}, {scan}"
    return Method(ENGINE_NAMES.get(what, what), family, cost.seconds, error, default=name == DEFAULT_ENGINE)


def _degradation(degradation: Mapping[str, Degradation], way: str) -> Degradation:
    what = way.partition(" ")[2]
    return degradation["exact"] if what in ENGINES else degradation[what]


def _proof(run: SolverRun) -> str:
    if run.proven:
        return "proves by itself that nothing is better"
    return "has a bound of its own" if math.isfinite(run.bound) else "has no bound of its own"


def _ways_to_place(runs: Sequence[SolverRun], instance: str) -> list[Method]:
    return [
        Method(run.way, _proof(run), run.expense.cpu, run.gap, default=run.way == "ours")
        for run in runs
        if run.instance == instance and run.objective > 0
    ]
