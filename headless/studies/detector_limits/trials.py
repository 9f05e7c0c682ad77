"""Trials of detectors under disturbances, with results stored on disk."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path

from headless.detection.average_precision import CountedTruth, EvaluatedDetections, Evaluation, evaluate
from headless.detection.detector import Detector
from headless.detection.frame_results import FrameResult, frame_result
from headless.detection.inference import detect
from headless.detection.matching import Rule
from headless.detection.recordings import SampledRun, Simulator
from headless.detection.run_detection import AT_ONCE
from headless.detection.training import deterministic
from headless.side_by_side import side_by_side
from headless.studies.detection.sensor_configuration import SensorConfiguration
from headless.studies.simulated_recordings import frames_key

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from seip_addon.core import limits
from seip_addon.core.arrays import Float
from seip_addon.core.progress import Progress, finish
from seip_addon.core.sensing.scans.frame import Frame
from seip_addon.core.sensing.scans.simulation import prepare
from seip_addon.core.sensing.traffic.bodies import fitted_body
from seip_addon.core.storage.array_file import ArrayFile, ArrayRule, ContentError
from seip_addon.core.storage.files import digest
from seip_addon.core.storage.source_digest import source_digest

from .disturbances import Disturbance

_FROM_ZERO = limits.Limits(0.0, math.inf)
_SCORE = limits.Limits(-math.inf, 1.0)  # of road users; minus infinity if not found

FILE = ArrayFile(
    "seip.trial",
    3,
    "trial of a detector",
    "delete it to evaluate it again",
    {
        "detections.score": ArrayRule("f8", ("d",), limits.SHARE),
        "detections.hit": ArrayRule("b1", ("d",)),
        "detections.frame": ArrayRule("i8", ("d",), limits.COUNT),
        "detections.density": ArrayRule("f8", ("d",), _FROM_ZERO),
        "detections.points": ArrayRule("i8", ("d",), limits.COUNT),
        "detections.distance": ArrayRule("f8", ("d",), _FROM_ZERO),
        "detections.border": ArrayRule("f8", ("d",), _FROM_ZERO),
        "wanted.score": ArrayRule("f8", ("t",), _SCORE),
        "wanted.frame": ArrayRule("i8", ("t",), limits.COUNT),
        "wanted.category": ArrayRule("U", ("t",)),
        "wanted.points": ArrayRule("i8", ("t",), limits.COUNT),
        "wanted.visibility": ArrayRule("f8", ("t",), limits.SHARE),
        "wanted.distance": ArrayRule("f8", ("t",), _FROM_ZERO),
        "wanted.border": ArrayRule("f8", ("t",), _FROM_ZERO),
        "run": ArrayRule("i8", ("f",), limits.COUNT),
    },
)

RULE = Rule()
"""Rule of average precision: the default of the evaluation."""

TABLES = {"detections": EvaluatedDetections, "wanted": CountedTruth}


@dataclass(frozen=True, eq=False)
class TrialSite:
    """A site with the test frames on which detectors are evaluated.

    Parameters
    ----------
    runs : tuple of SampledRun
        Test runs, unseen by all detectors.
    """

    name: str
    simulator: Simulator
    runs: tuple[SampledRun, ...]

    def key(self, configuration: SensorConfiguration) -> str:
        """Return a digest of all inputs of undisturbed frames."""
        return frames_key(self.simulator, configuration, self.runs)


@dataclass(frozen=True, eq=False)
class EvaluatedDetector:
    """A trained detector to be evaluated."""

    name: str
    detector: Detector

    @cached_property
    def key(self) -> str:
        """Digest of its weights and its settings."""
        return self.detector.key


@dataclass(frozen=True, eq=False)
class DisturbedTrial:
    """Results of one detector on disturbed test frames.

    Parameters
    ----------
    evaluation : Evaluation
        Evaluation with distances to the nearest sensor.
    from_border : Evaluation
        Evaluation with distances to the border of the region of interest.
    """

    evaluation: Evaluation
    from_border: Evaluation


def trials(
    site: TrialSite,
    configuration: SensorConfiguration,
    disturbance: Disturbance,
    tested: Sequence[EvaluatedDetector],
    store: Path,
) -> Generator[Progress, None, list[DisturbedTrial]]:
    """Evaluate detectors with a placement under a disturbance; a frame is simulated once for all of them.

    Parameters
    ----------
    tested : sequence of EvaluatedDetector
    store : path
        Folder of earlier trials.

    Returns
    -------
    list of DisturbedTrial
        One for each detector.
    """
    setting = digest(source_digest(__name__), site.key(configuration), repr(RULE), repr(disturbance))
    paths = [store / f"{digest(setting, one_tested.key)[:32]}.npz" for one_tested in tested]
    missing = [(one_tested, path) for one_tested, path in zip(tested, paths, strict=True) if not path.exists()]
    if missing:
        detectors = [disturbance.disturbed_detector(one_tested.detector) for one_tested, _ in missing]
        results = yield from _results(site, configuration, disturbance, detectors)
        for (one_tested, path), frames in zip(missing, results, strict=True):
            header = {"ground": site.name, "configuration": configuration.name, "detector": one_tested.name}
            _save(path, header | {"disturbance": repr(disturbance)}, trial_of(frames, site.simulator.static.region))
    return [_load(path) for path in paths]


def trial_of(frames: Sequence[FrameResult], region: BaseGeometry) -> DisturbedTrial:
    """Evaluate a detector's results on some frames."""

    def from_border(boxes: Float) -> Float:
        distance: Float = shapely.distance(region.boundary, shapely.points(boxes[:, :2]))
        return distance

    measured = [
        replace(
            frame,
            truth=replace(frame.truth, distance=from_border(frame.truth.boxes)),
            detected=replace(frame.detected, distance=from_border(frame.detected.boxes)),
        )
        for frame in frames
    ]
    return DisturbedTrial(evaluate(frames, RULE), evaluate(measured, RULE))


