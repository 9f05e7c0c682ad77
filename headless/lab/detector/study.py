"""Average precision against the size of each disturbance, and on other types, traffic and sites.

Trained detectors, alike but for their seeds, are tried on the same test frames
again and again, each time with one thing wrong. A disturbance begins to harm
at the smallest size whose average precision is lower than without it by more
than the interval of the difference, pair by pair, over traffic and trainings.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from headless.detection.average_precision import Evaluation
from headless.detection.breakdown import ALONG_DISTANCE, ALONG_POINTS, Bin, false_by, recall_by
from headless.detection.case_study import Pupil, padded, pupils
from headless.detection.detector import Detector
from headless.detection.pillars import Filling, filling
from headless.detection.recordings import Configuration
from headless.detection.settings import NetworkSettings, TrainingSettings

import numpy as np

from seip_addon.core.progress import Progress, within
from seip_addon.core.robustness.estimates import IntervalEstimate

from .disturbances import (
    Capped,
    ClockOff,
    Disturbance,
    DropOff,
    Lost,
    Misplaced,
    Mistilted,
    Misturned,
    Rain,
    RangeNoise,
    Thinned,
)
from .paired_change import DRAWS, Sampled, change, level
from .trials import Entrant, Ground, Trial, trials

Series = tuple[Disturbance, ...]
"""Disturbances of one kind, the mildest first."""

ALONG_BORDER = (0.0, 2.0, 5.0, 10.0, 20.0, 40.0, np.inf)
"""Metres from the border of the region of interest, between which road users are counted."""

LOOKED_AT = 8
"""Frames in which pillars are counted."""


def full_series(sensor: int) -> tuple[Series, ...]:
    """Return all disturbances, those of one sensor of the sensor with this number."""
    return (
        tuple(RangeNoise(size) for size in (0.02, 0.05, 0.1, 0.2, 0.4)),
        tuple(DropOff(size) for size in (0.1, 0.25, 0.5, 0.75, 0.9)),
        tuple(Rain(size) for size in (2.0, 5.0, 10.0, 20.0, 40.0)),
        tuple(Misplaced(size, sensor) for size in (0.02, 0.05, 0.1, 0.2, 0.5)),
        tuple(Misturned(size, sensor) for size in (0.1, 0.2, 0.5, 1.0, 2.0)),
        tuple(Mistilted(size, sensor) for size in (0.1, 0.2, 0.5, 1.0, 2.0)),
        tuple(ClockOff(size, sensor) for size in (0.02, 0.05, 0.1, 0.2, 0.4)),
        tuple(Thinned(size) for size in (0.25, 0.5, 0.75)),
        tuple(Capped(size) for size in (8.0, 4.0, 2.0, 1.0)),
    )


def brief_series(sensor: int) -> tuple[Series, ...]:
    """Return the disturbances that say whether another sensor type bears as much."""
    return (
        tuple(RangeNoise(size) for size in (0.05, 0.1, 0.2)),
        tuple(DropOff(size) for size in (0.25, 0.5, 0.75)),
        tuple(Rain(size) for size in (5.0, 20.0)),
        tuple(Misturned(size, sensor) for size in (0.2, 0.5, 1.0)),
        tuple(ClockOff(size, sensor) for size in (0.05, 0.2)),
    )


@dataclass(frozen=True, eq=False)
class Point:
    """What a disturbance of one size does.

    Parameters
    ----------
    precision, change : IntervalEstimate
        Mean average precision over the detectors, and by how much it differs from that without the disturbance.
    change_by_half : IntervalEstimate
        The same from half the resamples.
    """

    disturbance: Disturbance
    precision: IntervalEstimate
    change: IntervalEstimate
    change_by_half: IntervalEstimate


@dataclass(frozen=True, eq=False)
class Curve:
    """Average precision against the size of one disturbance.

    Parameters
    ----------
    points : tuple of Point
        The mildest first.
    """

    configuration: str
    undisturbed: IntervalEstimate
    points: tuple[Point, ...]

    @property
    def name(self) -> str:
        """Of the disturbance."""
        return self.points[0].disturbance.name

    @property
    def unit(self) -> str:
        """Of its size."""
        return self.points[0].disturbance.unit

    @property
    def begins(self) -> Point | None:
        """The mildest that lowers average precision by more than chance, or None."""
        return next((point for point in self.points if point.change.high < 0), None)

    @property
    def steady(self) -> bool:
        """Whether half the resamples say the same of every size."""
        return all((point.change.high < 0) == (point.change_by_half.high < 0) for point in self.points)


@dataclass(frozen=True, eq=False)
class Spread:
    """What trainings with other seeds make of the same placement.

    Parameters
    ----------
    values : tuple of float
        Average precision of each detector.
    """

    configuration: str
    values: tuple[float, ...]
    precision: IntervalEstimate


@dataclass(frozen=True, eq=False)
class Foreign:
    """What detectors are worth where they have not learnt.

    Parameters
    ----------
    learnt, tried : str
        On what they have learnt, and on what they are tried.
    precision : IntervalEstimate
        There.
    change : IntervalEstimate
        Against ``against``.
    against : str
        Whose average precision is subtracted.
    """

    learnt: str
    tried: str
    precision: IntervalEstimate
    change: IntervalEstimate
    against: str


@dataclass(frozen=True, eq=False)
class Borders:
    """Where in the region the undisturbed detectors fail, of one placement and the first detector.

    Parameters
    ----------
    score : float
        From which on detections count.
    recall, false : mapping of str to tuple of Bin
        By ``points`` from the road user, and by ``sensor`` and ``border``: metres from the nearest sensor and from
        the border of the region; false detections per frame by the last two.
    """

    configuration: str
    score: float
    recall: Mapping[str, tuple[Bin, ...]]
    false: Mapping[str, tuple[Bin, ...]]


@dataclass(frozen=True, eq=False)
class Pillarwise:
    """How full pillars are with a placement.

    Parameters
    ----------
    filling : dict of int to Filling
        Where so many points are kept; means over some frames.
    """

    configuration: str
    filling: dict[int, Filling]


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """Another ground, on which detectors from home are tried.

    Parameters
    ----------
    entrants : tuple of Entrant
        The detectors from home, on this ground's grid.
    natives : tuple of Entrant
        Detectors that have learnt there, as many or none.
    """

    ground: Ground
    configurations: tuple[Configuration, ...]
    entrants: tuple[Entrant, ...]
    natives: tuple[Entrant, ...] = ()


@dataclass(frozen=True, eq=False)
class Candidates:
    """Detectors to be tried at home.

    Parameters
    ----------
    entrants : tuple of Entrant
        Alike but for their seeds.
    by_type : mapping of str to Entrant
        Those that have learnt from one sensor type alone.
    padded : tuple of Entrant
        With pillars padded with zeros, and ``unpadded``, trained as long, to compare them with.
    """

    entrants: tuple[Entrant, ...]
    by_type: Mapping[str, Entrant]
    padded: tuple[Entrant, ...] = ()
    unpadded: tuple[Entrant, ...] = ()


@dataclass(frozen=True, eq=False)
class Course:
    """Who has to be trained before the study.

    Parameters
    ----------
    alike : tuple of Pupil
        As an evaluation trains them: in its folder they need not be trained again.
    by_type : dict of str to Pupil
        Those who learn from one sensor type alone.
    padded : tuple of Pupil
        Those with padded pillars; none where padding is not to be tried.
    """

    alike: tuple[Pupil, ...]
    by_type: dict[str, Pupil]
    padded: tuple[Pupil, ...]

    @property
    def pupils(self) -> tuple[Pupil, ...]:
        """All, as `case_study.train_all` takes them."""
        return (*self.alike, *self.by_type.values(), *self.padded)

    def candidates(self, detectors: Sequence[Detector]) -> Candidates:
        """Return what the study tries, from the detectors of all pupils in their order."""
        trained = {
            pupil.name: Entrant(pupil.name, detector) for pupil, detector in zip(self.pupils, detectors, strict=True)
        }
        return Candidates(
            entrants=tuple(trained[pupil.name] for pupil in self.alike),
            by_type={sensor: trained[pupil.name] for sensor, pupil in self.by_type.items()},
            padded=tuple(trained[pupil.name] for pupil in self.padded),
            unpadded=tuple(trained[pupil.name] for pupil in self.alike[: len(self.padded)]),
        )


def course(
    configurations: Sequence[Configuration],
    network: NetworkSettings,
    training: TrainingSettings,
    *,
    seeds: int,
    padding: bool,
) -> Course:
    """Return who has to be trained; from one type's clouds for as large a part of the steps as they are of all clouds.

    Parameters
    ----------
    configurations : sequence of Configuration
        All that an evaluation looks at.
    training : TrainingSettings
        Of those who learn from all types.
    padding : bool
        Whether the ablation is wanted: each pupil again, with padded pillars.
    """
    alike = pupils(configurations, network, training, seeds=seeds, separate=False)
    by_type = {}
    for sensor in dict.fromkeys(one.case.sensor for one in configurations):
        own = tuple(one for one in configurations if one.case.sensor == sensor)
        steps = max(1, training.steps * len(own) // len(configurations))
        by_type[sensor] = Pupil(f"detector-{sensor}", own, network, replace(training, steps=steps))
    return Course(tuple(alike), by_type, tuple(padded(alike)) if padding else ())


@dataclass(frozen=True, eq=False)
class LimitsStudy:
    """Where the detector begins to fail on one site.

    Parameters
    ----------
    name : str
        Of the site.
    frames : int
        Test frames of each trial at home.
    worst : mapping of str to int
        For each configuration the sensor, by its number from 0, whose loss costs most: it is the one to be
        misplaced, misturned and late.
    foreign : tuple of Foreign
        Other types, other traffic, other sites.
    padding : tuple of Foreign
        What padding with zeros does to each configuration; none where it was not trained.
    """

    name: str
    frames: int
    spreads: tuple[Spread, ...]
    curves: tuple[Curve, ...]
    worst: Mapping[str, int]
    foreign: tuple[Foreign, ...]
    borders: tuple[Borders, ...]
    pillars: tuple[Pillarwise, ...]
    padding: tuple[Foreign, ...]


def limits_study(
    home: Ground,
    configurations: Sequence[Configuration],
    candidates: Candidates,
    elsewhere: Sequence[Elsewhere],
    store: Path,
    score: float,
) -> Generator[Progress, None, LimitsStudy]:
    """Try detectors until they fail.

    Parameters
    ----------
    home : Ground
        Where they have learnt, with traffic that they have not seen.
    configurations : sequence of Configuration
        The first is driven through everything, the others through the brief series.
    store : path
        Folder in which every trial is kept: a study that was stopped goes on.
    score : float
        From which on detections count where they are counted: the best balance on validation frames.

    Yields
    ------
    Progress
        Trials done, of all.
    """
    desk = _Desk(home, store, _length(configurations, candidates, elsewhere))
    spreads, curves, borders, pillars, worst = [], [], [], [], {}
    for number, configuration in enumerate(configurations):
        tried = yield from desk.tried(configuration, Disturbance(), candidates.entrants)
        own = [Sampled(trial.evaluation) for trial in tried]
        spreads.append(Spread(configuration.name, tuple(one.value for one in own), level(own)))
        borders.append(_borders(configuration.name, tried[0], score))
        pillars.append(_pillars(home, configuration, candidates.entrants[0].detector))
        loss = tuple(Lost.each(sensor) for sensor in range(len(configuration.sensors)))
        lost = yield from desk.curve(configuration, loss, candidates.entrants, own)
        worst[configuration.name] = int(np.argmin([point.change.value for point in lost.points]))
        curves.append(lost)
        series = full_series if number == 0 else brief_series
        for one in series(worst[configuration.name]):
            curve = yield from desk.curve(configuration, one, candidates.entrants, own)
            curves.append(curve)
    foreign = yield from desk.foreign(configurations, candidates, elsewhere)
    padding = yield from desk.padding(configurations, candidates)
    yield desk.progress("tried")
    return LimitsStudy(
        home.studio.site,
        sum(len(run.times) for run in home.runs),
        tuple(spreads),
        tuple(curves),
        worst,
        tuple(foreign),
        tuple(borders),
        tuple(pillars),
        tuple(padding),
    )


class _Desk:
    """Hands out trials and counts them."""

    def __init__(self, home: Ground, store: Path, total: int) -> None:
        self._home, self._store, self._total, self._done = home, store, total, 0

    def progress(self, what: str) -> Progress:
        return Progress(min(self._done, self._total), self._total, what)

    def tried(
        self,
        configuration: Configuration,
        disturbance: Disturbance,
        entrants: Sequence[Entrant],
        ground: Ground | None = None,
    ) -> Generator[Progress, None, list[Trial]]:
        there = self._home if ground is None else ground
        steps = trials(there, configuration, disturbance, entrants, self._store)
        made = yield from within(self.progress(f"{configuration.name}, {disturbance.name} {disturbance.size:g}"), steps)
        self._done += 1
        return made

    def curve(
        self, configuration: Configuration, series: Series, entrants: Sequence[Entrant], undisturbed: Sequence[Sampled]
    ) -> Generator[Progress, None, Curve]:
        points = []
        for disturbance in series:
            tried = yield from self.tried(configuration, disturbance, entrants)
            own = [Sampled(trial.evaluation) for trial in tried]
            by_all, by_half = (change(own, undisturbed, draws) for draws in (DRAWS, DRAWS // 2))
            points.append(Point(disturbance, level(own), by_all, by_half))
        return Curve(configuration.name, level(undisturbed), tuple(points))

    def foreign(
        self, configurations: Sequence[Configuration], candidates: Candidates, elsewhere: Sequence[Elsewhere]
    ) -> Generator[Progress, None, list[Foreign]]:
        """Try detectors of one type with the others, and all detectors on other grounds."""
        found = []
        for configuration in configurations:
            tried = {}
            for sensor, entrant in candidates.by_type.items():
                made = yield from self.tried(configuration, Disturbance(), [entrant])
                tried[sensor] = [Sampled(made[0].evaluation)]
            native = tried.pop(configuration.case.sensor, None)
            for sensor, those in tried.items() if native else ():
                against = f"learnt from {configuration.case.sensor}"
                found.append(Foreign(sensor, configuration.name, level(those), change(those, native or those), against))
        for other in elsewhere:
            for configuration in other.configurations:
                there = yield from self._elsewhere(other, configuration, candidates, configurations)
                found.append(there)
        return found

    def _elsewhere(
        self,
        other: Elsewhere,
        configuration: Configuration,
        candidates: Candidates,
        configurations: Sequence[Configuration],
    ) -> Generator[Progress, None, Foreign]:
        """Compare with natives on the same frames; without any, with the same detectors at home, on other frames."""
        made = yield from self.tried(configuration, Disturbance(), other.entrants, other.ground)
        there = [Sampled(trial.evaluation) for trial in made]
        if other.natives:
            own = yield from self.tried(configuration, Disturbance(), other.natives, other.ground)
            against = "learnt there"
        else:
            twin = next(one for one in configurations if one.name == configuration.name)
            own = yield from self.tried(twin, Disturbance(), candidates.entrants)
            against = "at home"
        seed = 0 if other.natives else 1  # other frames: nothing is paired but the detectors
        before = [Sampled(trial.evaluation, seed) for trial in own]
        tried = f"{configuration.name}, {other.ground.name}"
        return Foreign(self._home.studio.site, tried, level(there), change(there, before), against)

    def padding(
        self, configurations: Sequence[Configuration], candidates: Candidates
    ) -> Generator[Progress, None, list[Foreign]]:
        found = []
        for configuration in configurations if candidates.padded else ():
            made = yield from self.tried(configuration, Disturbance(), (*candidates.padded, *candidates.unpadded))
            own = [Sampled(trial.evaluation) for trial in made]
            with_zeros, without = own[: len(candidates.padded)], own[len(candidates.padded) :]
            found.append(
                Foreign(
                    "pillars padded with zeros",
                    configuration.name,
                    level(with_zeros),
                    change(with_zeros, without),
                    "without padding",
                )
            )
        return found


def _length(configurations: Sequence[Configuration], candidates: Candidates, elsewhere: Sequence[Elsewhere]) -> int:
    """Return how many trials there are."""
    full, brief = (sum(map(len, series(0))) for series in (full_series, brief_series))
    each = 1 + len(candidates.by_type) + bool(candidates.padded)
    at_home = sum(each + len(one.sensors) for one in configurations) + full + brief * (len(configurations) - 1)
    return at_home + sum(2 * len(other.configurations) for other in elsewhere)


def _borders(name: str, trial: Trial, score: float) -> Borders:
    by_sensor, by_border = trial.evaluation, trial.from_border

    def recall(evaluation: Evaluation, quantity: str, edges: Sequence[float]) -> tuple[Bin, ...]:
        return recall_by(evaluation, quantity, edges, score)

    return Borders(
        name,
        score,
        {
            "points": recall(by_sensor, "points", ALONG_POINTS),
            "sensor": recall(by_sensor, "distance", ALONG_DISTANCE),
            "border": recall(by_border, "distance", ALONG_BORDER),
        },
        {
            "sensor": false_by(by_sensor, "distance", ALONG_DISTANCE, score),
            "border": false_by(by_border, "distance", ALONG_BORDER, score),
        },
    )


def _pillars(ground: Ground, configuration: Configuration, detector: Detector) -> Pillarwise:
    """Count how full pillars are in some frames, with the detector's own cap and smaller ones."""
    caps = (detector.settings.most_points, 8, 4, 2, 1)
    frames = [
        ground.studio.frame(configuration, ground.runs[0], number)
        for number in range(min(LOOKED_AT, len(ground.runs[0].times)))
    ]
    counted = {}
    for cap in dict.fromkeys(caps):
        each = [filling(frame.points, detector.grid, cap) for frame in frames]
        counted[cap] = Filling(
            *(float(np.mean([getattr(one, part) for one in each])) for part in ("empty", "over_full", "left_out"))
        )
    return Pillarwise(configuration.name, counted)
