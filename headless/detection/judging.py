"""Judgement of finalists by detection: rounds with twice the frames each, and figures in runs that chose nothing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from seip_addon.core.base.arrays import Float
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress
from seip_addon.core.choosing.placement.judgement import MEAN, Figure, JudgedFinalist, Judgement
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.traffic.run_overlap import require_independent, vehicle_positions
from seip_addon.core.sensing.traffic.site_traffic import check_runs, require_own_traffic
from seip_addon.core.sensing.weather import Weather
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.workflows.finalists import JudgementRequest

from .average_precision import (
    MIN_TEST_RUNS,
    Evaluation,
    average_precision_interval,
    average_precisions_of_runs,
    evaluate,
    jackknife_reach,
    share_interval,
)
from .detector import SHIPPED_DETECTOR, Detector
from .frame_results import FrameResult
from .matching import counted_road_users
from .recordings import MountedSensors, SampledRun, Simulator, sampled_runs
from .rules import CLASSES, RULES
from .shared_scans import SharedScans, detect_with_all

EVERY = 5.0
"""Seconds from frame to frame of a run."""
ROUNDS = (slice(0, None, 4), slice(2, None, 4), slice(1, None, 2))
"""Frames of each run that each round adds: a quarter, another quarter, and the other half."""


@dataclass(frozen=True, eq=False)
class Score:
    """Mean average precision of a placement in some frames, over all r runs and without each.

    Parameters
    ----------
    value : float, 0 to 1
    without : (r,) float64, optional
        None if there are too few runs for an interval.
    """

    value: float
    without: Float | None = None

    def lead_over(self, other: Score) -> Figure:
        """Return by how much it exceeds another one in the same frames, with the jackknife interval of pairs."""
        lead = self.value - other.value
        if self.without is None or other.without is None:
            return Figure(lead)
        reach = jackknife_reach(self.without - other.without)
        return Figure(lead, (lead - reach, lead + reach))


Judge = Callable[[Sequence[int], int], Generator[Progress, None, Sequence[Score]]]
"""From the finalists that are left, and the number of the round, to their scores in all frames so far."""


def race(count: int, rounds: int, judge: Judge) -> Generator[Progress, None, list[int]]:
    """Judge finalists in rounds until one is left, and return their numbers, the winner first.

    After each round those go that are behind the leader by a difference whose 95 % interval, over the same runs,
    excludes zero (racing; Maron and Moore 1994), so that later rounds, which have more frames, cost less. The intervals
    are not corrected for the number of comparisons.

    Parameters
    ----------
    count, rounds : int
        Number of finalists, and largest number of rounds.
    judge : callable
        Scores the finalists that are left.
    """
    rank, left = [(0, 0.0)] * count, list(range(count))  # rounds in which each was judged, and its score after them
    for number in range(rounds):
        scores = dict(zip(left, (yield from judge(left, number)), strict=True))
        leader = max(left, key=lambda one: scores[one].value)
        for one in left:
            rank[one] = number + 1, scores[one].value
        left = [one for one in left if one == leader or not _is_behind(scores[leader].lead_over(scores[one]))]
        if len(left) == 1:
            break
    return sorted(range(count), key=lambda one: rank[one], reverse=True)


def _is_behind(lead: Figure) -> bool:
    return lead.interval is not None and lead.interval[0] > 0.0


def judge_finalists(
    geometry: SceneGeometry,
    request: JudgementRequest,
    models: Mapping[str, LidarModel],
    weather: Weather,
    paths: Sequence[Path],
    folder: Path,
) -> Generator[Progress, None, Judgement]:
    """Choose among placements by what the shipped detector finds with them in traffic.

    The first half of the runs, rounded up, is for the choice; the others are for the figures of the winner, of the
    runner-up and of the first finalist.

    Parameters
    ----------
    geometry : SceneGeometry
        Scene in the weather.
    models : mapping of str to LidarModel
        Sensor types by catalogue key, in the weather.
    paths : sequence of path
        Runs of traffic.
    folder : path
        Folder for detections, which later judgements use again.

    Raises
    ------
    SeipError
        There are fewer than two runs, they are not independent traffic of the site, or too few road users occur.
    """
    judged, others = _split(sampled_runs(paths, geometry.origin, EVERY), geometry)
    placements = [
        MountedSensors(one.name, tuple(sensor.mounted(models[sensor.sensor]) for sensor in one.sensors))
        for one in request.finalists
    ]
    settings = ScanSettings(rolling_shutter=True, weather=tuple(weather.words()))
    sensors = [sensor for one in placements for sensor in one.sensors]
    shared = SharedScans(Simulator(geometry, settings, sensors), placements)
    detector = Detector.load(SHIPPED_DETECTOR)
    frames: list[list[FrameResult]] = [[] for _ in placements]

    def judge(left: Sequence[int], number: int) -> Generator[Progress, None, list[Score]]:
        found = yield from detect_with_all(shared, judged, detector, folder, placements=left, instants=ROUNDS[number])
        for one, more in zip(left, found, strict=True):
            frames[one] += more
        weights = counted_classes(frames[left[0]], request.weights)
        return [score_of(frames[one], weights) for one in left]

    ranked = yield from race(len(placements), len(ROUNDS), judge)
    shown = list(dict.fromkeys([*ranked[:2], 0]))
    found = yield from detect_with_all(shared, others, detector, folder, placements=shown)
    final = dict(zip(shown, found, strict=True))
    weights = counted_classes(frames[ranked[0]], request.weights)
    tested = counted_classes(final[ranked[0]], weights)
    scores = {one: score_of(own, tested) for one, own in final.items()}

    def record(one: int) -> JudgedFinalist:
        asked, own = request.finalists[one], frames[one]
        return JudgedFinalist(
            name=asked.name,
            places=tuple(f"{sensor.position} at {sensor.height_m:g} m" for sensor in asked.sensors),
            poses=asked.poses,
            frames=len(own),
            precision=precisions_of(own, counted_classes(own, request.weights)),
            final=precisions_of(final[one], tested) if one in final else None,
            behind=scores[ranked[0]].lead_over(scores[one]) if one in shown[1:] else None,
        )

    names = [tuple(run.name for run in runs) for runs in (judged, others)]
    return Judgement(tuple(map(record, ranked)), ranked.index(0), weights, names[0], names[1])


def _split(runs: Sequence[SampledRun], geometry: SceneGeometry) -> tuple[Sequence[SampledRun], Sequence[SampledRun]]:
    """Return the runs to choose by, and those for figures; they must be independent traffic of the site."""
    if len(runs) < 2:
        raise SeipError(f"finalists are judged on two runs of traffic or more, better sixteen, not {len(runs)}")
    name, times = Counter(run.name for run in runs).most_common(1)[0]
    if times > 1:
        raise SeipError(f"{times} runs of traffic are named {name!r}: rename their files")
    check_runs([run.trajectories for run in runs], geometry.region)
    for run in runs:
        require_own_traffic(run.trajectories, geometry, run.name)
    first = (len(runs) + 1) // 2
    moved = [vehicle_positions(run.name, run.trajectories) for run in runs]
    require_independent(product(moved[:first], moved[first:]))
    return runs[:first], runs[first:]


def counted_classes(frames: Sequence[FrameResult], weights: Mapping[str, float]) -> dict[str, float]:
    """Return the weights of classes whose road users are in four runs or more, or in all if there are fewer.

    Raises
    ------
    SeipError
        There is no such class.
    """
    names = np.array([frame.run for frame in frames])
    runs = len(np.unique(names))
    counted = {}
    for name, weight in weights.items():
        present = [bool(counted_road_users(one, RULES[CLASSES[name]]).any()) for one in frames]
        if weight and len(np.unique(names[present])) >= min(MIN_TEST_RUNS, runs):
            counted[name] = weight
    if not counted:
        raise SeipError("too few road users are in the region of interest to judge finalists by: take longer runs")
    return counted


def score_of(frames: Sequence[FrameResult], weights: Mapping[str, float]) -> Score:
    """Return the weighted mean of the average precision of the classes."""
    return _mean_score([evaluate(frames, RULES[CLASSES[name]]) for name in weights], weights)


def _mean_score(own: Sequence[Evaluation], weights: Mapping[str, float]) -> Score:
    """Return the weighted mean of the average precision of evaluations, one for each class."""
    share = np.array(list(weights.values())) / sum(weights.values())
    runs = int(own[0].run.max()) + 1
    value = float(share @ [one.average_precision for one in own])
    if runs < MIN_TEST_RUNS:
        return Score(value)
    return Score(value, share @ [average_precisions_of_runs(one, 1.0 - np.eye(runs)) for one in own])


def precisions_of(frames: Sequence[FrameResult], weights: Mapping[str, float]) -> dict[str, Figure]:
    """Return average precision by class, and the weighted mean, with intervals over the runs."""
    own = {name: evaluate(frames, RULES[CLASSES[name]]) for name in weights}
    score = _mean_score(list(own.values()), weights)
    users = sum(len(one.wanted) for one in own.values())
    interval = None if score.without is None else share_interval(score.value, score.without, users)
    each = {name: Figure(one.average_precision, average_precision_interval(one)) for name, one in own.items()}
    return {**each, MEAN: Figure(score.value, interval)}
