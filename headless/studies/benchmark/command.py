"""Benchmark of visibility, placement and scans: a page with speed and gaps to bounds.

seip study benchmark scenes/junction.blend -o docs
"""

import argparse
import importlib.metadata
import logging
import os
from dataclasses import dataclass, field, replace
from pathlib import Path

from headless import runtime
from headless.studies.benchmark.placement import METHODS, SolverRun, compare
from headless.studies.benchmark.report import Findings, requirements, save_page
from headless.studies.benchmark.scans import scan_costs
from headless.studies.benchmark.street_visibility import street_problem
from headless.studies.benchmark.visibility import sampled_poses, visibility_costs

import bpy

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.sensing.lidar.catalogue import find_models, load_catalogue
from seip_addon.core.sensing.lidar.model import fields_of_view
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.site.candidates import PAPER_TYPES, CandidateSettings
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.site.site import make_site
from seip_addon.scene.read import read_scene

LOG = logging.getLogger(__name__)

SITE_SENSORS = 4
"""Number of sensors that are placed at the scene's site."""

LARGEST_METHODS = ("local search", "ours")
"""Methods that can solve the largest instance."""


@dataclass(frozen=True)
class BenchmarkScope:
    """Sizes of the benchmark: the scene's layout and synthetic instances.

    Parameters
    ----------
    effort : float
        Limit of each solve: units of counted work, and seconds for the alternatives.
    positions : int
        Number of sampled positions at which full scans and the lazy engine are compared.
    street : tuple of int
        Positions (three poses at each), targets, and blocks along a side of the synthetic street grid.
    counts : tuple of int
        Small and large number of sensors in the street grid.
    largest : tuple of int
        Largest street grid, as ``street``; solved for the large number of sensors.
    scanned_by : str
        Type of the sensors that scan traffic.
    frames : int
        Number of scanned frames.
    """

    layout: CandidateSettings = field(default_factory=lambda: CandidateSettings(sensors=PAPER_TYPES))
    effort: float = 60.0
    positions: int = 12
    street: tuple[int, int, int] = (333, 5000, 3)
    counts: tuple[int, int] = (4, 16)
    largest: tuple[int, int, int] = (1000, 20000, 8)
    scanned_by: str = "type2"
    frames: int = 10


def main(argv: list[str], scope: BenchmarkScope | None = None) -> None:
    """Run the measurements and write the results into a folder; tests pass a small ``scope``."""
    parser = argparse.ArgumentParser(prog="benchmark", description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path, help="scene (.blend)")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for benchmark.md")
    options = parser.parse_args(argv)
    runtime.check_folder(options.output)
    runtime.open_scene(options.scene)
    findings = measure(read_scene(bpy.context.scene).geometry, scope or BenchmarkScope())
    for one in requirements(findings):
        verdict = "" if one.met else " – NOT MET"
        runtime.print_line(f"{one.quantity}: required {one.required}, measured {one.measured}{verdict}")
    with runtime.incomplete_if_interrupted(options.output):
        save_page(options.output / "benchmark.md", findings)
    runtime.print_line(f"results: {options.output / 'benchmark.md'}")


def measure(geometry: SceneGeometry, scope: BenchmarkScope) -> Findings:
    """Measure everything, in sequence."""
    settings = VisibilitySettings()
    models = find_models(load_catalogue(), scope.layout.sensors)
    site = make_site(geometry, scope.layout, fields_of_view=fields_of_view(models))
    # First: a requirement limits its memory, and memory of earlier work would hide a part.
    positions, targets, blocks = scope.largest
    street = street_problem(positions, targets, blocks=blocks, count=scope.counts[-1])
    largest = compare(_street_name(scope.largest, scope.counts[-1]), street, LARGEST_METHODS, 2 * scope.effort)
    LOG.info(f"{site.name}: full and lazy scans from {scope.positions} positions")
    visibility = visibility_costs(site, models, settings, scope.positions)
    runs = [*placement_runs(geometry, settings, scope), *largest]
    LOG.info("scans of traffic")
    scans = scan_costs(site, static_scene(geometry), load_catalogue()[scope.scanned_by], scope.frames)
    setting = {
        "scene": site.name,
        "targets": len(site.targets),
        "poses": len(site.candidates),
        "triangles": len(site.triangles),
        "positions": len(sampled_poses(site, scope.positions)),
        "scanned_by": scope.scanned_by,
        "frames": scope.frames,
        "effort": scope.effort,
        "cores": os.cpu_count(),
        "versions": {name: importlib.metadata.version(name) for name in ("bpy", "numpy", "embreex", "PuLP", "highspy")},
    }
    return Findings(setting, visibility, runs, scans)


def placement_runs(geometry: SceneGeometry, settings: VisibilitySettings, scope: BenchmarkScope) -> list[SolverRun]:
    """Compare placement methods for the scene's first type, and in street grids."""
    first = scope.layout.sensors[0]
    models = find_models(load_catalogue(), [first])
    layout = replace(scope.layout, sensors=(first,))
    site = make_site(geometry, layout, fields_of_view=fields_of_view(models))
    visible = finish(compute_visibility(site, models, settings)).visible
    problem = placement_problem(site, visible, models, Objective(count=SITE_SENSORS))
    problem = replace(problem, mandatory=None, mandatory_names=None, forbidden=None)  # which plain methods do not know
    runs = compare(f"{site.name}, {first}, N = {SITE_SENSORS}", problem, list(METHODS), scope.effort)
    for count in scope.counts:
        positions, targets, blocks = scope.street
        street = street_problem(positions, targets, blocks=blocks, count=count)
        runs += compare(_street_name(scope.street, count), street, list(METHODS), scope.effort)
    for run in runs:
        seconds = f"{run.expense.cpu:>8.2f} s of CPU"
        LOG.info(f"{run.instance}: {run.method:<13}{run.objective:>10.0f} ≤ {run.bound:<10.1f}{seconds}")
    return runs


def _street_name(street: tuple[int, int, int], count: int) -> str:
    return f"{3 * street[0]:,} × {street[1]:,}, N = {count}"
