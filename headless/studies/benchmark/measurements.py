"""The measurements of the benchmark, in sequence."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import logging
import os
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from headless import runtime
from headless.studies.benchmark.approximations import approximations, with_triangles
from headless.studies.benchmark.baselines import BASELINES, can_run
from headless.studies.benchmark.fresh_process import in_fresh_process
from headless.studies.benchmark.growth import (
    Growth,
    ScaledSite,
    placement_growth,
    relaxation_growth,
    repeated,
    visibility_growth,
)
from headless.studies.benchmark.placement import SolverRun, compare
from headless.studies.benchmark.report import Findings
from headless.studies.benchmark.scans import scan_costs
from headless.studies.benchmark.sensor_models import DIVERGENCE, SensorModelFindings, sensor_models, site_front
from headless.studies.benchmark.street_visibility import street_problem
from headless.studies.benchmark.visibility import (
    ENGINES,
    SENSOR_COUNT,
    cast_rate,
    degradations,
    sampled_places,
    visibility_costs,
)
from headless.studies.coverage.cells import COUNTS
from headless.survey import runs_beside

import bpy
import numpy as np

from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.progress import Progress, finish
from seip_addon.core.sensing.lidar.catalogue import find_models, load_catalogue
from seip_addon.core.sensing.lidar.model import LidarModel, fields_of_view
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.site.candidates import PAPER_TYPES, CandidateSettings
from seip_addon.core.site.obstruction import bareness_warnings
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.site.site import Site, make_site
from seip_addon.core.workflows.survey import lay_out, with_grid
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.scene.read import read_scene

LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class BenchmarkScope:
    """Sizes of the benchmark: the scene's layout, synthetic instances and steps of growth.

    Parameters
    ----------
    street : tuple of int
        Positions (three poses at each), targets, and blocks along a side of the synthetic street grid.
    counts : tuple of int
        Small and large number of sensors in the street grid.
    largest : tuple of int
        Largest street grid, as ``street``; solved for the large number of sensors.
    places : int
        Number of positions in the measurements of growth.
    multiples : tuple of int
        Multiples of ``places``, and of the size that grows in the street grids.
    copies : tuple of int
        Numbers of copies of the scene in a row.
    spacings : tuple of float, metres
        Spacings of the targets.
    scanned_by : str
        Type of the sensors that scan traffic.
    frames : int
        Number of scanned frames.
    modelled : str
        LiDAR type of the compared sensor models.
    placements : int
        Number of random placements for each number of sensors.
    every_beam : int
        Number of poses at which the lazy engine is compared with casting every diverging beam.
    """

    layout: CandidateSettings = field(default_factory=lambda: CandidateSettings(sensors=PAPER_TYPES))
    street: tuple[int, int, int] = (333, 5000, 3)
    counts: tuple[int, int] = (4, 16)
    largest: tuple[int, int, int] = (1000, 20000, 8)
    places: int = 8
    multiples: tuple[int, ...] = (1, 2, 4, 8)
    copies: tuple[int, ...] = (1, 2, 4, 8, 16)
    spacings: tuple[float, ...] = (4.0, 2.0, 1.0, 0.5)
    scanned_by: str = "type2"
    frames: int = 10
    modelled: str = "os1_128"
    placements: int = 16
    every_beam: int = 12


def measure(
    geometry: SceneGeometry, samples: int, effort: float, scope: BenchmarkScope
) -> tuple[Findings, tuple[str, str, str]]:
    """Measure everything; return the findings and the names of the synthetic instances."""
    layout, settings = scope.layout, VisibilitySettings()
    models = find_models(load_catalogue(), layout.sensors)
    site = make_site(geometry, layout, fields_of_view=fields_of_view(models))
    simpler = approximations(geometry, site, models, layout)
    LOG.info(f"{site.name}: full and lazy scans from {samples} positions")
    costs = visibility_costs(site, models, settings, samples, simpler)
    for way, cost in costs.items():
        LOG.info(f"{way:<24}{cost.seconds:>9.3f} s of CPU{cost.rays:>12,} rays")
    LOG.info("exact and simplified grids, and a placement by each")
    degradation = degradations(site, models, settings, simpler, effort)
    rates = {engine: cast_rate(make_ray_caster(site.triangles, engine), site.candidates.xyz[0]) for engine in ENGINES}
    limits = {str(engine): c.seconds * rates[engine] / c.seen for engine in ENGINES for c in [costs[f"lazy {engine}"]]}
    runs, names = placements(site, models, settings, effort, scope)
    growths = [*growth_of_visibility(geometry, settings, scope), *growth_of_placement(effort, scope)]
    LOG.info("scans of traffic")
    scans = scan_costs(site, static_scene(geometry), load_catalogue()[scope.scanned_by], scope.frames)
    setting = {
        "scene": site.name,
        "targets": len(site.targets),
        "poses": len(site.candidates),
        "triangles": len(site.triangles),
        "places": len(sampled_places(site, samples)),
        "sensor": layout.sensors[0],
        "count": SENSOR_COUNT,
        "scanned_by": scope.scanned_by,
        "effort": effort,
        "cores": os.cpu_count(),
        "versions": {name: importlib.metadata.version(name) for name in ("bpy", "numpy", "embreex", "PuLP", "highspy")},
    }
    return Findings(setting, costs, degradation, limits, runs, growths, scans), names


def with_placement(
    findings: Findings, geometry: SceneGeometry, effort: float, scope: BenchmarkScope
) -> tuple[Findings, tuple[str, str, str]]:
    """Measure placement and its growth again; return the findings with these, and the names as `measure` does."""
    models = find_models(load_catalogue(), scope.layout.sensors)
    site = make_site(geometry, scope.layout, fields_of_view=fields_of_view(models))
    runs, names = placements(site, models, VisibilitySettings(), effort, scope)
    others = [one for one in findings.growths if one.what.startswith("visibility")]
    return replace(
        findings,
        setting={**findings.setting, "effort": effort},
        runs=runs,
        growths=[*others, *growth_of_placement(effort, scope)],
    ), names


def compare_sensor_models(
    scenes: Sequence[Path], effort: float, scope: BenchmarkScope, *, seed: int, steps: int, work: Path
) -> Generator[Progress, None, SensorModelFindings]:
    """Measure models of one LiDAR on scenes; if the first has traffic and PyTorch is installed, detection, too.

    Parameters
    ----------
    effort : float, units of counted work
        Limit of each best placement.
    seed : int
        Seed for placements, scans and the training.
    steps : int
        Training steps of the detector.
    work : path
        Folder of the detector.

    Yields
    ------
    Progress
    """
    models = sensor_models(load_catalogue()[scope.modelled])
    settings = SurveySettings(replace(scope.layout, sensors=(scope.modelled,)))
    sites, precision = [], None
    for number, scene in enumerate(scenes):
        yield Progress(number, len(scenes), f"models of the sensor in {scene.name}")
        runtime.open_scene(scene)
        layout = lay_out(read_scene(bpy.context.scene).geometry, settings)
        amount = {"placements": scope.placements, "checked": scope.every_beam, "seed": seed}
        front = site_front(layout.site, models, counts=COUNTS, effort=effort, **amount)
        sites.append(replace(front, bare=bool(bareness_warnings(layout.geometry))))
        runs = runs_beside(scene)
        if number == 0 and runs and importlib.util.find_spec("torch"):
            from headless.detection.settings import TrainingSettings  # noqa: PLC0415 -- needs torch
            from headless.studies.benchmark.sensor_precision import precision_front  # noqa: PLC0415 -- needs torch

            grid = yield from compute_visibility(layout.site, layout.models, settings.visibility)
            training = TrainingSettings(steps=steps, seed=seed)
            surveyed = with_grid(layout, grid)
            study = precision_front(surveyed, models, runs, work, count=COUNTS[-1], training=training)
            precision = yield from study
    return SensorModelFindings(scope.modelled, DIVERGENCE, scope.placements, tuple(sites), precision, seed)


def placements(
    site: Site, models: dict[str, LidarModel], settings: VisibilitySettings, effort: float, scope: BenchmarkScope
) -> tuple[list[SolverRun], tuple[str, str, str]]:
    """Compare placement methods on the scene's site and in synthetic streets."""
    own = site.candidates.sensor == site.candidates.sensor[0]
    visible = finish(compute_visibility(site, models, settings)).visible
    problem = placement_problem(site, visible, models, Objective(count=SENSOR_COUNT))
    problem = replace(
        problem,
        amounts=visible[own],
        prices=problem.prices[own],
        positions=problem.positions[own],
        xyz=problem.xyz[own],
        labels=problem.labels[own],
        mandatory=None,
        mandatory_names=None,
        forbidden=None,
    )
    ways = [way for way in BASELINES if can_run(way)]
    for way in set(BASELINES).difference(ways):
        LOG.info(f"{way} is left out: to include it, install the group 'benchmark' of pyproject.toml")
    runs = _logged(compare(f"{site.name}, {site.candidates.sensor[0]}, N = {SENSOR_COUNT}", problem, ways, effort))
    names = []
    for count in scope.counts:
        names.append(_street_name(scope.street, count))
        positions, targets, blocks = scope.street
        street = street_problem(positions, targets, blocks=blocks, count=count)
        runs += _logged(compare(names[-1], street, ways, effort))
    names.append(_street_name(scope.largest, scope.counts[-1]))
    positions, targets, blocks = scope.largest
    street = street_problem(positions, targets, blocks=blocks, count=scope.counts[-1])
    quick = ("greedy", "local search", "ours")
    # in a process of its own: a requirement limits its memory, and memory of earlier work would hide a part
    runs += _logged(in_fresh_process(partial(compare, names[-1], street, quick, 2 * effort)))
    return runs, (names[0], names[1], names[2])


