"""Detection for the paper's case: training and tests on randomly drawn runs, and on near copies for comparison."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from headless.detection.average_precision import average_precision_interval, average_precisions_without_each_run
from headless.detection.recordings import Simulator
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.training import TrainedDetector
from headless.studies.claims import Claim
from headless.studies.coverage.cells import COUNTS, CoverageStudy
from headless.studies.detection import case_study
from headless.studies.detection.case_study import DetectorOutcome, Traffic
from headless.studies.detection.claims import detection_claims
from headless.studies.detection.results import StudyResults
from headless.studies.detection.sensor_configuration import SensorConfiguration

import numpy as np

from seip_addon.core.errors import SeipError
from seip_addon.core.progress import Progress

from .figures import ENOUGH_RETURNS, PlacementFigures

Result = TypeVar("Result")

PARTS = 6  # of the whole: simulate, train, and evaluate, for either traffic


class NearCopies(Traffic):
    """Runs that are nearly the same, to measure the effect on average precision."""

    def __post_init__(self) -> None:
        """Accept any overlap."""


@dataclass(frozen=True, eq=False)
class DetectionOfCase:
    """Results: figures of each placement, all results on the randomly drawn runs, and the claims 5 to 8."""

    placements: tuple[PlacementFigures, ...]
    results: StudyResults
    claims: tuple[Claim, ...]
    copies_rising: bool


def placed(study: CoverageStudy) -> tuple[SensorConfiguration, ...]:
    """Return the vanilla placements of a coverage study with free heights.

    Raises
    ------
    SeipError
        A placement is missing.
    """
    cases = [study.find(sensor, count) for sensor in study.sensors for count in COUNTS]
    if any(case is None for case in cases):
        raise SeipError(
            "there are too few positions for four sensors of each type: add pavements, poles or --approaches"
        )
    return tuple(SensorConfiguration.of_case(case) for case in cases if case is not None)


def detection_of_case(  # noqa: PLR0913  # a site, two kinds of traffic, and how detectors are trained
    simulator: Simulator,
    configurations: Sequence[SensorConfiguration],
    traffic: Traffic,
    copies: NearCopies,
    folder: Path,
    *,
    training: TrainingSettings,
    seeds: int,
    device: str,
) -> Generator[Progress, None, DetectionOfCase]:
    """Train detectors on randomly drawn runs, and one on near copies, and test both on both.

    Parameters
    ----------
    folder : Path
        Folder of the detectors; a detector that is already there is not trained again.
    """
    network = NetworkSettings()
    models = case_study.model_configurations(configurations, network, training, seeds=seeds, separate=False)
    copied = [replace(models[0], name="detector-of-copies")]
    trained: list[TrainedDetector] = []
    for half, (own, runs) in enumerate(((models, traffic), (copied, copies))):
        progress = Progress(2 * half, PARTS, "train on near copies" if half else "train", counted=False)
        simulating = case_study.simulate_training_set(simulator, configurations, runs, network)
        training_set = yield from in_detail(progress, simulating)
        learning = case_study.train_all(own, training_set, folder, device=device)
        trained += yield from in_detail(replace(progress, done=2 * half + 1), learning)
        del training_set
    detectors = [one.detector for one in trained]
    steps_drawn = case_study.evaluate_all(simulator, models, detectors[: len(models)], traffic)
    outcomes = yield from in_detail(Progress(4, PARTS, "evaluate", counted=False), steps_drawn)
    both = [models[0], *copied], [detectors[0], detectors[-1]]
    steps_copied = case_study.evaluate_all(simulator, *both, copies)
    on_copies = yield from in_detail(Progress(5, PARTS, "evaluate near copies", counted=False), steps_copied)
    curves = tuple(one.curve for one in trained)
    results = StudyResults(simulator.site, simulator, traffic, tuple(models), tuple(outcomes), curves[: len(models)])
    placements = tuple(_figures(one, outcomes, on_copies) for one in configurations)
    return DetectionOfCase(
        placements, results, detection_claims(results.seed_results), copies_rising=case_study.still_rises(curves[-1])
    )


def _figures(
    configuration: SensorConfiguration, outcomes: Sequence[DetectorOutcome], on_copies: Sequence[DetectorOutcome]
) -> PlacementFigures:
    own = [one for one in outcomes if one.configuration is configuration]
    unfamiliar, copies = (one for one in on_copies if one.configuration is configuration)
    first = own[0].evaluation
    return PlacementFigures(
        name=configuration.name,
        sensor=configuration.sensor,
        count=configuration.count,
        coverage=configuration.deployment.coverage,
        enough=float(np.mean(first.wanted.points >= ENOUGH_RETURNS)),
        returns=float(np.median(first.wanted.points)),
        precision=float(np.mean([one.evaluation.average_precision for one in own])),
        interval=average_precision_interval(first),
        without_each_run=average_precisions_without_each_run(first),
        false_positives=float(np.mean([one.seed_result.false_positives for one in own])),
        copies=copies.evaluation.average_precision,
        unfamiliar=unfamiliar.evaluation.average_precision,
    )


def in_detail(whole: Progress, steps: Generator[Progress, None, Result]) -> Generator[Progress, None, Result]:
    """Run work as one of several equally long units of a whole, yielding progress that includes that of the unit."""
    while True:
        try:
            step = next(steps)
        except StopIteration as stop:
            result: Result = stop.value
            return result
        done, total = whole.done * step.total + step.done, whole.total * step.total
        yield Progress(done, total, step.what, whole.counted and step.counted)
