"""The table of criteria over sites, sensor types and counts: how well each predicts detection, and what it gains."""

import math
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from headless.detection.average_precision import (
    Evaluation,
    average_precisions_of_runs,
    average_precisions_without_each_run,
    evaluate,
    jackknife_reach,
    share_interval,
)
from headless.detection.detector import Detector
from headless.detection.frame_results import FrameResult
from headless.detection.recordings import MountedSensors, SampledRun, Simulator
from headless.detection.rules import CLASSES, RULES, precision_by
from headless.detection.shared_scans import SharedScans, detect_with_all
from headless.studies.rank_correlation import rank_correlation

import numpy as np

from seip_addon.core.base.arrays import Float, Integer
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.estimates import IntervalEstimate
from seip_addon.core.base.progress import Progress
from seip_addon.core.workflows.survey import Survey

from .drawing import MIN_PLACEMENTS, draw_from_pool
from .pose_criteria import PoseCriterion
from .site_criteria import CRITERIA, best_of, problem_of, site_criteria

POOL = 18  # poses of which placements of several sensors are drawn, next to those that criteria like best
BEST = "best by "  # kind of a placement, before the names of the criteria that like it best


@dataclass(frozen=True)
class CriteriaStudySettings:
    """Settings of a table of criteria.

    Parameters
    ----------
    counts : tuple of int
        Numbers of sensors.
    placements : int
        Drawn ones per count, next to those that criteria rate best; with 0 only these are evaluated.
    criteria : tuple of str
        Keys of `CRITERIA`; coverage is always among them.
    seed : int
        Seed of the drawn placements.
    """

    counts: tuple[int, ...]
    placements: int
    criteria: tuple[str, ...] = CRITERIA
    seed: int = 0

    def check(self) -> None:
        """Raise SeipError where there are too few placements."""
        if 0 < self.placements < MIN_PLACEMENTS:
            raise SeipError(
                f"{self.placements} placements say nothing of a correlation: ask for {MIN_PLACEMENTS} or more, or "
                "for 0 to evaluate only those that criteria rate best"
            )


@dataclass(frozen=True, eq=False)
class CountedPlacements:
    """Placements of one number of sensors; n of them.

    Parameters
    ----------
    count : int
    kind : tuple of str
        Kind of each placement.
    poses : tuple of (k,) int64
    mounted : tuple of MountedSensors
    best : dict of str to int
        Index of the placement that each criterion likes best of all candidates, by the criterion's key.
    """

    count: int
    kind: tuple[str, ...]
    poses: tuple[Integer, ...]
    mounted: tuple[MountedSensors, ...]
    best: dict[str, int]