def disturbed_frames(
    simulator: Simulator, run: SampledRun, configuration: SensorConfiguration, disturbance: Disturbance
) -> Generator[Frame, None, None]:
    """Simulate the frames of a run under a disturbance."""
    sensors = disturbance.disturbed_sensors(configuration.sensors)
    trajectories = disturbance.disturbed_traffic(run.trajectories)
    bodies = [fitted_body(user) for user in trajectories.users]
    simulation = finish(prepare(simulator.static, sensors, trajectories, bodies, simulator.settings))
    for number, time in enumerate(run.times.tolist()):
        random = np.random.default_rng([simulator.settings.seed, int(run.key, 16), number])
        scan = disturbance.disturbed_scan(simulation, number, time)
        yield disturbance.disturbed_frame(scan, sensors, random)


def _results(
    site: TrialSite, configuration: SensorConfiguration, disturbance: Disturbance, detectors: Sequence[Detector]
) -> Generator[Progress, None, list[list[FrameResult]]]:
    """Return the results of all frames by detector."""
    works = [_results_of_run(site, run, configuration, disturbance, detectors) for run in site.runs]
    with deterministic(1):  # around all works, as torch has one such setting for all threads
        by_run = yield from side_by_side(works, AT_ONCE)
    return [[frame for run in by_run for frame in run[number]] for number in range(len(detectors))]


def _results_of_run(
    site: TrialSite,
    run: SampledRun,
    configuration: SensorConfiguration,
    disturbance: Disturbance,
    detectors: Sequence[Detector],
) -> Generator[Progress, None, list[list[FrameResult]]]:
    results: list[list[FrameResult]] = [[] for _ in detectors]
    region = site.simulator.static.region
    for number, frame in enumerate(disturbed_frames(site.simulator, run, configuration, disturbance)):
        yield Progress(number, len(run.times), f"{configuration.name}, {disturbance.name} {disturbance.size:g}")
        for detector, own in zip(detectors, results, strict=True):
            found = detect(detector, site.simulator.area(detector.settings.pillar), frame)
            own.append(
                frame_result(
                    frame,
                    found,
                    region=region,
                    sensors=configuration.places,
                    run=run.name,
                )
            )
    return results


def _save(path: Path, header: dict[str, str], trial: DisturbedTrial) -> None:
    evaluation, from_border = trial.evaluation, trial.from_border
    arrays = {
        f"{table}.{part.name}": getattr(getattr(evaluation, table), part.name)
        for table, kind in TABLES.items()
        for part in fields(kind)
    }
    border = {f"{table}.border": getattr(from_border, table).distance for table in TABLES}
    FILE.save(path, header, arrays | border | {"run": evaluation.run})


def _load(path: Path) -> DisturbedTrial:
    with FILE.reading(path) as (_, arrays):
        tables = {
            table: kind(**{part.name: arrays[f"{table}.{part.name}"] for part in fields(kind)})
            for table, kind in TABLES.items()
        }
        frames = len(arrays["run"])
        if any((arrays[f"{table}.frame"] >= frames).any() for table in TABLES):
            raise ContentError("it has detections for frames that it does not contain")
        evaluation = Evaluation(RULE, tables["detections"], tables["wanted"], arrays["run"])
        from_border = {
            table: replace(rows, distance=arrays[f"{table}.border"])  # type: ignore[type-var]  # each is a dataclass
            for table, rows in tables.items()
        }
        return DisturbedTrial(evaluation, replace(evaluation, **from_border))
