"""The detection study: average precision of each sensor type and number, against price and coverage.

The steps, in order: `place_all` finds the placements with the integer program; `read_traffic` splits the runs of
traffic; `simulate_training_set` simulates point clouds of training and validation runs; `train_all` trains one detector
per seed on all placements at once; `evaluate_all` evaluates each detector with each placement on unseen traffic.
"""

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, combinations
from pathlib import Path

from headless.detection.average_precision import ADVISED_TEST_RUNS, Evaluation, balanced_score, evaluate
from headless.detection.detector import Detector
from headless.detection.detector_evaluation import AT_ONCE, detect_in_runs, side_by_side
from headless.detection.frame_results import FrameResult
from headless.detection.frames import Recording, SampledRecording
from headless.detection.recordings import MountedSensors, SampledRun, Simulator, poses_key, sampled_runs
from headless.detection.rules import MAIN_RULE
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.training import LearningCurve, make_deterministic, train
from headless.studies.coverage.cells import COUNTS, Case, Cell, solve_cell

import numpy as np

from seip_addon.core.base.arrays import Float
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress, within
from seip_addon.core.choosing.placement.deployment import Deployment
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.traffic.run_overlap import require_independent, vehicle_positions
from seip_addon.core.workflows.survey import Survey

from .claims import SeedResult

MIN_RUNS = 4  # one for training, one for validation, two for tests
STILL_RISING = 0.02  # lead in average precision of the last validation above which training has not converged
RUNS_PER_TEST, RUNS_PER_VALIDATION = 2, 8  # one run in 2 is for tests, one in 8 for validation

SPLIT = "the last half is for tests, an eighth before it (at least one) for validation, the others for training"
"""Split of the runs, as a message."""

TEST_STRIDE = 2  # only every second frame is tested, as successive frames are similar

TrainingSet = tuple[list[SampledRecording], list[SampledRecording]]
"""Training and validation recordings of all sensor configurations."""


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
        """Return a message with the overlap of each pair of runs; see `require_independent`."""
        positions = [vehicle_positions(run.name, run.trajectories) for run in self.runs]
        return require_independent(combinations(positions, 2))


def read_traffic(paths: Sequence[Path], origin: Float, every: float) -> Traffic:
    """Read runs, and split them: the last half (rounded down) for tests, an eighth before it for validation.

    Parameters
    ----------
    origin : (3,) float64, metres
        Origin of the scene's local axes.
    every : float, seconds
        Time between training frames; `TEST_STRIDE` times that between validation and test frames.

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
    tests = len(runs) // RUNS_PER_TEST
    training = len(runs) - tests - max(1, len(runs) // RUNS_PER_VALIDATION)
    sparse = tuple(replace(run, times=run.times[::TEST_STRIDE]) for run in runs[training:])
    return Traffic(runs[:training], sparse[:-tests], sparse[-tests:])


@dataclass(frozen=True, eq=False)
class SensorConfiguration(MountedSensors):
    """Sensors of one type with the largest coverage.

    Parameters
    ----------
    sensors : tuple of MountedSensor
        Sensors of the deployment.
    sensor : str
        Type, by which charts and tables group it.
    count : int
        N, the requested number of sensors.
    """

    sensors: tuple[MountedSensor, ...] = field(init=False)
    deployment: Deployment
    sensor: str
    count: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "sensors", self.deployment.sensors)

    @classmethod
    def of_case(cls, case: Case) -> "SensorConfiguration":
        """Return the configuration of a solved cell."""
        return cls(f"{case.count} × {case.sensor}", case.deployment, case.sensor, case.count)


@dataclass(frozen=True, eq=False)
class DetectorOutcome:
    """Results of one detector on one configuration's test frames.

    Parameters
    ----------
    seed : int
        Seed of the detector's training.
    score : float
        Score with the highest F1 on validation frames; false positives are counted from this score on.
    still_rising : bool
        Whether the training had not converged; see `still_rises`.
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
        configuration, (false, sparse) = self.configuration, false_positives(self.evaluation, self.score)
        return SeedResult(
            sensor=configuration.sensor,
            count=configuration.count,
            seed=self.seed,
            average_precision=self.evaluation.average_precision,
            price=configuration.deployment.price,
            coverage=configuration.deployment.coverage,
            false_positives=false,
            sparse=sparse,
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
    cases: list[Case] = []
    for done, cell in enumerate(cells):
        progress = Progress(done, len(cells), f"place {cell.count} × {cell.sensor}")
        yield progress
        steps = solve_cell(site, models, visible, cell, survey.settings.limits)
        cases.append((yield from within(progress, steps)))
    yield Progress(len(cells), len(cells), "placed")
    return tuple(map(SensorConfiguration.of_case, cases))


def simulate_training_set(
    simulator: Simulator, configurations: Sequence[SensorConfiguration], traffic: Traffic, network: NetworkSettings
) -> Generator[Progress, None, TrainingSet]:
    """Simulate training and validation frames of all configurations as samples for a network."""
    area = simulator.area(network.pillar)

    def samples(configuration: SensorConfiguration, runs: Sequence[SampledRun]) -> list[SampledRecording]:
        return [SampledRecording(recorded(simulator, configuration, run), area, network.most_points) for run in runs]

    training, validation = (
        [samples(one, runs) for one in configurations] for runs in (traffic.training, traffic.validation)
    )
    works = [simulate_all([*some, *others]) for some, others in zip(training, validation, strict=True)]
    yield from side_by_side(works, AT_ONCE)
    return list(chain(*training)), list(chain(*validation))


def recorded(simulator: Simulator, configuration: MountedSensors, run: SampledRun) -> Recording:
    """Return the frames of a run, simulated on access."""
    return Recording(
        f"{configuration.name} in {run.name}",
        run.key,
        len(run.times),
        lambda number: simulator.frame(configuration, run, number),
        configuration.types,
        simulator.site,
        poses_key(configuration),
    )


def simulate_all(recordings: Sequence[SampledRecording]) -> Generator[Progress, None, None]:
    """Simulate every frame of recordings."""
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
) -> Generator[Progress, None, list[tuple[Detector, LearningCurve]]]:
    """Train a detector with each of the seeds 1 to ``seeds``, in parallel on the CPU.

    Parameters
    ----------
    folder : path
        Folder for the detectors, ``detector-SEED.pt``; those already there are not trained again.
    seeds : int
        Number of detectors.
    device : str
        Torch device, such as ``cpu`` or ``cuda``.
    start : Detector, optional
        Detector with the initial weights; random weights if not given.
    """
    trainings = [
        train(
            *training_set,
            network,
            replace(training, seed=seed),
            device=device,
            store=folder / f"detector-{seed}.pt",
            start=start,
        )
        for seed in range(1, seeds + 1)
    ]
    return (yield from side_by_side(trainings, AT_ONCE if device == "cpu" else 1))