def choose_placements(
    survey: Survey, criteria: Sequence[PoseCriterion], settings: CriteriaStudySettings
) -> Generator[Progress, None, tuple[CountedPlacements, ...]]:
    """Choose the placements of each count: what each criterion likes best of all candidates, and others at random.

    Those of several sensors are drawn from `POOL` random poses and the best ones, so that poses are shared.
    """
    random = np.random.default_rng(settings.seed)
    shuffled = random.permutation(np.flatnonzero(problem_of(survey, 1).allowed))
    found = []
    for count in settings.counts:
        problem = problem_of(survey, count)
        best: dict[str, frozenset[int]] = {}
        for criterion in criteria:
            poses = yield from best_of(criterion, survey, problem)
            best[criterion.key] = frozenset(poses.tolist())
        sets = list(dict.fromkeys(best.values()))
        chosen = [np.array(sorted(one)) for one in sets]
        names = [BEST + ", ".join(one.name for one in criteria if best[one.key] == some) for some in sets]
        pool = shuffled[: POOL if count > 1 else settings.placements + len(sets)]
        drawn = draw_from_pool(problem, pool, chosen, settings.placements, random) if settings.placements else []
        kinds, poses_of = (*names, *(kind for kind, _ in drawn)), (*chosen, *(poses for _, poses in drawn))
        mounted = tuple(
            MountedSensors(f"{kind} {number}", survey.deploy(poses).sensors)
            for number, (kind, poses) in enumerate(zip(kinds, poses_of, strict=True), start=1)
        )
        numbers = {key: sets.index(some) for key, some in best.items()}
        found.append(CountedPlacements(count, kinds, poses_of, mounted, numbers))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class StudiedType:
    """Findings for one sensor type at one site.

    Parameters
    ----------
    frames : tuple of tuple of list of FrameResult
        Frames of each placement, by count.
    """

    site: str
    sensor: str
    criteria: tuple[PoseCriterion, ...]
    placed: tuple[CountedPlacements, ...]
    frames: tuple[tuple[list[FrameResult], ...], ...]

    @cached_property
    def evaluations(self) -> tuple[dict[str, list[Evaluation]], ...]:
        """Evaluations of all placements by class of road users, count by count, for classes that the traffic has."""
        some = self.frames[0][0]
        rules = {name: RULES[rule] for name, rule in CLASSES.items() if precision_by(some, RULES[rule]).road_users}
        return tuple(
            {name: [evaluate(own, rule) for own in frames] for name, rule in rules.items()} for frames in self.frames
        )

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield the rows of the table: a criterion in a cell, for one class of road users.

        ``spearman`` is the rank correlation of the criterion and average precision over the placements, None for fewer
        than `MIN_PLACEMENTS`; ``precision`` is the average precision of the placement that the criterion likes best of
        all candidates, and ``gain`` that less the one of optimal coverage on the same traffic. Open ends of intervals
        are None.
        """
        for placed, evaluated in zip(self.placed, self.evaluations, strict=True):
            values = {one.key: np.array([one.value(poses) for poses in placed.poses]) for one in self.criteria}
            for road_users, evaluations in evaluated.items():
                precision = np.array([one.average_precision for one in evaluations])
                reference = evaluations[placed.best[self.criteria[0].key]]
                for criterion in self.criteria:
                    best = evaluations[placed.best[criterion.key]]
                    spearman = rank_correlation(values[criterion.key], precision)
                    known = len(precision) >= MIN_PLACEMENTS and math.isfinite(spearman)
                    yield {
                        "site": self.site,
                        "sensor": self.sensor,
                        "count": placed.count,
                        "criterion": criterion.name,
                        "road_users": road_users,
                        "placements": len(precision),
                        "spearman": spearman if known else None,
                        **_parts("precision", precision_of(best)),
                        **_parts("gain", difference_of(best, reference)),
                    }

    def placements(self) -> Iterator[dict[str, Any]]:
        """Yield the placements with their figures, for the record."""
        for placed, evaluated in zip(self.placed, self.evaluations, strict=True):
            for number, (kind, poses) in enumerate(zip(placed.kind, placed.poses, strict=True)):
                yield {
                    "count": placed.count,
                    "kind": kind,
                    "poses": poses.tolist(),
                    "sensors": [sensor.xyz.tolist() for sensor in placed.mounted[number].sensors],
                    "criteria": {one.key: one.value(poses) for one in self.criteria},
                    "average_precision": {
                        name: evaluations[number].average_precision for name, evaluations in evaluated.items()
                    },
                    "in_halves": {
                        name: in_halves(evaluations[number]).tolist() for name, evaluations in evaluated.items()
                    },
                }


def study_type(
    survey: Survey,
    simulator: Simulator,
    runs: tuple[Sequence[SampledRun], Sequence[SampledRun]],
    detector: Detector,
    settings: CriteriaStudySettings,
    folder: Path,
) -> Generator[Progress, None, StudiedType]:
    """Compute criteria, choose placements and detect with them, for the one sensor type of a survey.

    Parameters
    ----------
    runs : two sequences of SampledRun
        Those that criteria go by, and those of tests.
    folder : path
        What was detected is kept in it.
    """
    known, tests = runs
    criteria = yield from site_criteria(survey, known, settings.criteria)
    placed = yield from choose_placements(survey, criteria, settings)
    everything = [one for some in placed for one in some.mounted]
    shared = SharedScans(simulator, everything)
    found = iter((yield from detect_with_all(shared, tests, detector, folder)))
    frames = tuple(tuple(next(found) for _ in some.mounted) for some in placed)
    return StudiedType(survey.site.name, next(iter(survey.models)), criteria, placed, frames)


def precision_of(evaluation: Evaluation) -> IntervalEstimate:
    """Return an average precision with its interval over traffic: a jackknife over runs, on the scale of log odds."""
    value, left_out = evaluation.average_precision, average_precisions_without_each_run(evaluation)
    if left_out is None:
        return IntervalEstimate(value, -math.inf, math.inf)
    return IntervalEstimate(value, *share_interval(value, left_out, len(evaluation.wanted)))


def in_halves(evaluation: Evaluation) -> Float:
    """Return average precision in the first half of the runs, rounded up, and in the others, (2,) float64."""
    runs = int(evaluation.run.max()) + 1
    first = np.arange(runs) < (runs + 1) // 2
    return average_precisions_of_runs(evaluation, np.array([first, ~first]))


def difference_of(one: Evaluation, other: Evaluation) -> IntervalEstimate:
    """Return by how much an average precision exceeds another on the same traffic: a jackknife over the same runs."""
    value = one.average_precision - other.average_precision
    these, those = average_precisions_without_each_run(one), average_precisions_without_each_run(other)
    if these is None or those is None:
        return IntervalEstimate(value, -math.inf, math.inf)
    reach = jackknife_reach(these - those)
    return IntervalEstimate(value, value - reach, value + reach)


def _parts(name: str, estimate: IntervalEstimate) -> dict[str, float | None]:
    """Return a figure with the ends of its interval as columns, None for open ends."""
    parts = {name: estimate.value, f"{name}_low": estimate.low, f"{name}_high": estimate.high}
    return {column: number if math.isfinite(number) else None for column, number in parts.items()}


def table_cells(rows: Sequence[Mapping[str, Any]]) -> list[list[object]]:
    """Return the cells of a CSV table of rows."""
    return [
        [f"{value:.4f}" if isinstance(value, float) else "" if value is None else value for value in row.values()]
        for row in rows
    ]


def table_lines(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield the lines of a compact table: one for each criterion in each cell, with all classes."""
    heads = [f"{name}: Spearman, gain in points" for name in dict.fromkeys(row["road_users"] for row in rows)]
    yield f"{'site, sensors, criterion':48} " + " ".join(f"{head:>36}" for head in heads)
    cells = dict.fromkeys((row["site"], row["sensor"], row["count"], row["criterion"]) for row in rows)
    for cell in cells:
        own = [row for row in rows if (row["site"], row["sensor"], row["count"], row["criterion"]) == cell]
        site, sensor, count, criterion = cell
        name = f"{site[:20]}, {count} × {sensor}, {criterion}"
        yield f"{name:48} " + " ".join(f"{_figures(row):>36}" for row in own)


def _figures(row: Mapping[str, Any]) -> str:
    value, low, high = (row[f"gain{end}"] for end in ("", "_low", "_high"))
    between = "" if low is None else f" [{100 * low:+.1f}, {100 * high:+.1f}]"
    spearman = "none" if row["spearman"] is None else f"{row['spearman']:+.2f}"
    return f"{spearman}, {100 * value:+.1f}{between}"
