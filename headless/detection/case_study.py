"""The detection study: average precision of sensor types × numbers, against price and coverage.

Placements come from the integer program, clouds from simulated traffic. One
detector learns from all placements at once (or one from each), several times
with other seeds, and is judged with each placement on traffic that none has
seen.
"""

from __future__ import annotations

import os
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path

from headless.coverage_study import NUMBERS, Case, Cell, solve_cell

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.errors import SeipError
from seip_addon.core.estimates import Interval
from seip_addon.core.lidar import LidarModel
from seip_addon.core.progress import Progress, side_by_side, within
from seip_addon.core.scans import Frame
from seip_addon.core.site.site import Site
from seip_addon.core.traffic import Trajectories
from seip_addon.core.traffic.run_overlap import require_independent, vehicle_positions
from seip_addon.core.visibility.grid import VisibilityGrid

from .average_precision import Evaluation, average_precision_interval, balanced_score, evaluate
from .breakdown import false_positives
from .claims import Trial
from .cloud_in_plan import CloudInPlan
from .detections import Detections
from .detector import Detector
from .frame_results import FrameResult, frame_result
from .frames import SampledRecording
from .inference import detect
from .kitti import kitti
from .matching import Rule
from .pillars import PillarGrid
from .recordings import Configuration, Studio, TrafficRun
from .settings import GROUPS, NetworkSettings, TrainingSettings
from .suitability import suitability_warnings
from .training import Trained, deterministic, train

RULES = {
    "bev_0.7": Rule(),
    "bev_0.5": Rule(iou=0.5),
    "3d_0.7": Rule(in_space=True),
    "bev_0.7_from_5_points": Rule(fewest_points=5),
}
"""How average precision is taken; the first is the study's own."""

MAIN = next(iter(RULES.values()))

FEWEST_RUNS = 4
"""One to learn from, one for validation, two for tests."""

WARM_UP = 2.0
"""Seconds from the first sample of a run to its first frame."""

SIDE_BY_SIDE = (os.cpu_count() or 1) + 1
"""Trainings at once on the CPU: one more than there are cores, as each also waits."""


@dataclass(frozen=True, eq=False)
class Traffic:
    """Runs of traffic by what they are for.

    Parameters
    ----------
    training, validation, test : tuple of TrafficRun
        To learn from, to see by when that is enough, and to judge with.

    Raises
    ------
    SeipError
        Two runs are nearly the same: their frames show the same vehicles in the same places.
    """

    training: tuple[TrafficRun, ...]
    validation: tuple[TrafficRun, ...]
    test: tuple[TrafficRun, ...]

    def __post_init__(self) -> None:
        self.overlap()

    def overlap(self) -> str:
        """Return a sentence on how much the runs of each pair overlap; see `require_independent`."""
        runs = (*self.training, *self.validation, *self.test)
        return require_independent(combinations([vehicle_positions(run.name, run.trajectories) for run in runs], 2))


def read_traffic(paths: Sequence[Path], origin: Float, every: float) -> Traffic:
    """Read runs: the last two are for tests, the one before for validation, the others to learn from.

    Parameters
    ----------
    origin : (3,) float64, metres
        Of the scene's local axes.
    every : float, seconds
        From frame to frame.

    Raises
    ------
    SeipError
        There are too few, or one is too short.
    """
    if len(paths) < FEWEST_RUNS:
        raise SeipError(
            f"{len(paths)} runs of traffic are too few: name {FEWEST_RUNS} or more with --traffic, made by "
            "headless/traffic.py with a seed each; the last two are for tests, the one before for validation"
        )
    runs = read_runs(paths, origin, every)
    return Traffic(runs[:-3], runs[-3:-2], runs[-2:])


def read_runs(paths: Sequence[Path], origin: Float, every: float) -> tuple[TrafficRun, ...]:
    """Read runs, each looked at from `WARM_UP` on; see `read_traffic`."""
    runs = []
    for path in paths:
        trajectories = Trajectories.load(path).moved_to(origin)
        begin, end = trajectories.span
        times = np.arange(begin + WARM_UP, end, every)
        if not len(times):
            raise SeipError(f"{path} is shorter than {WARM_UP:g} s: simulate more traffic")
        runs.append(TrafficRun(path.stem, trajectories, times))
    return tuple(runs)


@dataclass(frozen=True, eq=False)
class Pupil:
    """A detector that is to be trained.

    Parameters
    ----------
    name : str
        Also of its file.
    configurations : tuple of Configuration
        Whose clouds it learns from, and is judged with.
    """

    name: str
    configurations: tuple[Configuration, ...]
    network: NetworkSettings
    training: TrainingSettings


