"""Average precision of one detector with each of several placements, on the same test runs."""

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path

from headless.detection.average_precision import (
    Evaluation,
    average_precision_interval,
    average_precisions_of_runs,
    evaluate,
    part,
)
from headless.detection.detector import Detector
from headless.detection.recordings import Simulator
from headless.detection.rules import MAIN_RULE, RULES, precision_by
from headless.detection.run_detection import AT_ONCE
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.training import deterministic
from headless.side_by_side import side_by_side
from headless.studies.detection.case_study import ModelConfiguration, Traffic, TrainingSet, simulate_training_set
from headless.studies.detection.sensor_configuration import SensorConfiguration
from headless.studies.stored_detections import stored_detections

import numpy as np

from seip_addon.core.arrays import Boolean, Float, Text
from seip_addon.core.estimates import RESAMPLES, Interval, percentiles
from seip_addon.core.progress import Progress

from .drawing import DrawnPlacements, PlacementsStudySettings

TRAFFIC_SEED, TRAINING_SEED, PLACEMENT_SEED = 0, 1, 2  # of resamples: draws of one must not follow from another's
RESAMPLES_AT_ONCE = 100  # the number that needs a few hundred megabytes
MAX_HALVES = 20  # ways to cut the test runs into halves that are tried
FOLDER = "detections"  # of the folder of results: what was detected with each placement
CLASSES = {"vehicles": "bev_0.7", "two-wheelers": "motorcycle_bicycle_0.5", "pedestrians": "pedestrian_0.5"}
"""Rules of average precision for each class of road users; the first is the study's own."""
ENOUGH_RETURNS = 10  # from a road user, to be counted as seen well


@dataclass(frozen=True, eq=False)
class Precisions:
    """Evaluations of n placements by t trainings on the same frames.

    Parameters
    ----------
    runs : (f,) str
        Name of the run of each frame.
    evaluations : tuple of tuple of Evaluation
        Average precision of each placement by each training.
    of_classes : mapping of str to (n,) float64
        Average precision of each placement by the rules of `CLASSES`, the mean over the trainings.
    """

    runs: Text
    evaluations: tuple[tuple[Evaluation, ...], ...]
    of_classes: Mapping[str, Float] = field(default_factory=dict)

    @property
    def trainings(self) -> int:
        """Number of trainings."""
        return len(self.evaluations[0])

    @cached_property
    def by_training(self) -> Float:
        """Average precision, (t, n)."""
        return np.array([[one.average_precision for one in own] for own in self.evaluations]).T

    @property
    def values(self) -> Float:
        """Average precision of each placement, the mean over the trainings, (n,)."""
        mean: Float = self.by_training.mean(axis=0)
        return mean

    @cached_property
    def resampled(self) -> Float:
        """Average precision in resamples of the test runs and of the trainings, (n, r).

        A resample draws the same runs and the same trainings for all placements.
        """
        runs = int(self.evaluations[0][0].run.max()) + 1
        drawn = np.random.default_rng(TRAFFIC_SEED).multinomial(runs, np.full(runs, 1 / runs), RESAMPLES)
        parts = np.split(drawn, range(RESAMPLES_AT_ONCE, RESAMPLES, RESAMPLES_AT_ONCE))
        trainings = self.trainings
        times = np.random.default_rng(TRAINING_SEED).multinomial(
            trainings, np.full(trainings, 1 / trainings), RESAMPLES
        )
        return np.array(
            [
                sum(
                    times[:, number]
                    / trainings
                    * np.concatenate([average_precisions_of_runs(one, some) for some in parts])
                    for number, one in enumerate(own)
                )
                for own in self.evaluations
            ]
        )

    @cached_property
    def has_intervals(self) -> bool:
        """Whether there is enough test traffic for intervals."""
        return average_precision_interval(self.evaluations[0][0]) is not None

    def interval(self, placement: int) -> Interval | None:
        """Return the 95 % interval of a placement's average precision over other traffic and trainings like these."""
        return percentiles(self.resampled[placement]) if self.has_intervals else None

    @cached_property
    def halves(self) -> Float:
        """Average precision on two halves of the test runs, for each way to halve them, (h, 2, n)."""
        names = np.unique(self.runs).tolist()
        ways = [some for some in combinations(names, len(names) // 2) if len(names) % 2 or names[0] in some]
        picked = (
            np.random.default_rng(TRAFFIC_SEED).permutation(len(ways))[:MAX_HALVES]
            if len(names) > 1
            else np.zeros(0, dtype=np.int64)
        )
        halves = [
            [self._on_runs(np.isin(self.runs, ways[way]) == first) for first in (True, False)]
            for way in sorted(picked.tolist())
        ]
        return np.array(halves).reshape(len(halves), 2, len(self.evaluations))

    @property
    def share_with_returns(self) -> Float:
        """Share of the test frames' road users with `ENOUGH_RETURNS` or more, (n,)."""
        return np.array([float((own[0].wanted.points >= ENOUGH_RETURNS).mean()) for own in self.evaluations])

    def _on_runs(self, frames: Boolean) -> Float:
        """Return the average precision of each placement on some frames (f,) bool, the mean over the trainings."""
        return np.array(
            [
                np.mean(
                    [part(one, frames[one.detections.frame], frames[one.wanted.frame]).average_precision for one in own]
                )
                for own in self.evaluations
            ]
        )


def detectors_of(
    drawn: DrawnPlacements, settings: PlacementsStudySettings, training: TrainingSettings, start: Detector | None
) -> list[ModelConfiguration]:
    """Return the detectors to be trained, each on all placements to learn from."""
    return [
        ModelConfiguration(
            f"detector-{seed}",
            drawn.training,
            NetworkSettings(),
            replace(training, steps=settings.steps, seed=seed),
            start,
        )
        for seed in range(1, settings.trainings + 1)
    ]


def training_clouds(
    simulator: Simulator, drawn: DrawnPlacements, traffic: Traffic
) -> Generator[Progress, None, TrainingSet]:
    """Simulate what the placements to learn from measure."""
    return (yield from simulate_training_set(simulator, drawn.training, traffic, NetworkSettings()))


def precisions(
    simulator: Simulator,
    placements: Sequence[SensorConfiguration],
    detectors: Sequence[Detector],
    traffic: Traffic,
    folder: Path,
) -> Generator[Progress, None, Precisions]:
    """Evaluate detectors with placements on the test runs; what a placement gave before it does not give again.

    Parameters
    ----------
    folder : path
        Of results: what was detected is kept in it, under a digest of all that it follows from.
    """
    works = [
        stored_detections(simulator, placement, detectors, traffic.test, folder / FOLDER) for placement in placements
    ]
    with deterministic(1):  # all the time, as torch keeps one such setting for all threads
        results = yield from side_by_side(works, AT_ONCE)
    runs: Text = np.repeat([run.name for run in traffic.test], [len(run.times) for run in traffic.test])
    of_classes: dict[str, Float] = {
        name: np.array(
            [np.mean([precision_by(frames, RULES[rule]).average_precision for frames in own]) for own in results]
        )
        for name, rule in CLASSES.items()
    }
    return Precisions(runs, tuple(tuple(evaluate(frames, MAIN_RULE) for frames in own) for own in results), of_classes)
