"""Average precision against the size of each disturbance, and on other types, traffic and sites.

Trained detectors that differ only in their seeds are evaluated on the same test
frames under one disturbance at a time. A disturbance begins to harm at the
smallest size at which average precision is significantly lower than without it:
the interval of the paired difference, over traffic and trainings, is below 0.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from headless.charts.detection import Bin
from headless.detection.average_precision import Evaluation
from headless.detection.breakdown import DISTANCE_EDGES, POINT_EDGES, recall_by
from headless.detection.detector import Detector
from headless.detection.pillars import Filling, filling
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.studies.detection.case_study import ModelConfiguration, model_configurations, padded
from headless.studies.detection.sensor_configuration import SensorConfiguration
from headless.studies.false_positives import false_by

import numpy as np

from seip_addon.core.estimates import IntervalEstimate
from seip_addon.core.progress import Progress, within

from .disturbances import (
    CappedPillars,
    ClockOffset,
    Disturbance,
    DropOff,
    OtherSizes,
    PositionError,
    Rain,
    RangeNoise,
    SensorFailure,
    Thinned,
    TiltError,
    YawError,
)
from .paired_change import ResampledPrecision, change, level
from .trials import DisturbedTrial, EvaluatedDetector, TrialSite, trials

Series = tuple[Disturbance, ...]
"""Disturbances of one kind, the mildest first."""

BORDER_EDGES = (0.0, 2.0, 5.0, 10.0, 20.0, 40.0, np.inf)
"""Edges of bins of the distance from the border of the region of interest, metres."""

AT_HOME = "at home"
"""Reference for detectors on other sites: the same detectors, on the frames of the site of their training."""

COUNTED_FRAMES = 8  # frames in which pillars are counted


def full_series(sensor: int) -> tuple[Series, ...]:
    """Return all disturbances; those of one sensor are of the sensor with this number."""
    return (
        tuple(RangeNoise(size) for size in (0.02, 0.05, 0.1, 0.2, 0.4)),
        tuple(DropOff(size) for size in (0.1, 0.25, 0.5, 0.75, 0.9)),
        tuple(Rain(size) for size in (2.0, 5.0, 10.0, 20.0, 40.0)),
        tuple(PositionError(size, sensor) for size in (0.02, 0.05, 0.1, 0.2, 0.5)),
        tuple(YawError(size, sensor) for size in (0.1, 0.2, 0.5, 1.0, 2.0)),
        tuple(TiltError(size, sensor) for size in (0.1, 0.2, 0.5, 1.0, 2.0)),
        tuple(ClockOffset(size, sensor) for size in (0.02, 0.05, 0.1, 0.2, 0.4)),
        tuple(Thinned(size) for size in (0.25, 0.5, 0.75)),
        tuple(OtherSizes(size) for size in (0.05, 0.15)),
        tuple(CappedPillars(size) for size in (8.0, 4.0, 2.0, 1.0)),
    )


def brief_series(sensor: int) -> tuple[Series, ...]:
    """Return a shorter series of disturbances, for further sensor types."""
    return (
        tuple(RangeNoise(size) for size in (0.05, 0.1, 0.2)),
        tuple(DropOff(size) for size in (0.25, 0.5, 0.75)),
        tuple(Rain(size) for size in (5.0, 20.0)),
        tuple(YawError(size, sensor) for size in (0.2, 0.5, 1.0)),
        tuple(ClockOffset(size, sensor) for size in (0.05, 0.2)),
    )


@dataclass(frozen=True, eq=False)
class DisturbanceEffect:
    """Average precision under a disturbance of one size.

    Parameters
    ----------
    precision, change : IntervalEstimate
        Mean average precision over the detectors, and its change by the disturbance.
    """

    disturbance: Disturbance
    precision: IntervalEstimate
    change: IntervalEstimate


@dataclass(frozen=True, eq=False)
class DisturbanceCurve:
    """Average precision against the size of one disturbance.

    Parameters
    ----------
    points : tuple of DisturbanceEffect
        Effects by size, the mildest first.
    """

    configuration: str
    undisturbed: IntervalEstimate
    points: tuple[DisturbanceEffect, ...]

    @property
    def name(self) -> str:
        """Name of the disturbance."""
        return self.points[0].disturbance.name

    @property
    def unit(self) -> str:
        """Unit of its size."""
        return self.points[0].disturbance.unit

    @property
    def begins(self) -> DisturbanceEffect | None:
        """The smallest size that lowers average precision significantly, or None."""
        return next((point for point in self.points if point.change.high < 0), None)


@dataclass(frozen=True, eq=False)
class SeedSpread:
    """Spread of average precision over seeds of the training, with one placement.

    Parameters
    ----------
    values : tuple of float
        Average precision of each detector.
    """

    configuration: str
    values: tuple[float, ...]
    precision: IntervalEstimate


@dataclass(frozen=True, eq=False)
class TransferResult:
    """Average precision of detectors on types, traffic or sites that they were not trained on.

    Parameters
    ----------
    trained_on, tested_on : str
        Sensor type or site of the training, and of the test.
    precision : IntervalEstimate
        Average precision in the test.
    change : IntervalEstimate
        Change against ``against``.
    against : str
        Name of the reference whose average precision is subtracted.
    """

    trained_on: str
    tested_on: str
    precision: IntervalEstimate
    change: IntervalEstimate
    against: str


@dataclass(frozen=True, eq=False)
class BorderResults:
    """Recall by distance from the region's border, of the first detector with one placement.

    Parameters
    ----------
    score : float
        Least score of the detections that count.
    recall, false : mapping of str to tuple of Bin
        Recall by ``points`` (returns from the road user), ``sensor`` and ``border`` (metres from the nearest sensor
        and from the border of the region); false detections per frame by the last two.
    """

    configuration: str
    score: float
    recall: Mapping[str, tuple[Bin, ...]]
    false: Mapping[str, tuple[Bin, ...]]


@dataclass(frozen=True, eq=False)
class PillarFilling:
    """Filling of pillars with one placement.

    Parameters
    ----------
    filling : dict of int to Filling
        Filling by the largest number of points in a pillar; means over some frames.
    """

    configuration: str
    filling: dict[int, Filling]


@dataclass(frozen=True, eq=False)
class OtherSite:
    """Another site, on which detectors are evaluated that were not trained there.

    Parameters
    ----------
    configurations : tuple of SensorConfiguration
        Configurations on the site, with names of configurations on the home site.
    """

    site: TrialSite
    configurations: tuple[SensorConfiguration, ...]


@dataclass(frozen=True, eq=False)
class EvaluatedDetectors:
    """Detectors to be evaluated on the site that they were trained on.

    Parameters
    ----------
    tested : tuple of EvaluatedDetector
        Detectors that differ only in their seeds.
    by_type : mapping of str to EvaluatedDetector
        Detectors trained on only one sensor type, by type.
    shipped : tuple of EvaluatedDetector
        The shipped detector, which was trained on random sites; empty to leave it out.
    padded, unpadded : tuple of EvaluatedDetector
        Detectors with pillars padded with zeros, and comparable ones without, trained for the same number of steps.
    """

    tested: tuple[EvaluatedDetector, ...]
    by_type: Mapping[str, EvaluatedDetector]
    shipped: tuple[EvaluatedDetector, ...] = ()
    padded: tuple[EvaluatedDetector, ...] = ()
    unpadded: tuple[EvaluatedDetector, ...] = ()


@dataclass(frozen=True, eq=False)
class TrainingPlan:
    """Detectors that have to be trained before the study.

    Parameters
    ----------
    alike : tuple of ModelConfiguration
        Models that differ only in their seeds, as the detection study trains them: in its folder they are not trained
        again.
    by_type : dict of str to ModelConfiguration
        Models trained on only one sensor type, by type.
    padded : tuple of ModelConfiguration
        Models with padded pillars; empty to leave padding out.
    """

    alike: tuple[ModelConfiguration, ...]
    by_type: dict[str, ModelConfiguration]
    padded: tuple[ModelConfiguration, ...]

    @property
    def models(self) -> tuple[ModelConfiguration, ...]:
        """All models, in the order for `case_study.train_all`."""
        return (*self.alike, *self.by_type.values(), *self.padded)

    def candidates(
        self, detectors: Sequence[Detector], shipped: tuple[EvaluatedDetector, ...] = ()
    ) -> EvaluatedDetectors:
        """Return the detectors to be evaluated, from those of all models in their order and the shipped one."""
        trained = {
            model.name: EvaluatedDetector(model.name, detector)
            for model, detector in zip(self.models, detectors, strict=True)
        }
        return EvaluatedDetectors(
            tested=tuple(trained[model.name] for model in self.alike),
            by_type={sensor: trained[model.name] for sensor, model in self.by_type.items()},
            shipped=shipped,
            padded=tuple(trained[model.name] for model in self.padded),
            unpadded=tuple(trained[model.name] for model in self.alike[: len(self.padded)]),
        )


def training_plan(
    configurations: Sequence[SensorConfiguration],
    network: NetworkSettings,
    training: TrainingSettings,
    *,
    seeds: int,
    padding: bool,
) -> TrainingPlan:
    """Return the detectors to train.

    A detector of one type is trained for the share of the steps that its clouds have of all clouds.

    Parameters
    ----------
    configurations : sequence of SensorConfiguration
        All configurations of an evaluation.
    training : TrainingSettings
        Training settings of the models for all types.
    padding : bool
        Whether to include the ablation: each model again, with padded pillars.
    """
    by_seed = model_configurations(configurations, network, training, seeds=seeds, separate=False)
    by_type = {}
    for sensor in dict.fromkeys(one.sensor for one in configurations):
        own = tuple(one for one in configurations if one.sensor == sensor)
        steps = max(1, training.steps * len(own) // len(configurations))
        by_type[sensor] = ModelConfiguration(f"detector-{sensor}", own, network, replace(training, steps=steps))
    return TrainingPlan(tuple(by_seed), by_type, tuple(padded(by_seed)) if padding else ())


@dataclass(frozen=True, eq=False)
class LimitsStudy:
    """Limits of the detector on one site.

    Parameters
    ----------
    name : str
        Name of the site.
    frames : int
        Test frames of each trial at home.
    worst : mapping of str to int
        Number, from 0, of the sensor whose failure costs most, for each configuration: the disturbances of one
        sensor are of this one.
    transfers : tuple of TransferResult
        Results of detectors on other types, traffic and sites.
    padding : tuple of TransferResult
        Effect of padding with zeros on each configuration; empty if no such detector was trained.
    """

    name: str
    frames: int
    spreads: tuple[SeedSpread, ...]
    curves: tuple[DisturbanceCurve, ...]
    worst: Mapping[str, int]
    transfers: tuple[TransferResult, ...]
    borders: tuple[BorderResults, ...]
    pillars: tuple[PillarFilling, ...]
    padding: tuple[TransferResult, ...]


def limits_study(
    home: TrialSite,
    configurations: Sequence[SensorConfiguration],
    candidates: EvaluatedDetectors,
    elsewhere: Sequence[OtherSite],
    store: Path,
    score: float,
) -> Generator[Progress, None, LimitsStudy]:
    """Evaluate detectors under growing disturbances.

    Parameters
    ----------
    home : TrialSite
        Site of the training, with unseen traffic.
    configurations : sequence of SensorConfiguration
        Sensor configurations; the first is tested with all disturbances, the others with the brief series.
    store : path
        Folder of all trials; an interrupted study resumes from it.
    score : float
        Least score of counted detections: the best balance of precision and recall on validation frames.

    Yields
    ------
    Progress
        Number of finished trials.
    """
    runner = _TrialRunner(home, store, _length(configurations, candidates, elsewhere))
    spreads, curves, borders, pillars, worst = [], [], [], [], {}
    for number, configuration in enumerate(configurations):
        tried = yield from runner.run(configuration, Disturbance(), candidates.tested)
        own = [ResampledPrecision(trial.evaluation) for trial in tried]
        spreads.append(SeedSpread(configuration.name, tuple(one.value for one in own), level(own)))
        borders.append(_borders(configuration.name, tried[0], score))
        pillars.append(_pillars(home, configuration, candidates.tested[0].detector))
        loss = tuple(SensorFailure.each(sensor) for sensor in range(len(configuration.sensors)))
        lost = yield from runner.curve(configuration, loss, candidates.tested, own)
        worst[configuration.name] = int(np.argmin([point.change.value for point in lost.points]))
        curves.append(lost)
        series = full_series if number == 0 else brief_series
        for one in series(worst[configuration.name]):
            curve = yield from runner.curve(configuration, one, candidates.tested, own)
            curves.append(curve)
    transfers = yield from runner.transfers(configurations, candidates, elsewhere)
    padding = yield from runner.padding(configurations, candidates)
    yield runner.progress("tried")
    return LimitsStudy(
        home.simulator.site,
        sum(len(run.times) for run in home.runs),
        tuple(spreads),
        tuple(curves),
        worst,
        tuple(transfers),
        tuple(borders),
        tuple(pillars),
        tuple(padding),
    )


class _TrialRunner:
    """Runner of trials, which counts them for progress."""

    def __init__(self, home: TrialSite, store: Path, total: int) -> None:
        self._home, self._store, self._total, self._done = home, store, total, 0

    def progress(self, what: str) -> Progress:
        return Progress(min(self._done, self._total), self._total, what)

    def run(
        self,
        configuration: SensorConfiguration,
        disturbance: Disturbance,
        tested: Sequence[EvaluatedDetector],
        site: TrialSite | None = None,
    ) -> Generator[Progress, None, list[DisturbedTrial]]:
        there = self._home if site is None else site
        steps = trials(there, configuration, disturbance, tested, self._store)
        made = yield from within(self.progress(f"{configuration.name}, {disturbance.name} {disturbance.size:g}"), steps)
        self._done += 1
        return made

    def curve(
        self,
        configuration: SensorConfiguration,
        series: Series,
        tested: Sequence[EvaluatedDetector],
        undisturbed: Sequence[ResampledPrecision],
    ) -> Generator[Progress, None, DisturbanceCurve]:
        points = []
        for disturbance in series:
            tried = yield from self.run(configuration, disturbance, tested)
            own = [ResampledPrecision(trial.evaluation) for trial in tried]
            points.append(DisturbanceEffect(disturbance, level(own), change(own, undisturbed)))
        return DisturbanceCurve(configuration.name, level(undisturbed), tuple(points))

    def transfers(
        self,
        configurations: Sequence[SensorConfiguration],
        candidates: EvaluatedDetectors,
        elsewhere: Sequence[OtherSite],
    ) -> Generator[Progress, None, list[TransferResult]]:
        """Evaluate detectors of one type on the others, all of them on other sites, and the shipped one on all."""
        found = []
        for configuration in configurations:
            tried = {}
            for sensor, one_tested in candidates.by_type.items():
                tried[sensor] = yield from self._undisturbed(configuration, [one_tested])
            native = tried.pop(configuration.sensor, None)
            for sensor, those in tried.items() if native else ():
                against = f"trained on {configuration.sensor}"
                found.append(
                    TransferResult(sensor, configuration.name, level(those), change(those, native or those), against)
                )
        for other in elsewhere:
            for configuration in other.configurations:
                tested_on = f"{configuration.name}, {other.site.name}"
                there = yield from self._undisturbed(configuration, candidates.tested, other.site)
                twin = next(one for one in configurations if one.name == configuration.name)
                own = yield from self._undisturbed(twin, candidates.tested)
                difference = change(there, own, same_traffic=False)
                found.append(TransferResult(self._home.simulator.site, tested_on, level(there), difference, AT_HOME))
        places = [(configuration, self._home) for configuration in configurations]
        places += [(configuration, other.site) for other in elsewhere for configuration in other.configurations]
        for configuration, site in places if candidates.shipped else ():
            shipped = yield from self._undisturbed(configuration, candidates.shipped, site)
            own = yield from self._undisturbed(configuration, candidates.tested, site)
            difference = change(len(own) * shipped, own)
            against = f"trained on {self._home.simulator.site}"
            found.append(
                TransferResult(
                    "random sites", f"{configuration.name}, {site.name}", level(shipped), difference, against
                )
            )
        return found

    def _undisturbed(
        self, configuration: SensorConfiguration, tested: Sequence[EvaluatedDetector], site: TrialSite | None = None
    ) -> Generator[Progress, None, list[ResampledPrecision]]:
        made = yield from self.run(configuration, Disturbance(), tested, site)
        return [ResampledPrecision(trial.evaluation) for trial in made]

    def padding(
        self, configurations: Sequence[SensorConfiguration], candidates: EvaluatedDetectors
    ) -> Generator[Progress, None, list[TransferResult]]:
        found = []
        for configuration in configurations if candidates.padded else ():
            made = yield from self.run(configuration, Disturbance(), (*candidates.padded, *candidates.unpadded))
            own = [ResampledPrecision(trial.evaluation) for trial in made]
            with_zeros, without = own[: len(candidates.padded)], own[len(candidates.padded) :]
            found.append(
                TransferResult(
                    "pillars padded with zeros",
                    configuration.name,
                    level(with_zeros),
                    change(with_zeros, without),
                    "without padding",
                )
            )
        return found


def _length(
    configurations: Sequence[SensorConfiguration], candidates: EvaluatedDetectors, elsewhere: Sequence[OtherSite]
) -> int:
    """Return the number of trials."""
    full, brief = (sum(map(len, series(0))) for series in (full_series, brief_series))
    each = 1 + len(candidates.by_type) + bool(candidates.padded)
    at_home = sum(each + len(one.sensors) for one in configurations) + full + brief * (len(configurations) - 1)
    away = sum(len(other.configurations) for other in elsewhere)
    of_shipped = 2 * (len(configurations) + away) if candidates.shipped else 0
    return at_home + 2 * away + of_shipped


def _borders(name: str, trial: DisturbedTrial, score: float) -> BorderResults:
    by_sensor, by_border = trial.evaluation, trial.from_border

    def recall(evaluation: Evaluation, quantity: str, edges: Sequence[float]) -> tuple[Bin, ...]:
        return recall_by(evaluation, quantity, edges, score)

    return BorderResults(
        name,
        score,
        {
            "points": recall(by_sensor, "points", POINT_EDGES),
            "sensor": recall(by_sensor, "distance", DISTANCE_EDGES),
            "border": recall(by_border, "distance", BORDER_EDGES),
        },
        {
            "sensor": false_by(by_sensor, "distance", DISTANCE_EDGES, score),
            "border": false_by(by_border, "distance", BORDER_EDGES, score),
        },
    )


def _pillars(site: TrialSite, configuration: SensorConfiguration, detector: Detector) -> PillarFilling:
    """Return the filling of pillars in some frames, with the detector's own cap and smaller ones."""
    caps = (detector.settings.most_points, 8, 4, 2, 1)
    frames = [
        site.simulator.frame(configuration, site.runs[0], number)
        for number in range(min(COUNTED_FRAMES, len(site.runs[0].times)))
    ]
    area = site.simulator.area(detector.settings.pillar)
    counted = {}
    for cap in dict.fromkeys(caps):
        each = [filling(area.cloud(frame), area.grid, cap) for frame in frames]
        counted[cap] = Filling(
            *(float(np.mean([getattr(one, part) for one in each])) for part in ("empty", "over_full", "left_out"))
        )
    return PillarFilling(configuration.name, counted)
