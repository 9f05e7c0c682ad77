"""The detection study: average precision of sensor types × numbers, against price and coverage.

Placements come from the integer program, clouds from simulated traffic. A detector is trained on all placements at
once, several times with different seeds, and evaluated with each placement on unseen traffic.
"""

import math
from collections.abc import Generator, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

from headless.detection.average_precision import ADVISED_TEST_RUNS, Evaluation, balanced_score, evaluate
from headless.detection.detector import Detector
from headless.detection.detector_evaluation import AT_ONCE, detect_in_runs, side_by_side
from headless.detection.frame_results import FrameResult
from headless.detection.frames import LazyFrames, Recording, SampledRecording
from headless.detection.recordings import MountedSensors, SampledRun, Simulator, poses_key, sampled_runs
from headless.detection.rules import MAIN_RULE
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.training import LearningCurve, TrainedDetector, deterministic, train
from headless.studies.coverage.cells import COUNTS, Case, Cell, solve_cell
from headless.studies.detection.sensor_configuration import SensorConfiguration
from headless.studies.false_positives import false_positives

from seip_addon.core.arrays import Float
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import Progress, within
from seip_addon.core.sensing.traffic.run_overlap import require_independent, vehicle_positions
from seip_addon.core.workflows.survey import Survey

from .claims import SeedResult

MIN_RUNS = 4  # one to learn from, one for validation, two for tests
STILL_RISING = 0.02  # average precision by which the last validation beats all others where more steps would gain
RUNS_PER_TEST, RUNS_PER_VALIDATION = 2, 8  # of all runs one half is for tests, and one eighth for validation
RUNS_PER_CRITERIA = 4  # without training one quarter is for criteria that go by traffic, the others for tests

SPLIT = "the last half is for tests, an eighth before it (at least one) for validation, the others for training"
"""Split of the runs, as a message."""

TEST_STRIDE = 2  # every second frame is tested: frames shortly after each other are similar, and cost time


@dataclass(frozen=True, eq=False)
class Traffic:
    """Runs of traffic for training, validation and tests.

    Parameters
    ----------
    training, validation, test : tuple of SampledRun
        Runs for training, for validation (which decides when to stop), and for evaluation.

    Raises
    ------
    SeipError
        Two runs are nearly the same: their frames show the same vehicles at the same positions.
    """

    training: tuple[SampledRun, ...]
    validation: tuple[SampledRun, ...]
    test: tuple[SampledRun, ...]

    def __post_init__(self) -> None:
        self.overlap()

    @property
    def runs(self) -> tuple[SampledRun, ...]:
        """All runs."""
        return (*self.training, *self.validation, *self.test)

    def overlap(self) -> str:
        """Return a message with the overlap of the runs of each pair; see `require_independent`."""
        positions = [vehicle_positions(run.name, run.trajectories) for run in self.runs]
        return require_independent(combinations(positions, 2))