def still_rises(curve: LearningCurve) -> bool:
    """Return whether the last validation beats all before it by more than `STILL_RISING`, or is the only one."""
    *before, last = curve.validation.values()
    return last > max(before, default=-math.inf) + STILL_RISING


def evaluate_all(
    simulator: Simulator,
    configurations: Sequence[SensorConfiguration],
    trained: Sequence[tuple[Detector, LearningCurve]],
    traffic: Traffic,
    threads: int,
) -> Generator[Progress, None, list[DetectorOutcome]]:
    """Evaluate every detector with each configuration; a frame is simulated once for all of them.

    Parameters
    ----------
    threads : int
        CPU threads of torch; their number affects the exact result.
    """
    runs, detectors = (*traffic.validation, *traffic.test), [detector for detector, _ in trained]
    detections = [detect_in_runs(simulator, one, runs, detectors) for one in configurations]
    make_deterministic(threads)
    results = yield from side_by_side(detections, AT_ONCE)
    validated = sum(len(run.times) for run in traffic.validation)
    outcomes = []
    for number, (_, curve) in enumerate(trained):
        frames = [by_detector[number] for by_detector in results]
        # one score for each detector, whatever the sensors
        score = balanced_score(evaluate(list(chain(*(some[:validated] for some in frames))), MAIN_RULE))
        for configuration, some in zip(configurations, frames, strict=True):
            tested = tuple(some[validated:])
            outcomes.append(
                DetectorOutcome(
                    seed=number + 1,
                    configuration=configuration,
                    frames=tested,
                    evaluation=evaluate(tested, MAIN_RULE),
                    score=score,
                    still_rising=still_rises(curve),
                )
            )
    return outcomes


def false_positives(evaluation: Evaluation, score: float) -> tuple[float, float]:
    """Count the false detections with at least some score.

    Returns
    -------
    per_frame : float
    sparse : float, 0 to 1
        Share of them that lie where the cloud is sparser than around half of the hits; chance alone gives a half.
        NaN without false detections or without hits.
    """
    detections = evaluation.detections
    counted = detections.score >= score
    false, hits = ~detections.hit & counted, detections.density[detections.hit & counted]
    known = false.any() and len(hits)
    sparse = float((detections.density[false] < np.median(hits)).mean()) if known else np.nan
    return float(false.sum()) / len(evaluation.run), sparse
