"""Coverage, price and average precision of sensor types × numbers, on any scene.

seip study detection scenes/junction.blend -o out/evaluation
blender -b --python-exit-code 1 site.blend -P headless/study.py -- detection --traffic run-*.npz -o out/evaluation

Needs torch (make detection). An evaluation that was stopped goes on where it was.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

from headless import runtime, survey
from headless.detection.average_precision import too_few_runs
from headless.detection.detector import SHIPPED_DETECTOR, Detector, check_device
from headless.detection.recordings import Simulator
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.options import new_parser, real_number, whole_number
from headless.studies.claims import save_claims
from headless.studies.coverage.cells import COUNTS
from headless.studies.detection import case_study
from headless.studies.detection import results as study_results
from headless.studies.detection.claims import detection_claims
from headless.studies.detection.sensor_configuration import SensorConfiguration
from headless.studies.survey_options import add_rolling_shutter, add_survey_options

import bpy

from seip_addon.core.choosing.placement.objective import Objective, check_objective
from seip_addon.core.errors import SeipError
from seip_addon.core.limits import SEED, TIME_STEP, Limits
from seip_addon.core.output.results.versions import versions
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.traffic.site_traffic import check_runs, require_own_traffic
from seip_addon.core.workflows.survey import Survey

STEPS, TRAININGS = Limits(1, 10_000_000), Limits(1, 1_000)

FINE_TUNING = TrainingSettings(steps=450, learning_rate=2e-3, validate_every=75, patience=6)
"""Training of the shipped detector's weights on a site; not stopped early, because precision drops at first."""


def main(argv: list[str]) -> None:
    """Place, simulate, train, evaluate, and write charts and tables to a folder."""
    options = _parser().parse_args(argv)
    study = prepare_study(options)
    watch, simulator, folder = study.stopwatch, study.simulator, options.output
    network = NetworkSettings()
    steps = case_study.simulate_training_set(simulator, study.configurations, study.traffic, network)
    training_set = watch.run("simulation", steps)
    training, start = _training(options)
    models = case_study.model_configurations(
        study.configurations, network, training, seeds=options.trainings, separate=options.separate, start=start
    )
    if options.ablation:
        models += case_study.padded(models)
    trained = watch.run("training", case_study.train_all(models, training_set, folder, device=options.device))
    detectors = [one.detector for one in trained]
    for name, sentences in case_study.suitability_by_configuration(simulator, models, detectors, study.traffic).items():
        runtime.warn(f"{name}: {sentence}" for sentence in sentences)
    outcomes = watch.run("evaluation", case_study.evaluate_all(simulator, models, detectors, study.traffic))
    site, curves = study.surveyed.site, tuple(one.curve for one in trained)
    results = study_results.StudyResults(site.name, simulator, study.traffic, tuple(models), tuple(outcomes), curves)
    claims = detection_claims(results.seed_results)
    with runtime.incomplete_if_interrupted(folder):
        study_results.save_charts(folder, results, trained)
        study_results.save_table(folder / "detection.csv", results)
        settings = study.surveyed.settings.as_record() | {"seeds": options.trainings, "frames_every_s": options.every}
        settings["from_scratch"] = options.from_scratch
        study_results.save_record(
            folder / "evaluation.json", results, claims, settings, versions(blender=bpy.app.version_string)
        )
        save_claims(folder / "claims_5_to_9.md", claims, site.name)
    for line in study_results.describe(results):
        runtime.print_line(line)
    for claim in claims:
        runtime.print_line(claim.describe())
    runtime.print_line(", ".join(f"{what} {seconds:.0f} s" for what, seconds in watch.seconds.items()))
    runtime.print_line(f"written to {folder}/")


def _training(options: argparse.Namespace) -> tuple[TrainingSettings, Detector | None]:
    """Return how detectors are trained, and the one that they begin with."""
    begun = TrainingSettings() if options.from_scratch else FINE_TUNING
    steps = begun.steps if options.steps is None else options.steps
    return replace(begun, steps=steps), None if options.from_scratch else Detector.load(SHIPPED_DETECTOR)


