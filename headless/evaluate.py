"""Coverage, price and average precision of sensor types × numbers, on any scene.

python -m headless.evaluate scenes/junction.blend -o out/evaluation
blender -b --python-exit-code 1 site.blend -P headless/evaluate.py -- --traffic run-*.npz -o out/evaluation

Needs torch (make detection). An evaluation that was stopped goes on where it was.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime, survey
from headless.claims import save_claims
from headless.coverage_study.cells import COUNTS
from headless.detection import case_study, study_results
from headless.detection.average_precision import too_few_runs
from headless.detection.claims import detection_claims
from headless.detection.detector import check_device
from headless.detection.recordings import SensorConfiguration, Simulator
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.options import add_rolling_shutter, new_parser

import bpy

from seip_addon.core.errors import SeipError
from seip_addon.core.placement.objective import Objective, check_objective
from seip_addon.core.results.placement_record import versions
from seip_addon.core.robustness.traffic_instants import check_runs
from seip_addon.core.scans import ScanSettings
from seip_addon.core.workflows.survey import Survey


def main(argv: list[str]) -> None:
    """Place, simulate, train, evaluate, and write charts and tables to a folder."""
    options = _parser().parse_args(argv)
    if options.seeds < 1:
        raise SeipError(f"ask for one training or more, not {options.seeds}")
    study = prepare_study(options)
    watch, simulator, folder = study.stopwatch, study.simulator, options.output
    network = NetworkSettings()
    steps = case_study.simulate_training_set(simulator, study.configurations, study.traffic, network)
    training_set = watch.run("simulation", steps)
    models = case_study.model_configurations(
        study.configurations,
        network,
        TrainingSettings(steps=options.steps),
        seeds=options.seeds,
        separate=options.separate,
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
        settings = study.surveyed.settings.as_record() | {"seeds": options.seeds, "frames_every_s": options.every}
        study_results.save_record(
            folder / "evaluation.json", results, claims, settings, versions(blender=bpy.app.version_string)
        )
        save_claims(folder / "claims_5_to_9.md", claims, site.name)
    for line in study_results.in_words(results):
        runtime.print_line(line)
    for claim in claims:
        runtime.print_line(claim.describe())
    runtime.print_line(", ".join(f"{what} {seconds:.0f} s" for what, seconds in watch.seconds.items()))
    runtime.print_line(f"written to {folder}/")


@dataclass(frozen=True, eq=False)
class DetectionStudy:
    """A scene with its placements and its traffic, ready for detectors.

    Parameters
    ----------
    configurations : tuple of SensorConfiguration
        1, 2 and 4 sensors of each type.
    """

    surveyed: Survey
    stopwatch: survey.Stopwatch
    traffic: case_study.Traffic
    configurations: tuple[SensorConfiguration, ...]
    simulator: Simulator


def prepare_study(options: argparse.Namespace) -> DetectionStudy:
    """Survey the scene, read its traffic and place the sensors; the options are those of `add_options`."""
    check_device(options.device)
    if options.every <= 0:
        raise SeipError(f"the time between frames must be above 0 s, not {options.every:g} s")
    surveyed, watch = survey.survey(
        options, lambda layout: check_objective(layout.site, layout.models, Objective(count=COUNTS[-1]))
    )
    paths = options.traffic or survey.runs_beside(options.scene)
    traffic = case_study.read_traffic(paths, surveyed.geometry.origin, options.every)
    check_runs([run.trajectories for runs in vars(traffic).values() for run in runs], surveyed.site.region)
    runtime.LOG.info(traffic.overlap())
    runtime.LOG.info(traffic.shared_bays())
    runtime.warn(filter(None, [too_few_runs(len(traffic.test))]))
    configurations = watch.run("placements", case_study.place_all(surveyed))
    scans = ScanSettings(seed=options.scan_seed, rolling_shutter=options.rolling_shutter, engine=options.engine)
    simulator = Simulator(surveyed.geometry, scans)
    return DetectionStudy(surveyed, watch, traffic, configurations, simulator)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of a survey and of what detectors learn from to a command."""
    survey.add_options(parser)
    detection = parser.add_argument_group("detection")
    detection.add_argument(
        "--traffic",
        nargs="+",
        type=Path,
        default=[],
        metavar="NPZ",
        help=f"runs of traffic: {case_study.SPLIT} (those in the folder SCENE_traffic beside the scene)",
    )
    detection.add_argument("--every", type=float, default=2.5, metavar="S", help="time from frame to frame")
    detection.add_argument("--steps", type=int, default=TrainingSettings().steps, help="of each training")
    detection.add_argument("--scan-seed", type=int, default=0, help="of noise and lost returns")
    add_rolling_shutter(detection)
    detection.add_argument("--device", default="cpu", help="of torch: cpu or cuda")


def _parser() -> argparse.ArgumentParser:
    what = "Find out what 1, 2 and 4 sensors of each type detect; name types from the simplest to the best."
    parser = new_parser("evaluate", what)
    add_options(parser)
    parser.add_argument("--seeds", type=int, default=3, metavar="N", help="trainings, each with a seed of its own")
    parser.add_argument("--separate", action="store_true", help="a detector for each placement, not one for all")
    parser.add_argument("--ablation", action="store_true", help="claim 9: also train with zero-padded pillars")
    return parser


if __name__ == "__main__":
    runtime.run(main)
