"""Reproduce the paper's own case study on a map of the user, and write a page that compares the figures.

seip study paper Town05.xodr --junction 965 -o docs
blender -b --python-exit-code 1 -P headless/study.py -- paper Town05.xodr --junction 965 -o docs

Needs torch (make detection), and SUMO (make sumo) unless runs of traffic are given. Trained detectors are stored in the
work folder: rerun the command to resume.
"""

import argparse
from pathlib import Path

from headless import build_scene, runtime
from headless.detection.average_precision import average_precision_interval
from headless.detection.settings import TrainingSettings
from headless.options import new_parser, real_number, whole_number
from headless.studies.coverage.cells import COUNTS, CoverageStudy, coverage_study
from headless.studies.coverage.charts import save_height_chart
from headless.studies.coverage.claims import coverage_claims
from headless.studies.detection import command as detection
from headless.studies.detection.case_study import MIN_RUNS, SensorConfiguration
from headless.studies.detection.claims import detection_claims
from headless.studies.detection.results import StudyResults
from headless.studies.paper.page import HEIGHTS, PlacementFigures, page
from headless.studies.survey_options import study_parser

import bpy
import numpy as np

from seip_addon.core.base.counts import counted
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.limits import Limits
from seip_addon.core.programs.sumo_programs import find_sumo
from seip_addon.core.site.candidates import PAPER_TYPES
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.storage.files import whole_file
from seip_addon.core.workflows.survey import Survey
from seip_addon.core.workflows.traffic_runs import traffic_folder
from seip_addon.core.workflows.traffic_simulation import SimulationSettings, simulate_runs
from seip_addon.core.world.traffic_simulation.demand import Demand
from seip_addon.scene.read import read_scene

CHART = "pictures/paper_heights.png"
"""Chart of coverage by type, height and number, as seen from the page."""


def main(argv: list[str]) -> None:
    """Build the scene, draw traffic, place, train, evaluate, and write the page."""
    options = _parser().parse_args(argv)
    training = TrainingSettings() if options.steps is None else TrainingSettings(steps=options.steps)
    if not options.traffic:
        find_sumo()
    for path in (options.map, *options.traffic):
        if not path.is_file():
            raise SeipError(f"there is no file {path}: check its path")
    for folder in (options.work, options.output / "pictures"):
        runtime.check_folder(folder)

    scene = options.work / "site.blend"
    geometry = _built(options, scene)
    runs = options.traffic or _simulated(options, scene, geometry)
    site = detection.prepare_site(_detection_options(options, scene, runs))
    surveyed, watch = site.surveyed, site.stopwatch
    limits = surveyed.settings.limits
    study = watch.run("study", coverage_study(surveyed.site, surveyed.models, surveyed.grid.visible, limits))
    results = detection.run_study(
        site, _placements(study), options.work, training=training, seeds=options.trainings, device=options.device
    )
    claims = (*coverage_claims(study), *detection_claims([one.seed_result for one in results.outcomes]))
    facts = _facts(surveyed, runs, training, options)
    with runtime.incomplete_if_interrupted(options.output):
        save_height_chart(options.output / CHART, study, results.name)
        text = page(_command(options), facts, study, claims, _figures(results), CHART)
        with whole_file(options.output / "paper.md") as temporary:
            temporary.write_text(text, encoding="utf-8")
    for claim in sorted(claims, key=lambda claim: claim.number):
        runtime.print_line(claim.describe())
    runtime.print_line(", ".join(f"{what} {seconds:.0f} s" for what, seconds in watch.seconds.items()))
    runtime.print_line(f"written to {options.output / 'paper.md'}")


def _built(options: argparse.Namespace, scene: Path) -> SceneGeometry:
    arguments = [str(options.map), "--junction", *options.junction, "-o", str(scene)]
    if options.site is not None:
        arguments += ["--site", str(options.site)]
    if options.approaches is not None:
        arguments += ["--approaches", f"{options.approaches:g}"]
    build_scene.main(arguments)
    return read_scene(bpy.context.scene).geometry


def _simulated(options: argparse.Namespace, scene: Path, geometry: SceneGeometry) -> list[Path]:
    """Simulate runs of traffic without pedestrians next to the scene, as the paper has none."""
    folder = traffic_folder(scene)
    folder.mkdir(exist_ok=True)
    settings = SimulationSettings(Demand(pedestrians=0.0), duration=options.duration)
    return list(runtime.finish_with_bar(simulate_runs(options.map, settings, options.runs, geometry, folder)).paths)