@dataclass(frozen=True, eq=False)
class DetectionSite:
    """A scene with its traffic, ready for placements and detectors."""

    surveyed: Survey
    stopwatch: survey.Stopwatch
    traffic: case_study.Traffic
    simulator: Simulator


@dataclass(frozen=True, eq=False)
class DetectionStudy(DetectionSite):
    """A scene with its placements and its traffic, ready for detectors.

    Parameters
    ----------
    configurations : tuple of SensorConfiguration
        1, 2 and 4 sensors of each type.
    """

    configurations: tuple[SensorConfiguration, ...]


def prepare_study(options: argparse.Namespace) -> DetectionStudy:
    """Survey the scene, read its traffic and place the sensors; the options are those of `add_options`."""
    site = prepare_site(options, COUNTS[-1])
    configurations = site.stopwatch.run("placements", case_study.place_all(site.surveyed))
    return DetectionStudy(**vars(site), configurations=configurations)


def prepare_site(options: argparse.Namespace, count: int) -> DetectionSite:
    """Survey a scene that can carry that number of sensors, and read its traffic."""
    check_device(options.device)
    check_every(options.every)
    surveyed, watch = survey.survey(
        options, lambda layout: check_objective(layout.site, layout.models, Objective(count=count))
    )
    paths = options.traffic or survey.runs_beside(options.scene)
    traffic = case_study.read_traffic(paths, surveyed.geometry.origin, options.every)
    runs = [run for runs in vars(traffic).values() for run in runs]
    check_runs([run.trajectories for run in runs], surveyed.site.region)
    for run in runs:
        require_own_traffic(run.trajectories, surveyed.geometry, run.name)
    runtime.LOG.info(traffic.overlap())
    runtime.LOG.info(traffic.shared_bays())
    runtime.warn(filter(None, [too_few_runs(len(traffic.test))]))
    scans = ScanSettings(seed=options.scan_seed, rolling_shutter=options.rolling_shutter)
    return DetectionSite(surveyed, watch, traffic, Simulator(surveyed.geometry, scans))


def check_every(seconds: float) -> None:
    """Raise SeipError where a time from frame to frame is not within its limits."""
    if not TIME_STEP.allow(seconds):
        raise SeipError(f"the time between frames must be {TIME_STEP}, not {seconds:g} s")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of a survey and of what detectors learn from to a command."""
    add_survey_options(parser)
    detection = parser.add_argument_group("detection")
    detection.add_argument(
        "--traffic",
        nargs="+",
        type=Path,
        default=[],
        metavar="NPZ",
        help=f"runs of traffic: {case_study.SPLIT} (those in the folder SCENE_traffic beside the scene)",
    )
    detection.add_argument(
        "--every",
        type=real_number(TIME_STEP),
        default=2.5,
        metavar="S",
        help="time from frame to frame; twice that in tests",
    )
    detection.add_argument("--steps", type=whole_number(STEPS), help="of each training")
    detection.add_argument("--scan-seed", type=whole_number(SEED), default=0, help="of noise and lost returns")
    add_rolling_shutter(detection)
    detection.add_argument("--device", default="cpu", help="of torch: cpu or cuda")


def _parser() -> argparse.ArgumentParser:
    what = "Find out what 1, 2 and 4 sensors of each type detect; name types from the simplest to the best."
    parser = new_parser("study detection", what)
    add_options(parser)
    parser.add_argument(
        "--trainings",
        type=whole_number(TRAININGS),
        default=3,
        metavar="N",
        help="each with a seed of its own",
    )
    parser.add_argument(
        "--from-scratch",
        action="store_true",
        help=f"begin trainings with random weights ({TrainingSettings().steps:,} steps), not with those of the "
        f"detector that ships ({FINE_TUNING.steps})",
    )
    parser.add_argument("--separate", action="store_true", help="a detector for each placement, not one for all")
    parser.add_argument("--ablation", action="store_true", help="claim 9: also train with zero-padded pillars")
    return parser