@dataclass(frozen=True, eq=False)
class Judgement:
    """What one detector made of one configuration's test frames.

    Parameters
    ----------
    evaluation : Evaluation
        By the study's rule.
    score : float
        From which on false positives are counted: the best balance of precision and recall on validation frames.
    """

    pupil: Pupil
    configuration: Configuration
    frames: tuple[FrameResult, ...]
    evaluation: Evaluation
    score: float

    @property
    def trial(self) -> Trial:
        """Its figures, as the claims need them."""
        case, false = self.configuration.case, false_positives(self.evaluation, self.score)
        return Trial(
            sensor=case.sensor,
            count=case.count,
            seed=self.pupil.training.seed,
            average_precision=self.evaluation.average_precision,
            price=case.deployment.price,
            coverage=case.deployment.coverage,
            false_positives=false.per_frame,
            sparse=false.sparse,
            padded=self.pupil.network.padded,
        )

    @cached_property
    def precisions(self) -> dict[str, float]:
        """Average precision by every rule, and KITTI's figures for the study's own."""
        by_rule = {name: evaluate(self.frames, rule).average_precision for name, rule in RULES.items()}
        figures = kitti(self.frames, MAIN)
        return by_rule | {"kitti_ap40": figures.ap40, "kitti_ap11": figures.ap11}

    @cached_property
    def interval(self) -> Interval | None:
        """95 % interval of the average precision over other traffic like this."""
        return average_precision_interval(self.evaluation, seed=0)


def pupils(
    configurations: Sequence[Configuration],
    network: NetworkSettings,
    training: TrainingSettings,
    *,
    seeds: int,
    separate: bool,
) -> list[Pupil]:
    """Return who is to be trained: one detector for all configurations, or one for each, with every seed."""
    groups = (
        {one.name.replace(" × ", "x"): (one,) for one in configurations} if separate else {"": tuple(configurations)}
    )
    return [
        Pupil(f"detector{name and '-'}{name}-{seed}", group, network, replace(training, seed=seed))
        for name, group in groups.items()
        for seed in range(1, seeds + 1)
    ]


def padded(some: Sequence[Pupil]) -> list[Pupil]:
    """Return the same with pillars that are padded with zeros: the ablation of claim 9."""
    return [replace(pupil, name=f"{pupil.name}-padded", network=replace(pupil.network, padded=True)) for pupil in some]


def place_all(
    site: Site, models: Mapping[str, LidarModel], grid: VisibilityGrid, *, solver: str, time_limit: float, effort: float
) -> Generator[Progress, None, tuple[Configuration, ...]]:
    """Place 1, 2 and 4 sensors of each type where they cover most.

    Raises
    ------
    SeipError
        There are fewer positions than sensors, or a type sees nothing.
    """
    visible = grid.visible
    cells = [Cell(sensor, None, count, 1.0) for sensor in models for count in NUMBERS]
    placed: list[Case] = []
    for done, cell in enumerate(cells):
        progress = Progress(done, len(cells), f"place {cell.count} × {cell.sensor}")
        yield progress
        steps = solve_cell(site, models, visible, cell, solver=solver, time_limit=time_limit, effort=effort)
        placed.append((yield from within(progress, steps)))
    yield Progress(len(cells), len(cells), "placed")
    return tuple(Configuration(case) for case in placed)


@dataclass(frozen=True, eq=False)
class Lessons:
    """What detectors learn from, and by what is seen when that is enough: recordings by their configuration's name."""

    training: dict[str, list[SampledRecording]]
    validation: dict[str, list[SampledRecording]]


def simulate_lessons(
    studio: Studio,
    configurations: Sequence[Configuration],
    traffic: Traffic,
    grid: PillarGrid,
    most_points: int,
) -> Generator[Progress, None, Lessons]:
    """Simulate what the configurations measure, and keep what a detector on a grid learns from it."""
    lessons = Lessons({}, {})
    total = sum(len(run.times) for run in (*traffic.training, *traffic.validation)) * len(configurations)
    done = 0
    for configuration in configurations:
        for kept, runs in ((lessons.training, traffic.training), (lessons.validation, traffic.validation)):
            kept[configuration.name] = [
                SampledRecording(studio.record(configuration, run), grid, most_points) for run in runs
            ]
            for sampled in kept[configuration.name]:
                for number in range(len(sampled)):
                    yield Progress(done, total, f"simulate {configuration.name}")
                    sampled.get(number)
                    done += 1
    yield Progress(total, total, "simulated")
    return lessons


