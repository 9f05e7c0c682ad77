"""The detection study: average precision of sensor types × numbers, against price and coverage.

Placements come from the integer program, clouds from simulated traffic. A detector is trained on all placements at once
(or one detector on each), several times with different seeds, and evaluated with each placement on unseen traffic.
"""

import math
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path

from headless.detection.average_precision import ADVISED_TEST_RUNS, Evaluation, balanced_score, evaluate
from headless.detection.detector import Detector
from headless.detection.detector_evaluation import AT_ONCE, detect_in_runs, side_by_side
from headless.detection.frame_results import FrameResult
from headless.detection.frames import SampledRecording
from headless.detection.recordings import MountedSensors, SampledRun, Simulator, sampled_runs
from headless.detection.rules import MAIN_RULE, precisions
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.suitability import suitability_warnings
from headless.detection.training import LearningCurve, TrainedDetector, deterministic, train
from headless.studies.coverage.cells import COUNTS, Case, Cell, solve_cell
from headless.studies.detection.sensor_configuration import SensorConfiguration
from headless.studies.false_positives import false_positives
from headless.studies.simulated_recordings import recorded

from seip_addon.core.arrays import Float
from seip_addon.core.errors import SeipError
from seip_addon.core.output.results.detection_record import Precision
from seip_addon.core.progress import Progress, within
from seip_addon.core.sensing.traffic.run_overlap import MATCH_RADIUS, require_independent, vehicle_positions
from seip_addon.core.workflows.survey import Survey

from .claims import SeedResult
from .shared_bays import shared_bays

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

    def overlap(self) -> str:
        """Return a message with the overlap of the runs of each pair; see `require_independent`."""
        runs = (*self.training, *self.validation, *self.test)
        return require_independent(combinations([vehicle_positions(run.name, run.trajectories) for run in runs], 2))

    def shared_bays(self) -> str:
        """Return a message with the share of parked road users of test runs that stand as in runs of other splits."""
        others = (*self.training, *self.validation)
        most = max(
            shared_bays(one.trajectories, other.trajectories, MATCH_RADIUS) for one in self.test for other in others
        )
        return (
            f"at most {most:.0%} of the parked road users of a test run and of a training or validation run stand "
            f"within {MATCH_RADIUS:g} m of a parked road user of the other run"
        )


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
    return Traffic(*split_sampled(paths, origin, every))


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