def growth_of_visibility(geometry: SceneGeometry, settings: VisibilitySettings, scope: BenchmarkScope) -> list[Growth]:
    """Measure growth with one size at a time, then with all: copies of the scene side by side."""
    LOG.info("growth of visibility, each size in a process of its own")
    models = find_models(load_catalogue(), scope.layout.sensors)
    site = make_site(geometry, scope.layout, fields_of_view=fields_of_view(models))
    rows = {copies: repeated(site, copies) for copies in scope.copies}
    pitch = float(np.ptp(site.triangles[:, :, 0])) / 1000
    every = len(sampled_places(site, len(site.candidates)))
    finer = [
        make_site(geometry, scope.layout, spacing, fields_of_view=fields_of_view(models)) for spacing in scope.spacings
    ]
    found = [
        visibility_growth(
            "visibility",
            "places",
            [ScaledSite(n, site, n) for n in (scope.places * times for times in scope.multiples)],
            models,
            settings,
        ),
        visibility_growth(
            "visibility", "targets", [ScaledSite(len(s.targets), s, scope.places) for s in finer], models, settings
        ),
        visibility_growth(
            "visibility",
            "triangles",
            [ScaledSite(len(r.triangles), with_triangles(site, r.triangles), scope.places) for r in rows.values()],
            models,
            settings,
        ),
        visibility_growth(
            "visibility of a corridor",
            "kilometres (poses, targets, triangles)",
            [ScaledSite(c * pitch, row, scope.places, c * every / scope.places) for c, row in rows.items()],
            models,
            settings,
        ),
    ]
    return _logged_growth(found)


