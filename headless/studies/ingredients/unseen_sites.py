"""Tests of detectors at unseen sites: traffic and sensors there, and the average precision."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace

from headless.detection.average_precision import evaluate
from headless.detection.detector import Detector
from headless.detection.recordings import MountedSensors, SampledRun, Simulator
from headless.detection.rules import MAIN_RULE
from headless.detection.run_detection import AT_ONCE, detect_in_runs
from headless.detection.training import deterministic
from headless.side_by_side import side_by_side
from headless.studies.detector_limits.paired_change import ResampledPrecision, change, level
from headless.studies.random_sites.varied_bodies import resized
from headless.studies.site_training.training_site import TrainingSite

import numpy as np

from seip_addon.core.estimates import IntervalEstimate
from seip_addon.core.progress import Progress, finish

from .variants import ALL, SIZE_CHANGE, Ingredients


@dataclass(frozen=True, eq=False)
class UnseenTest:
    """Runs of traffic at a site, each with the sensors that scan it."""

    name: str
    simulator: Simulator
    scanned: tuple[tuple[SampledRun, MountedSensors], ...]


def unseen_tests(site: TrainingSite, best: MountedSensors, seed: int, *, full: bool) -> tuple[UnseenTest, ...]:
    """Return the tests at a site: with one placement; if `full`, also with random ones and changed road users."""
    runs = site.runs
    tests = [UnseenTest(f"{site.simulator.site}, {best.name}", site.simulator, tuple((run, best) for run in runs))]
    if full:
        random = np.random.default_rng([seed, len(runs)])
        drawn = tuple((run, site.random_placement(number, random)) for number, run in enumerate(runs, start=1))
        tests.append(UnseenTest(f"{site.simulator.site}, random placements", site.simulator, drawn))
        others = tuple(
            (replace(run, trajectories=finish(resized(run.trajectories, SIZE_CHANGE, seed))), best) for run in runs
        )
        tests.append(UnseenTest(f"{tests[0].name}, sizes ±{SIZE_CHANGE:.0%}", site.simulator, others))
    return tuple(tests)


@dataclass(frozen=True, eq=False)
class IngredientEffect:
    """Average precision of a variant in a test.

    Parameters
    ----------
    precision : IntervalEstimate
        Average precision over test runs and trainings.
    change : IntervalEstimate or None
        Paired change against the training with all ingredients; None for that training itself.
    """

    variant: str
    test: str
    precision: IntervalEstimate
    change: IntervalEstimate | None


def effects(
    tests: Sequence[UnseenTest], variants: Mapping[str, Ingredients], detectors: Mapping[str, Sequence[Detector]]
) -> Generator[Progress, None, list[IngredientEffect]]:
    """Evaluate the detectors of all variants on the same frames, and compare them with those of all ingredients."""
    names = [name for name, own in detectors.items() for _ in own]
    all_detectors = [detector for own in detectors.values() for detector in own]
    works = []
    for test in tests:
        areas = [
            variants[name].area(test.simulator.area(detector.settings.pillar))
            for name, detector in zip(names, all_detectors, strict=True)
        ]
        works += [
            detect_in_runs(test.simulator, sensors, [run], all_detectors, 1, areas) for run, sensors in test.scanned
        ]
    with deterministic(1):  # around all works, as torch has one such setting for all threads
        found = iter((yield from side_by_side(works, AT_ONCE)))
    rows = []
    for test in tests:
        by_run = [next(found) for _ in test.scanned]
        frames = [[frame for run in by_run for frame in run[number]] for number in range(len(all_detectors))]
        resampled: dict[str, list[ResampledPrecision]] = {name: [] for name in detectors}
        for name, own in zip(names, frames, strict=True):
            resampled[name].append(ResampledPrecision(evaluate(own, MAIN_RULE)))
        rows += [
            IngredientEffect(name, test.name, level(own), None if name == ALL else change(own, resampled[ALL]))
            for name, own in resampled.items()
        ]
    return rows