def training(
    pupil: Pupil, lessons: Lessons, *, device: str, store: Path | None = None
) -> Generator[Progress, None, Trained]:
    """Train a detector on the lessons of its configurations."""
    names = [configuration.name for configuration in pupil.configurations]
    return train(
        [recording for name in names for recording in lessons.training[name]],
        [recording for name in names for recording in lessons.validation[name]],
        pupil.network,
        pupil.training,
        device=device,
        store=store,
    )


def train_all(
    pupils: Sequence[Pupil], lessons: Lessons, folder: Path, *, device: str
) -> Generator[Progress, None, list[Trained]]:
    """Train detectors, on the CPU one on each core; what was trained before an interruption is not trained again.

    Parameters
    ----------
    folder : path
        Of the detectors' files.
    device : str
        Of torch.
    """
    trainings = [training(pupil, lessons, device=device, store=folder / f"{pupil.name}.pt") for pupil in pupils]
    at_once = SIDE_BY_SIDE if device == "cpu" else 1
    with deterministic(pupils[0].training.threads):  # all the time, as torch keeps one such setting for all threads
        return (yield from side_by_side(trainings, at_once))


def judge_all(
    studio: Studio, pupils: Sequence[Pupil], detectors: Sequence[Detector], traffic: Traffic
) -> Generator[Progress, None, list[Judgement]]:
    """Judge every detector with each of its configurations; a frame is simulated once for all of them."""
    configurations = {one.name: one for pupil in pupils for one in pupil.configurations}.values()
    total = len(configurations) * sum(len(run.times) for run in (*traffic.validation, *traffic.test))
    done = 0
    tried: dict[tuple[str, str], list[FrameResult]] = {}
    judged: dict[tuple[str, str], list[FrameResult]] = {}
    for configuration in configurations:
        asked = [
            (pupil, detector)
            for pupil, detector in zip(pupils, detectors, strict=True)
            if configuration in pupil.configurations
        ]
        for results, runs in ((tried, traffic.validation), (judged, traffic.test)):
            for run in runs:
                for number in range(len(run.times)):
                    yield Progress(done, total, f"detect with {configuration.name}")
                    done += 1
                    frame = studio.frame(configuration, run, number)
                    cloud = CloudInPlan(frame.points)
                    for pupil, detector in asked:
                        with deterministic(pupil.training.threads):
                            found = detect(detector, frame.points, frame.intensity)
                        result = _result(studio, configuration, run, frame, cloud, found)
                        results.setdefault((pupil.name, configuration.name), []).append(result)
    yield Progress(total, total, "judged")
    return [judgement for pupil in pupils for judgement in _judgements(pupil, tried, judged)]


def foreseen(
    studio: Studio, pupils: Sequence[Pupil], detectors: Sequence[Detector], traffic: Traffic
) -> dict[str, tuple[str, ...]]:
    """Return what speaks against trusting the detectors with each configuration, by its name, in sentences."""
    found: dict[str, dict[str, None]] = {}
    frames = {one.name: studio.frame(one, traffic.test[0], 0) for pupil in pupils for one in pupil.configurations}
    for pupil, detector in zip(pupils, detectors, strict=True):
        for one in pupil.configurations:
            sentences = suitability_warnings(detector, [one.case.sensor], studio.site, frames[one.name].points)
            found.setdefault(one.name, {}).update(dict.fromkeys(sentences))
    return {name: tuple(sentences) for name, sentences in found.items()}


def _judgements(
    pupil: Pupil,
    tried: Mapping[tuple[str, str], list[FrameResult]],
    judged: Mapping[tuple[str, str], list[FrameResult]],
) -> Iterator[Judgement]:
    names = [configuration.name for configuration in pupil.configurations]
    score = balanced_score(evaluate([frame for name in names for frame in tried[pupil.name, name]], MAIN))
    for configuration in pupil.configurations:
        frames = tuple(judged[pupil.name, configuration.name])
        yield Judgement(pupil, configuration, frames, evaluate(frames, MAIN), score)


def _result(
    studio: Studio,
    configuration: Configuration,
    run: TrafficRun,
    frame: Frame,
    cloud: CloudInPlan,
    found: Detections,
) -> FrameResult:
    return frame_result(
        frame,
        cloud,
        found,
        classes=tuple(GROUPS.values()),
        region=studio.static.region,
        sensors=configuration.places,
        run=run.name,
    )
