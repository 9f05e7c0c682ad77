"""Reproduce the paper's own case study on a map and traffic of the user, and write a page that compares the figures.

seip study paper MAP.xodr --junction 965 --routes FILE.rou.xml --types vtypes.rou.xml \
    --network FILE.net.xml -o docs
blender -b --python-exit-code 1 -P headless/study.py -- paper MAP.xodr --junction 965 … -o docs

Needs torch (make detection) and SUMO (make sumo). Finished work is stored in the work folder: rerun the command to
resume.
"""

import argparse
from pathlib import Path

from headless import build_scene, runtime
from headless.detection.detector import check_device
from headless.detection.settings import TrainingSettings
from headless.options import new_parser, real_number
from headless.studies.coverage.cells import COUNTS, CoverageStudy, coverage_study
from headless.studies.coverage.charts import save_height_chart
from headless.studies.coverage.claims import coverage_claims
from headless.studies.detection import case_study
from headless.studies.detection import command as evaluate
from headless.studies.detection.results import cells
from headless.studies.paper.detection import DetectionOfCase, NearCopies, detection_of_case, placed
from headless.studies.paper.page import CaseFacts, page
from headless.studies.paper.published import HEIGHTS, PUBLISHED_SENSORS
from headless.studies.paper.traffic_runs import (
    MOST_OVERLAP,
    RunSettings,
    SiteTraffic,
    TrafficSource,
    make_runs,
    overlaps,
    read_traffic_of_site,
)
from headless.studies.precision_charts import save_count_chart, save_coverage_chart

import bpy

from seip_addon.core.counts import counted
from seip_addon.core.errors import SeipError
from seip_addon.core.limits import TIME_STEP
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.storage.files import whole_file
from seip_addon.core.sumo_programs import find_sumo
from seip_addon.core.workflows.survey import Survey
from seip_addon.scene.read import read_scene

PAGE, PICTURES = "paper.md", "pictures"
COPIES_TESTED = 4  # of the runs with fixed departures


def main(argv: list[str]) -> None:
    """Build the scene, draw traffic, place, train, evaluate, and write the page."""
    options = _parser().parse_args(argv)
    if options.trainings < 1:
        raise SeipError(f"--trainings must be 1 or more, not {options.trainings}")
    training = TrainingSettings(steps=options.steps)
    check_device(options.device)
    evaluate.check_every(options.every)
    settings = RunSettings(options.runs, options.duration, options.warm_up, options.seed)
    find_sumo()
    for path in (options.map, options.routes, *options.types, options.network):
        if not path.is_file():
            raise SeipError(f"there is no file {path}: check its path")
    for folder in (options.work, options.output / PICTURES):
        runtime.check_folder(folder)

    scene = options.work / "site.blend"
    geometry = _built(options, scene)
    source = TrafficSource(options.routes, tuple(options.types), options.network)
    traffic = runtime.finish_with_bar(read_traffic_of_site(source, geometry, options.map.name))
    drawn, fixed = (
        runtime.finish_with_bar(make_runs(scene, traffic, geometry, settings, fixed=which)) for which in (False, True)
    )
    site = evaluate.prepare_site(_evaluation(options, scene, drawn), COUNTS[-1])
    surveyed, watch = site.surveyed, site.stopwatch
    limits = surveyed.settings.limits
    study = watch.run("study", coverage_study(surveyed.site, surveyed.models, surveyed.grid.visible, limits))
    training_runs, validation_runs, tests = case_study.split_sampled(fixed, geometry.origin, options.every)
    copies = NearCopies(training_runs, validation_runs, tests[:COPIES_TESTED])
    steps = detection_of_case(
        site.simulator,
        placed(study),
        site.traffic,
        copies,
        options.work,
        training=training,
        seeds=options.trainings,
        device=options.device,
    )
    found = watch.run("detection", steps)
    facts = _facts(options, surveyed, traffic, (overlaps(drawn), overlaps(fixed)), found)
    claims = (*coverage_claims(study), *found.claims)
    with runtime.incomplete_if_interrupted(options.output):
        charts = _charts(options.output, study, found)
        text = page(facts, study, claims, found.placements, surveyed.models, charts)
        with whole_file(options.output / PAGE) as temporary:
            temporary.write_text(text, encoding="utf-8")
    for claim in sorted(claims, key=lambda claim: claim.number):
        runtime.print_line(claim.describe())
    runtime.print_line(", ".join(f"{what} {seconds:.0f} s" for what, seconds in watch.seconds.items()))
    runtime.print_line(f"written to {options.output / PAGE}")


def _built(options: argparse.Namespace, scene: Path) -> SceneGeometry:
    arguments = [str(options.map), "--junction", *options.junction, "-o", str(scene)]
    if options.site is not None:
        arguments += ["--site", str(options.site)]
    if options.approaches is not None:
        arguments += ["--approaches", f"{options.approaches:g}"]
    build_scene.main(arguments)
    return read_scene(bpy.context.scene).geometry


def _evaluation(options: argparse.Namespace, scene: Path, runs: list[Path]) -> argparse.Namespace:
    """Return the options of an evaluation of the scene."""
    parser = new_parser("study detection", "")
    evaluate.add_options(parser)
    arguments = [str(scene), "-o", str(options.work), "--traffic", *map(str, runs), "--every", f"{options.every:g}"]
    arguments += ["--sensor", *(sensor.key for sensor in PUBLISHED_SENSORS)]
    arguments += ["--heights", *(f"{height:g}" for height in HEIGHTS), "--effort", f"{options.effort:g}"]
    return parser.parse_args([*arguments, "--device", options.device])


