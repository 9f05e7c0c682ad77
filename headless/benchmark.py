"""Measure visibility, placement and their growth against what else one could do; write charts, a page and a JSON file.

python -m headless.benchmark scenes/junction.blend -o docs
"""

from __future__ import annotations

import argparse
import importlib.metadata
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from headless import session
from headless.measures.approximations import approximations
from headless.measures.growth import Growth, Scaled, placement_growth, repeated, visibility_growth
from headless.measures.placement import Run, compare
from headless.measures.report import Findings, bars, save_json, save_page
from headless.measures.rivals import RIVALS
from headless.measures.streets import street_problem
from headless.measures.visibility import (
    COUNT,
    ENGINES,
    Cost,
    Harm,
    cast_rate,
    harms,
    sampled_places,
    visibility_costs,
)

import bpy
import numpy as np

from seip_addon.core.candidates import CandidateSettings
from seip_addon.core.goal import Goal, placement_problem
from seip_addon.core.lidar import LidarModel, find_models, load_catalogue
from seip_addon.core.pictures.benchmark_charts import save_growth_chart, save_trade_off_chart
from seip_addon.core.progress import finish
from seip_addon.core.scene_geometry import SceneGeometry
from seip_addon.core.site import Site, make_site
from seip_addon.core.trade_off import Way
from seip_addon.core.visibility.grid import VisibilitySettings, compute_visibility
from seip_addon.core.visibility.ray_casting import make_ray_caster
from seip_addon.scene.read import read_scene

DEFAULT_WAY = "lazy embree"
ENGINE_NAMES = {"bvh": "BVHTree", "embree": "Embree"}


@dataclass(frozen=True)
class Scope:
    """What is measured: how the scene is laid out, how large synthetic instances and the steps of growth are.

    Parameters
    ----------
    layout : CandidateSettings
    street : tuple of int
        Positions (three poses at each), targets, blocks along a side.
    counts : tuple of int
        Few and many sensors there.
    largest : tuple of int
        As ``street``, with many sensors.
    places : int
        From so many places growth is looked at.
    multiples : tuple of int
        Of the places, and of what grows in the streets.
    copies : tuple of int
        Of the scene, in a row.
    spacings : tuple of float, metres
        Of the targets.
    """

    layout: CandidateSettings = field(default_factory=CandidateSettings)
    street: tuple[int, int, int] = (333, 5000, 3)
    counts: tuple[int, int] = (4, 16)
    largest: tuple[int, int, int] = (1000, 20000, 8)
    places: int = 8
    multiples: tuple[int, ...] = (1, 2, 4, 8)
    copies: tuple[int, ...] = (1, 2, 4, 8, 16)
    spacings: tuple[float, ...] = (4.0, 2.0, 1.0, 0.5)