def growth_of_placement(effort: float, scope: BenchmarkScope) -> list[Growth]:
    """Measure growth in street grids, with their positions and with their targets."""
    LOG.info("growth of placement, each size in a process of its own")
    positions, targets, blocks = scope.street
    posts = [positions * times // scope.multiples[-1] for times in scope.multiples]
    points = [targets * times // 2 for times in scope.multiples]
    found = [
        placement_growth("poses", [3 * n for n in posts], [(n, targets, blocks) for n in posts], effort),
        placement_growth("targets", points, [(positions, n, blocks) for n in points], effort),
        relaxation_growth([(n, targets, blocks) for n in posts]),
    ]
    return _logged_growth(found)


def _logged_growth(found: list[Growth]) -> list[Growth]:
    for one in found:
        LOG.info(f"{one.what} against {one.size_of}: exponent {one.time_exponent:.2f}")
    return found


def _logged(runs: list[SolverRun]) -> list[SolverRun]:
    for run in runs:
        LOG.info(
            f"{run.instance}: {run.way:<13}{run.objective:>10.0f} ≤ {run.bound:<10.1f}{run.expense.cpu:>8.2f} s of CPU"
            f"  {run.note}"
        )
    return runs


def _street_name(street: tuple[int, int, int], count: int) -> str:
    return f"{3 * street[0]:,} × {street[1]:,}, N = {count}"