def read_traffic(paths: Sequence[Path], origin: Float, every: float) -> Traffic:
    """Read runs, and split them: the last half (rounded down) for tests, an eighth before it for validation.

    Parameters
    ----------
    origin : (3,) float64, metres
    every : float, seconds
        Time between training frames; in the other runs `TEST_STRIDE` times that.

    Raises
    ------
    SeipError
        There are too few runs, or one is too short.
    """
    if len(paths) < MIN_RUNS:
        raise SeipError(
            f"{len(paths)} runs of traffic are too few: name {MIN_RUNS} or more with --traffic, better "
            f"{RUNS_PER_TEST * ADVISED_TEST_RUNS}, made by `seip traffic` with different seeds; {SPLIT}"
        )
    runs = sampled_runs(paths, origin, every)
    tested = len(runs) // RUNS_PER_TEST
    trained_on = len(runs) - tested - max(1, len(runs) // RUNS_PER_VALIDATION)
    sparse = tuple(replace(run, times=run.times[::TEST_STRIDE]) for run in runs[trained_on:])
    return Traffic(tuple(runs[:trained_on]), sparse[:-tested], sparse[-tested:])


def split_untrained(runs: Sequence[SampledRun]) -> tuple[tuple[SampledRun, ...], tuple[SampledRun, ...]]:
    """Return the first quarter of some runs (one at least), and the others.

    Raises
    ------
    SeipError
        There are too few.
    """
    if len(runs) < MIN_RUNS:
        raise SeipError(f"{len(runs)} runs of traffic are too few: make {MIN_RUNS} or more with seip traffic")
    known = max(1, len(runs) // RUNS_PER_CRITERIA)
    return tuple(runs[:known]), tuple(runs[known:])


@dataclass(frozen=True, eq=False)
class DetectorOutcome:
    """Results of one detector on one configuration's test frames.

    Parameters
    ----------
    score : float
        Least score of counted false positives: the best balance of precision and recall on validation frames.
    """

    seed: int
    configuration: SensorConfiguration
    frames: tuple[FrameResult, ...]
    evaluation: Evaluation
    score: float
    still_rising: bool

    @property
    def seed_result(self) -> SeedResult:
        """Figures of this outcome for the claims."""
        configuration, false = self.configuration, false_positives(self.evaluation, self.score)
        return SeedResult(
            sensor=configuration.sensor,
            count=configuration.count,
            seed=self.seed,
            average_precision=self.evaluation.average_precision,
            price=configuration.deployment.price,
            coverage=configuration.deployment.coverage,
            false_positives=false.per_frame,
            sparse=false.sparse,
            still_rising=self.still_rising,
        )


def place_all(survey: Survey) -> Generator[Progress, None, tuple[SensorConfiguration, ...]]:
    """Place 1, 2 and 4 sensors of each type for the largest coverage.

    Raises
    ------
    SeipError
        There are fewer positions than sensors, or a type sees nothing.
    """
    site, models, visible = survey.site, survey.models, survey.grid.visible
    cells = [Cell(sensor, None, count, 1.0) for sensor in models for count in COUNTS]
    placed: list[Case] = []
    for done, cell in enumerate(cells):
        progress = Progress(done, len(cells), f"place {cell.count} × {cell.sensor}")
        yield progress
        steps = solve_cell(site, models, visible, cell, survey.settings.limits)
        placed.append((yield from within(progress, steps)))
    yield Progress(len(cells), len(cells), "placed")
    return tuple(map(SensorConfiguration.of_case, placed))


@dataclass(frozen=True, eq=False)
class TrainingSet:
    """Training and validation recordings of all sensor configurations."""

    training: list[SampledRecording]
    validation: list[SampledRecording]


def simulate_training_set(
    simulator: Simulator, configurations: Sequence[SensorConfiguration], traffic: Traffic, network: NetworkSettings
) -> Generator[Progress, None, TrainingSet]:
    """Simulate the frames of all configurations, and store the training samples of a network."""
    area = simulator.area(network.pillar)

    def recordings(placed: SensorConfiguration, runs: Sequence[SampledRun]) -> list[SampledRecording]:
        return [SampledRecording(recorded(simulator, placed, run), area, network.most_points) for run in runs]

    training = {one.name: recordings(one, traffic.training) for one in configurations}
    validation = {one.name: recordings(one, traffic.validation) for one in configurations}
    each = [(*training[one.name], *validation[one.name]) for one in most_rays_first(configurations)]
    yield from side_by_side([simulated(some) for some in each], AT_ONCE)
    return TrainingSet(
        [recording for one in configurations for recording in training[one.name]],
        [recording for one in configurations for recording in validation[one.name]],
    )


def most_rays_first(configurations: Iterable[SensorConfiguration]) -> list[SensorConfiguration]:
    """Return configurations in descending number of rays, so that no long work is left to one core at the end."""

    def rays(placed: SensorConfiguration) -> int:
        return sum(sensor.model.channels * sensor.model.azimuth_count for sensor in placed.sensors)

    return sorted(configurations, key=rays, reverse=True)


def recorded(simulator: Simulator, configuration: MountedSensors, run: SampledRun) -> Recording:
    """Return the frames of a run, simulated on access."""
    frames = LazyFrames(len(run.times), lambda number: simulator.frame(configuration, run, number))
    name = f"{configuration.name} in {run.name}"
    return Recording(name, run.key, frames, configuration.types, simulator.site, poses_key(configuration))


def simulated(recordings: Sequence[SampledRecording]) -> Generator[Progress, None, None]:
    """Simulate all frames of some recordings."""
    total, done = sum(map(len, recordings)), 0
    for sampled in recordings:
        for number in range(len(sampled)):
            yield Progress(done, total, f"simulate {sampled.recording.name}")
            sampled.get(number)
            done += 1


def train_all(  # noqa: PLR0913  # what a training depends on
    training_set: TrainingSet,
    network: NetworkSettings,
    training: TrainingSettings,
    folder: Path,
    *,
    seeds: int,
    device: str,
    start: Detector | None = None,
) -> Generator[Progress, None, list[TrainedDetector]]:
    """Train a detector with each of the seeds from 1 on, on the CPU one on each core.

    Parameters
    ----------
    folder : path
        Folder of the detectors ``detector-SEED.pt``; a detector that is already there is not trained again.
    start : Detector, optional
        Detector with the initial weights; random weights if not given.
    """
    trainings = [
        train(
            training_set.training,
            training_set.validation,
            network,
            replace(training, seed=seed),
            device=device,
            store=folder / f"detector-{seed}.pt",
            start=start,
        )
        for seed in range(1, seeds + 1)
    ]
    with deterministic(training.threads):  # around all works, as torch has one such setting for all threads
        return (yield from side_by_side(trainings, AT_ONCE if device == "cpu" else 1))


def still_rises(curve: LearningCurve) -> bool:
    """Return whether the last validation beats all before it by more than `STILL_RISING`, or there is but one."""
    *before, last = curve.validation.values()
    return last > max(before, default=-math.inf) + STILL_RISING


def evaluate_all(
    simulator: Simulator,
    configurations: Sequence[SensorConfiguration],
    trained: Sequence[TrainedDetector],
    traffic: Traffic,
    threads: int,
) -> Generator[Progress, None, list[DetectorOutcome]]:
    """Evaluate every detector with each configuration; a frame is simulated once for all of them."""
    ordered, runs = most_rays_first(configurations), (*traffic.validation, *traffic.test)
    detectors = [one.detector for one in trained]
    works = [detect_in_runs(simulator, one, runs, detectors, threads) for one in ordered]
    with deterministic(threads):  # around all works, as torch has one such setting for all threads
        found = yield from side_by_side(works, AT_ONCE)
    results = {one.name: frames for one, frames in zip(ordered, found, strict=True)}
    validated = sum(len(run.times) for run in traffic.validation)
    outcomes = []
    for number, one in enumerate(trained):
        own = {name: frames[number] for name, frames in results.items()}
        known = [frame for each in configurations for frame in own[each.name][:validated]]
        score, rising = balanced_score(evaluate(known, MAIN_RULE)), still_rises(one.curve)
        for each in configurations:
            frames = tuple(own[each.name][validated:])
            outcomes.append(DetectorOutcome(number + 1, each, frames, evaluate(frames, MAIN_RULE), score, rising))
    return outcomes