def main(argv: list[str], scope: Scope | None = None) -> None:
    """Measure, and write the results into a folder; tests give a small ``scope``."""
    parser = argparse.ArgumentParser(
        prog="benchmark", description=__doc__.splitlines()[0], formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("scene", type=Path, help="the .blend")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for benchmark.md and benchmark/")
    parser.add_argument("--places", type=int, default=12, help="how many places are sampled; a full scan takes seconds")
    parser.add_argument("--time-limit", type=float, default=60.0, help="for each answer of a solver, in seconds")
    options = parser.parse_args(argv)
    session.check_folder(options.output / "benchmark")
    session.open_scene(options.scene)
    findings, names = measure(
        read_scene(bpy.context.scene).geometry, options.places, options.time_limit, scope or Scope()
    )
    held = bars(findings.costs, findings.runs, names)
    for bar in held:
        session.say(f"{bar.what}: asked {bar.asked}, measured {bar.measured}{'' if bar.met else ' – NOT MET'}")
    with session.writing(options.output):
        write(options.output, findings)
        save_json(options.output / "benchmark" / "benchmark.json", findings, held)
        save_page(options.output / "benchmark.md", findings, held, "benchmark")
    session.say(f"results: {options.output / 'benchmark.md'}")


def measure(
    geometry: SceneGeometry, samples: int, time_limit: float, scope: Scope
) -> tuple[Findings, tuple[str, str, str]]:
    """Measure everything; return the findings and the names of the synthetic instances."""
    layout, settings = scope.layout, VisibilitySettings()
    site = make_site(geometry, layout)
    models = find_models(load_catalogue(), layout.sensors)
    simpler = approximations(geometry, site, models, layout)
    session.say(f"{site.name}: full scans and lazy ones from {samples} places")
    costs = visibility_costs(site, models, settings, samples, simpler)
    for way, cost in costs.items():
        session.say(f"{way:<24}{cost.seconds:>9.3f} s of CPU{cost.rays:>12,} rays")
    session.say("whole grids, exact and simplified, and a placement by each")
    harm = harms(site, models, settings, simpler, time_limit / 2)
    rates = {engine: cast_rate(make_ray_caster(site.triangles, engine), site.candidates.xyz[0]) for engine in ENGINES}
    limits = {str(engine): c.seconds * rates[engine] / c.seen for engine in ENGINES for c in [costs[f"lazy {engine}"]]}
    runs, names = placements(site, models, settings, time_limit, scope)
    growths = growth(geometry, settings, time_limit, scope)
    setting = {
        "scene": site.name,
        "targets": len(site.targets),
        "poses": len(site.candidates),
        "triangles": len(site.triangles),
        "places": len(sampled_places(site, samples)),
        "sensor": layout.sensors[0],
        "count": COUNT,
        "time_limit": time_limit,
        "cores": os.cpu_count(),
        "versions": {name: importlib.metadata.version(name) for name in ("bpy", "numpy", "embreex", "PuLP", "highspy")},
    }
    return Findings(setting, costs, harm, limits, runs, growths), names


def placements(
    site: Site, models: dict[str, LidarModel], settings: VisibilitySettings, time_limit: float, scope: Scope
) -> tuple[list[Run], tuple[str, str, str]]:
    """Compare ways to place sensors at the scene's site and in synthetic streets."""
    own = site.candidates.sensor == site.candidates.sensor[0]
    visible = finish(compute_visibility(site, models, settings)).visible
    problem = placement_problem(site, visible, models, Goal(count=COUNT))
    problem = replace(
        problem,
        visible=visible[own],
        prices=problem.prices[own],
        positions=problem.positions[own],
        xyz=problem.xyz[own],
        labels=problem.labels[own],
        mandatory=None,
        mandatory_names=None,
        forbidden=None,
    )
    runs = compare(
        f"{site.name}, {site.candidates.sensor[0]}, N = {COUNT}", problem, list(RIVALS), time_limit, session.say
    )
    names = []
    for count in scope.counts:
        names.append(_street_name(scope.street, count))
        positions, targets, blocks = scope.street
        street = street_problem(positions, targets, blocks=blocks, count=count)
        runs += compare(names[-1], street, list(RIVALS), time_limit, session.say)
    names.append(_street_name(scope.largest, scope.counts[-1]))
    positions, targets, blocks = scope.largest
    street = street_problem(positions, targets, blocks=blocks, count=scope.counts[-1])
    runs += compare(names[-1], street, ("greedy", "local search", "ours"), 2 * time_limit, session.say)
    return runs, (names[0], names[1], names[2])


def growth(geometry: SceneGeometry, settings: VisibilitySettings, time_limit: float, scope: Scope) -> list[Growth]:
    """Let one thing grow at a time, then all together: the scene set side by side to a corridor."""
    session.say("growth, each size in a process of its own")
    models = find_models(load_catalogue(), scope.layout.sensors)
    site = make_site(geometry, scope.layout)
    rows = {copies: repeated(site, copies) for copies in scope.copies}
    pitch = float(np.ptp(site.triangles[:, :, 0])) / 1000
    every = len(sampled_places(site, len(site.candidates)))
    finer = [make_site(geometry, scope.layout, spacing) for spacing in scope.spacings]
    positions, targets, blocks = scope.street
    posts = [positions * times // scope.multiples[-1] for times in scope.multiples]
    points = [targets * times // 2 for times in scope.multiples]
    found = [
        visibility_growth(
            "visibility",
            "places",
            [Scaled(n, site, n) for n in (scope.places * times for times in scope.multiples)],
            models,
            settings,
        ),
        visibility_growth(
            "visibility", "targets", [Scaled(len(s.targets), s, scope.places) for s in finer], models, settings
        ),
        visibility_growth(
            "visibility",
            "triangles",
            [Scaled(len(r.triangles), replace(site, triangles=r.triangles), scope.places) for r in rows.values()],
            models,
            settings,
        ),
        visibility_growth(
            "visibility of a corridor",
            "kilometres (poses, targets, triangles)",
            [Scaled(c * pitch, row, scope.places, c * every / scope.places) for c, row in rows.items()],
            models,
            settings,
        ),
        placement_growth("poses", [3 * n for n in posts], [(n, targets, blocks) for n in posts], time_limit),
        placement_growth("targets", points, [(positions, n, blocks) for n in points], time_limit),
    ]
    for one in found:
        session.say(f"{one.what} against {one.size_of}: exponent {one.time_exponent:.2f}")
    return found


def write(folder: Path, findings: Findings) -> None:
    """Draw the charts."""
    pictures = folder / "benchmark"
    harm, setting = findings.harms, findings.setting
    save_trade_off_chart(
        pictures / "visibility.png",
        {
            "wrong pairs of pose and target, per seen pair": [
                _way(n, c, _harm(harm, n).wrong) for n, c in findings.costs.items()
            ],
            "coverage lost by the placement (share of targets)": [
                _way(n, c, max(0.0, harm["exact"].coverage - _harm(harm, n).coverage))
                for n, c in findings.costs.items()
            ],
        },
        f"Visibility of {setting['scene']}: processor time of {setting['places']} sampled places against error",
        "full: every ray cast · lazy: only rays that can matter, the same grid as the full scan's, bit for bit",
        nought=1e-3,
    )
    instances = dict.fromkeys(run.instance for run in findings.runs)
    save_trade_off_chart(
        pictures / "placement.png",
        {f"gap: {name}": _ways_to_place(findings.runs, name) for name in instances},
        f"Placement: processor time against the gap to the best bound, {setting['time_limit']:g} s for each",
        "the largest instance: twice that",
        nought=1e-4,
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


def _way(name: str, cost: Cost, error: float) -> Way:
    scan, _, what = name.partition(" ")
    family = f"{'exact' if what in ENGINES else 'simplified, Embree'}, {scan}"
    return Way(ENGINE_NAMES.get(what, what), family, cost.seconds, error, default=name == DEFAULT_WAY)


def _harm(harm: Mapping[str, Harm], way: str) -> Harm:
    what = way.partition(" ")[2]
    return harm["exact"] if what in ENGINES else harm[what]


def _ways_to_place(runs: Sequence[Run], instance: str) -> list[Way]:
    return [
        Way(run.way, run.way, run.expense.cpu, run.gap, default=run.way == "ours")
        for run in runs
        if run.instance == instance and run.objective > 0
    ]


def _street_name(street: tuple[int, int, int], count: int) -> str:
    return f"{3 * street[0]:,} × {street[1]:,}, N = {count}"


if __name__ == "__main__":
    session.run(main)