def _facts(
    options: argparse.Namespace,
    surveyed: Survey,
    traffic: SiteTraffic,
    shares: tuple[tuple[float, ...], tuple[float, ...]],
    found: DetectionOfCase,
) -> CaseFacts:
    geometry, demand = surveyed.geometry, traffic.demand
    runs = found.results.traffic
    bare = not geometry.occluders
    hidden = "nothing on it blocks the view" if bare else f"{len(geometry.occluders)} objects block the view"
    doubts = []
    if any(case_study.still_rises(curve) for curve in found.results.curves):
        doubts.append(
            "Validation AP was still rising when a training ended: more --steps may change the figures of detection."
        )
    if found.copies_rising:
        doubts.append(
            "Validation AP was still rising when training on near copies ended: the leak may be larger than measured."
        )
    if options.trainings == 1:
        doubts.append("There is one training: a verdict on claims 5 to 8 needs three (--trainings 3).")
    junction = " ".join(options.junction)
    return CaseFacts(
        command=(
            f"seip study paper {options.map.name} --junction {junction} --routes {options.routes.name} "
            + (f"--types {' '.join(path.name for path in options.types)} " if options.types else "")
            + f"--network {options.network.name} --steps {options.steps} --trainings {options.trainings} "
            f"--every {options.every:g} --runs {options.runs} --duration {options.duration:g} "
            f"--effort {options.effort:g} -o docs"
        ),
        scene=f"only the OpenDRIVE map, {geometry.region.area:,.0f} m² around junction {junction}; {hidden}",
        criterion=(
            f"δ = {surveyed.settings.visibility.delta:g} m, a grid of {surveyed.settings.grid_spacing:g} m, "
            f"{len(surveyed.site.candidates.position)} positions on pavements and poles"
        ),
        traffic=(
            f"only SUMO, {demand.rate:,.0f} vehicles per hour ({traffic.through:,.0f} through the junction) in "
            f"{len(demand.flows)} flows; departures, routes, lanes, {len(demand.models)} models and gaps are drawn "
            f"randomly for each of {options.runs} runs of {options.duration:g} s, after a warm-up of at least "
            f"{options.warm_up:g} s; {len(runs.training)} runs for training, {len(runs.validation)} for validation, "
            f"{len(runs.test)} for tests"
        ),
        training=f"{options.steps} steps on frames {options.every:g} s apart, {counted(options.trainings, 'training')}",
        trainings=options.trainings,
        bare=bare,
        most_overlap=MOST_OVERLAP,
        overlaps=shares[0],
        copied=shares[1],
        doubts=tuple(doubts),
    )


def _charts(folder: Path, study: CoverageStudy, found: DetectionOfCase) -> list[tuple[str, str]]:
    """Draw the charts; return their paths from the page, and captions."""
    name, points = found.results.name, cells([one.seed_result for one in found.results.masked])
    charts = [
        ("paper_heights.png", "Coverage by type, height and number"),
        ("paper_ap.png", "Average precision by type and number"),
        ("paper_coverage_and_ap.png", "Average precision against coverage"),
    ]
    heights, precision, both = (folder / PICTURES / file for file, _ in charts)
    save_height_chart(heights, study, name)
    save_count_chart(precision, points, name)
    save_coverage_chart(both, points, *found.results.correlation, name)
    return [(f"{PICTURES}/{file}", caption) for file, caption in charts]


def _parser() -> argparse.ArgumentParser:
    runs = RunSettings()
    parser = new_parser(
        "study paper", "Reproduce the paper's case study on your map and traffic, and compare the figures."
    )
    parser.add_argument("map", type=Path, help="the OpenDRIVE map (.xodr): Town05 of CARLA for the paper's case")
    parser.add_argument(
        "--junction", nargs="+", required=True, metavar="NAME", help="id, name or streets of the junction"
    )
    parser.add_argument("--routes", type=Path, required=True, metavar="XML", help="SUMO's routes, with flows")
    parser.add_argument("--types", nargs="+", type=Path, default=[], metavar="XML", help="files with vehicle types")
    parser.add_argument("--network", type=Path, required=True, metavar="XML", help="network of the routes (.net.xml)")
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
    traffic = parser.add_argument_group("traffic")
    traffic.add_argument(
        "--runs", type=int, default=runs.runs, metavar="N", help="number of runs, with different seeds"
    )
    traffic.add_argument("--duration", type=float, default=runs.duration, metavar="S", help="duration of each run")
    traffic.add_argument("--warm-up", type=float, default=runs.warm_up, metavar="S", help="warm-up before each run")
    traffic.add_argument("--seed", type=int, default=runs.seed, metavar="N", help="seed of all randomness in traffic")
    traffic.add_argument(
        "--every", type=real_number(TIME_STEP), default=2.5, metavar="S", help="time between training frames"
    )
    detection = parser.add_argument_group("detection")
    detection.add_argument(
        "--steps", type=int, default=TrainingSettings().steps, metavar="N", help="steps of each training"
    )
    detection.add_argument(
        "--trainings", type=int, default=3, metavar="N", help="number of trainings, with different seeds"
    )
    detection.add_argument("--device", default="cpu", help="device of torch: cpu or cuda")
    return parser