def _detection_options(options: argparse.Namespace, scene: Path, runs: list[Path]) -> argparse.Namespace:
    """Return the options of the detection study for the scene."""
    parser = study_parser("detection", "")
    detection.add_options(parser)
    arguments = [str(scene), "-o", str(options.work), "--traffic", *map(str, runs), "--every", f"{options.every:g}"]
    arguments += ["--sensor", *PAPER_TYPES, "--heights", *(f"{height:g}" for height in HEIGHTS)]
    arguments += ["--effort", f"{options.effort:g}", "--device", options.device]
    return parser.parse_args(arguments)


def _placements(study: CoverageStudy) -> tuple[SensorConfiguration, ...]:
    """Return the vanilla placements of a coverage study with free heights."""
    cases = [study.find(sensor, count) for sensor in study.sensors for count in COUNTS]
    if any(case is None for case in cases):
        raise SeipError(
            "there are too few positions for four sensors of each type: add pavements, poles or --approaches"
        )
    return tuple(SensorConfiguration.of_case(case) for case in cases if case is not None)


def _figures(results: StudyResults) -> list[PlacementFigures]:
    figures = []
    for cell in results.cells:
        own = [one for one in results.outcomes if one.configuration.name == cell.name]
        interval = average_precision_interval(own[0].evaluation)
        false = float(np.mean([one.seed_result.false_positives for one in own]))
        figures.append(PlacementFigures(cell.name, cell.sensor, cell.count, cell.coverage, cell.mean, interval, false))
    return figures


def _command(options: argparse.Namespace) -> str:
    steps = "" if options.steps is None else f"--steps {options.steps} "
    return (
        f"seip study paper {options.map.name} --junction {' '.join(options.junction)} {steps}"
        f"--trainings {options.trainings} --every {options.every:g} --effort {options.effort:g} -o docs"
    )


def _facts(
    surveyed: Survey, runs: list[Path], training: TrainingSettings, options: argparse.Namespace
) -> dict[str, str]:
    """Return the entries of the table of differences."""
    geometry = surveyed.geometry
    hidden = (
        f"{len(geometry.occluders)} objects block the view" if geometry.occluders else "nothing on it blocks the view"
    )
    source = "given" if options.traffic else f"of {options.duration:g} s, simulated by SUMO with this program's demand"
    return {
        "scene": f"only the OpenDRIVE map, {geometry.region.area:,.0f} m² around junction "
        f"{' '.join(options.junction)}; {hidden}",
        "criterion": f"δ = {surveyed.settings.visibility.delta:g} m, a grid of "
        f"{surveyed.settings.grid_spacing:g} m, {len(surveyed.site.candidates.position)} positions on pavements and "
        "poles",
        "traffic": f"{len(runs)} runs {source}",
        "training": f"{training.steps} steps on frames {options.every:g} s apart, "
        f"{counted(options.trainings, 'training')}",
    }


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("seip study paper", "Reproduce the paper's case study on your map, and compare the figures.")
    parser.add_argument("map", type=Path, help="the OpenDRIVE map (.xodr): Town05 of CARLA for the paper's case")
    parser.add_argument(
        "--junction", nargs="+", required=True, metavar="NAME", help="id, name or streets of the junction"
    )
    parser.add_argument(
        "--traffic", nargs="+", type=Path, default=[], metavar="NPZ", help="runs of traffic (simulated by SUMO)"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the page and its pictures")
    parser.add_argument(
        "--work", type=Path, default=Path("out/paper"), help="folder for finished work, from which a rerun resumes"
    )
    parser.add_argument(
        "--site", type=Path, metavar="TOML", help="site description, for objects that the map does not contain"
    )
    parser.add_argument(
        "--approaches", type=float, metavar="M", help="length of the streets in the region, metres (80)"
    )
    parser.add_argument(
        "--effort",
        type=float,
        default=60.0,
        metavar="UNITS",
        help="limit of the search for each placement, in counted work",
    )
    parser.add_argument(
        "--runs", type=whole_number(Limits(MIN_RUNS, 999)), default=16, metavar="N", help="number of simulated runs"
    )
    parser.add_argument(
        "--duration", type=real_number(Limits(3, 3600)), default=40.0, metavar="S", help="duration of each run, seconds"
    )
    detection.add_training_options(parser.add_argument_group("detection"))
    return parser