def split_sampled(paths: Sequence[Path], origin: Float, every: float) -> tuple[tuple[SampledRun, ...], ...]:
    """Return the runs for training, validation and tests, without checking that they are independent."""
    if len(paths) < MIN_RUNS:
        raise SeipError(
            f"{len(paths)} runs of traffic are too few: name {MIN_RUNS} or more with --traffic, better "
            f"{RUNS_PER_TEST * ADVISED_TEST_RUNS}, made by `seip traffic` with different seeds; {SPLIT}"
        )
    runs = sampled_runs(paths, origin, every)
    tested = len(runs) // RUNS_PER_TEST
    trained_on = len(runs) - tested - max(1, len(runs) // RUNS_PER_VALIDATION)
    sparse = tuple(replace(run, times=run.times[::TEST_STRIDE]) for run in runs[trained_on:])
    return runs[:trained_on], sparse[:-tested], sparse[-tested:]


@dataclass(frozen=True, eq=False)
class ModelConfiguration:
    """A detector to be trained: its settings, seed and sensor configurations.

    Parameters
    ----------
    name : str
        Name of the detector and its file.
    configurations : tuple of SensorConfiguration
        Sensor configurations for training and evaluation.
    start : Detector, optional
        Detector with the initial weights; random weights if not given.
    """

    name: str
    configurations: tuple[SensorConfiguration, ...]
    network: NetworkSettings
    training: TrainingSettings
    start: Detector | None = None


@dataclass(frozen=True, eq=False)
class DetectorOutcome:
    """Results of one detector on one configuration's test frames.

    Parameters
    ----------
    score : float
        Least score of counted false positives: the best balance of precision and recall on validation frames.
    """

    model: ModelConfiguration
    configuration: SensorConfiguration
    frames: tuple[FrameResult, ...]
    evaluation: Evaluation
    score: float

    @property
    def seed_result(self) -> SeedResult:
        """Figures of this outcome for the claims."""
        configuration, false = self.configuration, false_positives(self.evaluation, self.score)
        return SeedResult(
            sensor=configuration.sensor,
            count=configuration.count,
            seed=self.model.training.seed,
            average_precision=self.evaluation.average_precision,
            price=configuration.deployment.price,
            coverage=configuration.deployment.coverage,
            false_positives=false.per_frame,
            sparse=false.sparse,
            padded=self.model.network.padded,
        )

    @cached_property
    def precisions(self) -> dict[str, Precision]:
        """Average precision by every rule."""
        return precisions(self.frames)


def model_configurations(
    configurations: Sequence[SensorConfiguration],
    network: NetworkSettings,
    training: TrainingSettings,
    *,
    seeds: int,
    separate: bool,
    start: Detector | None = None,
) -> list[ModelConfiguration]:
    """Return the models to be trained: one detector for all configurations, or one for each, with every seed."""
    groups = (
        {one.name.replace(" × ", "x"): (one,) for one in configurations} if separate else {"": tuple(configurations)}
    )
    return [
        ModelConfiguration(f"detector{name and '-'}{name}-{seed}", group, network, replace(training, seed=seed), start)
        for name, group in groups.items()
        for seed in range(1, seeds + 1)
    ]


def padded(some: Sequence[ModelConfiguration]) -> list[ModelConfiguration]:
    """Return the same models with pillars padded with zeros: the ablation of claim 9."""
    return [replace(model, name=f"{model.name}-padded", network=replace(model.network, padded=True)) for model in some]


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
    """Training and validation recordings, by the name of their sensor configuration."""

    training: dict[str, list[SampledRecording]]
    validation: dict[str, list[SampledRecording]]


def simulate_training_set(
    simulator: Simulator,
    configurations: Sequence[SensorConfiguration],
    traffic: Traffic,
    network: NetworkSettings,
) -> Generator[Progress, None, TrainingSet]:
    """Simulate the frames of all configurations, and store the training samples of a network."""
    area = simulator.area(network.pillar)

    def recordings(placed: MountedSensors, runs: Sequence[SampledRun]) -> list[SampledRecording]:
        return [SampledRecording(recorded(simulator, placed, run), area, network.most_points) for run in runs]

    training_set = TrainingSet(
        {one.name: recordings(one, traffic.training) for one in configurations},
        {one.name: recordings(one, traffic.validation) for one in configurations},
    )
    each = [
        (*training_set.training[one.name], *training_set.validation[one.name])
        for one in most_rays_first(configurations)
    ]
    yield from side_by_side([simulated(some) for some in each], AT_ONCE)
    return training_set


def most_rays_first(configurations: Iterable[SensorConfiguration]) -> list[SensorConfiguration]:
    """Return configurations in descending number of rays, so that no long work is left to one core at the end."""

    def rays(placed: SensorConfiguration) -> int:
        return sum(sensor.model.channels * sensor.model.azimuth_count for sensor in placed.sensors)

    return sorted(configurations, key=rays, reverse=True)


def simulated(recordings: Sequence[SampledRecording]) -> Generator[Progress, None, None]:
    """Simulate all frames of some recordings."""
    total, done = sum(map(len, recordings)), 0
    for sampled in recordings:
        for number in range(len(sampled)):
            yield Progress(done, total, f"simulate {sampled.recording.name}")
            sampled.get(number)
            done += 1


def training(
    model: ModelConfiguration, training_set: TrainingSet, *, device: str, store: Path | None = None
) -> Generator[Progress, None, TrainedDetector]:
    """Train a detector on the training set of its configurations."""
    names = [configuration.name for configuration in model.configurations]
    return train(
        [recording for name in names for recording in training_set.training[name]],
        [recording for name in names for recording in training_set.validation[name]],
        model.network,
        model.training,
        device=device,
        store=store,
        start=model.start,
    )


def still_rises(curve: LearningCurve) -> bool:
    """Return whether the last validation beats all before it by more than `STILL_RISING`, or there is but one."""
    *before, last = curve.validation.values()
    return last > max(before, default=-math.inf) + STILL_RISING


def train_all(
    models: Sequence[ModelConfiguration], training_set: TrainingSet, folder: Path, *, device: str
) -> Generator[Progress, None, list[TrainedDetector]]:
    """Train detectors, on the CPU one on each core; detectors trained before an interruption are read from files."""
    trainings = [training(model, training_set, device=device, store=folder / f"{model.name}.pt") for model in models]
    at_once = AT_ONCE if device == "cpu" else 1
    with deterministic(models[0].training.threads):  # around all works, as torch has one such setting for all threads
        return (yield from side_by_side(trainings, at_once))


def evaluate_all(
    simulator: Simulator, models: Sequence[ModelConfiguration], detectors: Sequence[Detector], traffic: Traffic
) -> Generator[Progress, None, list[DetectorOutcome]]:
    """Evaluate every detector with each of its configurations; a frame is simulated once for all of them."""
    configurations = most_rays_first({one.name: one for model in models for one in model.configurations}.values())
    runs = (*traffic.validation, *traffic.test)
    threads = models[0].training.threads
    model_numbers = [
        [number for number, model in enumerate(models) if configuration in model.configurations]
        for configuration in configurations
    ]
    works = [
        detect_in_runs(simulator, configuration, runs, [detectors[number] for number in numbers], threads)
        for configuration, numbers in zip(configurations, model_numbers, strict=True)
    ]
    with deterministic(threads):  # around all works, as torch has one such setting for all threads
        found = yield from side_by_side(works, AT_ONCE)
    aside = sum(len(run.times) for run in traffic.validation)
    validated: dict[tuple[str, str], list[FrameResult]] = {}
    tested: dict[tuple[str, str], list[FrameResult]] = {}
    for configuration, numbers, results in zip(configurations, model_numbers, found, strict=True):
        for number, frames in zip(numbers, results, strict=True):
            validated[models[number].name, configuration.name] = frames[:aside]
            tested[models[number].name, configuration.name] = frames[aside:]
    return [outcome for model in models for outcome in _outcomes(model, validated, tested)]


def suitability_by_configuration(
    simulator: Simulator, models: Sequence[ModelConfiguration], detectors: Sequence[Detector], traffic: Traffic
) -> dict[str, tuple[str, ...]]:
    """Return the warnings about using the detectors with each sensor configuration, by its name."""
    found: dict[str, dict[str, None]] = {}
    frames = {one.name: simulator.frame(one, traffic.test[0], 0) for model in models for one in model.configurations}
    for model, detector in zip(models, detectors, strict=True):
        for one in model.configurations:
            area = simulator.area(detector.settings.pillar)
            warnings = suitability_warnings(detector, one.types, area, frames[one.name])
            found.setdefault(one.name, {}).update(dict.fromkeys(warnings))
    return {name: tuple(warnings) for name, warnings in found.items()}


def _outcomes(
    model: ModelConfiguration,
    validated: Mapping[tuple[str, str], list[FrameResult]],
    tested: Mapping[tuple[str, str], list[FrameResult]],
) -> Iterator[DetectorOutcome]:
    names = [configuration.name for configuration in model.configurations]
    score = balanced_score(evaluate([frame for name in names for frame in validated[model.name, name]], MAIN_RULE))
    for configuration in model.configurations:
        frames = tuple(tested[model.name, configuration.name])
        yield DetectorOutcome(model, configuration, frames, evaluate(frames, MAIN_RULE), score)
