"""Coverage, price and average precision of sensor types × numbers, on any scene.

seip study detection scenes/junction.blend -o out/evaluation
blender -b --python-exit-code 1 site.blend -P headless/study.py -- detection --traffic run-*.npz -o out/evaluation

Needs torch (make detection). An evaluation that was stopped resumes.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

from headless import runtime, survey
from headless.charts.detection import save_training_chart
from headless.detection.average_precision import too_few_runs
from headless.detection.detector import SHIPPED_DETECTOR, Detector, check_device
from headless.detection.recordings import Simulator
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.options import real_number, whole_number
from headless.studies.claims import save_claims
from headless.studies.coverage.cells import COUNTS
from headless.studies.detection import case_study
from headless.studies.detection.claims import detection_claims
from headless.studies.detection.results import StudyResults, describe, save_charts, save_table
from headless.studies.survey_options import study_parser

from seip_addon.core.base.limits import TIME_STEP, Limits
from seip_addon.core.choosing.placement.objective import Objective, check_objective
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.traffic.site_traffic import check_runs, require_own_traffic
from seip_addon.core.workflows.survey import Survey

STEPS, TRAININGS = Limits(1, 10_000_000), Limits(1, 1_000)

FINE_TUNING = TrainingSettings(steps=450, learning_rate=2e-3, validate_every=75, patience=6)
"""Training of the shipped detector's weights on a site; not stopped early, because precision drops at first."""


def main(argv: list[str]) -> None:
    """Place, simulate, train, evaluate, and write charts and tables to a folder."""
    options = _parser().parse_args(argv)
    site, folder = prepare_site(options), options.output
    configurations = site.stopwatch.run("placements", case_study.place_all(site.surveyed))
    training = TrainingSettings() if options.from_scratch else FINE_TUNING
    start = None if options.from_scratch else Detector.load(SHIPPED_DETECTOR)
    if options.steps is not None:
        training = replace(training, steps=options.steps)
    results = run_study(
        site, configurations, folder, training=training, seeds=options.trainings, device=options.device, start=start
    )
    claims = detection_claims([one.seed_result for one in results.outcomes])
    with runtime.incomplete_if_interrupted(folder):
        save_charts(folder, results)
        save_table(folder / "detection.csv", results)
        save_claims(folder / "claims_5_to_8.md", claims, results.name)
    for line in describe(results):
        runtime.print_line(line)
    for claim in claims:
        runtime.print_line(claim.describe())
    runtime.print_line(", ".join(f"{what} {seconds:.0f} s" for what, seconds in site.stopwatch.seconds.items()))
    runtime.print_line(f"written to {folder}/")


@dataclass(frozen=True, eq=False)
class DetectionSite:
    """A scene with its traffic, ready for placements and detectors."""

    surveyed: Survey
    stopwatch: survey.Stopwatch
    traffic: case_study.Traffic
    simulator: Simulator


def prepare_site(options: argparse.Namespace) -> DetectionSite:
    """Survey a scene that can carry four sensors, and read its traffic; the options are those of `add_options`."""
    check_device(options.device)
    surveyed, watch = survey.survey(
        options, lambda layout: check_objective(layout.site, layout.models, Objective(count=COUNTS[-1]))
    )
    paths = options.traffic or survey.runs_beside(options.scene)
    traffic = case_study.read_traffic(paths, surveyed.geometry.origin, options.every)
    check_runs([run.trajectories for run in traffic.runs], surveyed.site.region)
    for run in traffic.runs:
        require_own_traffic(run.trajectories, surveyed.geometry, run.name)
    runtime.LOG.info(traffic.overlap())
    runtime.warn(filter(None, [too_few_runs(len(traffic.test))]))
    scans = ScanSettings(rolling_shutter=True)
    return DetectionSite(surveyed, watch, traffic, Simulator(surveyed.geometry, scans))


def run_study(  # noqa: PLR0913  # a site, its placements, and how detectors are trained
    site: DetectionSite,
    configurations: tuple[case_study.SensorConfiguration, ...],
    folder: Path,
    *,
    training: TrainingSettings,
    seeds: int,
    device: str,
    start: Detector | None = None,
) -> StudyResults:
    """Simulate, train and evaluate detectors for all configurations; trained detectors stay in the folder."""
    watch, simulator, traffic, network = site.stopwatch, site.simulator, site.traffic, NetworkSettings()
    simulating = case_study.simulate_training_set(simulator, configurations, traffic, network)
    training_set = watch.run("simulation", simulating)
    learning = case_study.train_all(training_set, network, training, folder, seeds=seeds, device=device, start=start)
    trained = watch.run("training", learning)
    for seed, (_, curve) in enumerate(trained, start=1):
        name = f"detector-{seed}"
        save_training_chart(folder / f"{name}.png", curve.loss, curve.validation, name)
    evaluating = case_study.evaluate_all(simulator, configurations, trained, traffic, training.threads)
    outcomes = watch.run("evaluation", evaluating)
    return StudyResults(site.surveyed.site.name, simulator, traffic, tuple(outcomes))


def add_options(parser: argparse.ArgumentParser) -> argparse._ArgumentGroup:
    """Add the options of traffic and of trainings to a command; return their group."""
    detection = parser.add_argument_group("detection")
    detection.add_argument(
        "--traffic",
        nargs="+",
        type=Path,
        default=[],
        metavar="NPZ",
        help=f"runs of traffic: {case_study.SPLIT} (those in the folder SCENE_traffic next to the scene)",
    )
    add_training_options(detection)
    return detection


def add_training_options(group: argparse._ArgumentGroup) -> None:
    """Add the options of trainings to a group."""
    group.add_argument(
        "--every",
        type=real_number(TIME_STEP),
        default=2.5,
        metavar="S",
        help="time between training frames; twice that in tests",
    )
    group.add_argument("--steps", type=whole_number(STEPS), metavar="N", help="steps of each training")
    group.add_argument(
        "--trainings",
        type=whole_number(TRAININGS),
        default=3,
        metavar="N",
        help="number of trainings, with different seeds",
    )
    group.add_argument("--device", default="cpu", help="device of torch: cpu or cuda")


def _parser() -> argparse.ArgumentParser:
    what = "Find out what 1, 2 and 4 sensors of each type detect; name types from the simplest to the best."
    parser = study_parser("detection", what)
    add_options(parser).add_argument(
        "--from-scratch",
        action="store_true",
        help=f"begin trainings with random weights ({TrainingSettings().steps:,} steps), not with those of the "
        f"detector that ships ({FINE_TUNING.steps})",
    )
    return parser
