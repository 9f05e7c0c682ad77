"""Average precision over many frames, with confidence intervals."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np

from seip_addon.core.base.arrays import Boolean, Float, Integer, Text
from seip_addon.core.base.counts import counted
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.estimates import Interval, student_quantile

from .frame_results import FrameResult
from .matching import Match, Rule, match

MIN_TEST_RUNS = 4  # runs below which there is no interval: of three it would leave nearly everything open
ADVISED_TEST_RUNS = 8
MISSED_SCORE = -np.inf  # the score at which a road user is found that none finds


def jackknife_reach(left_out: Float) -> float:
    """Return half the width of the 95 % jackknife interval of a figure.

    The delete-one jackknife (Tukey 1958) with Student's quantile of n − 1 degrees of freedom. A bootstrap over few
    samples gives intervals that are too narrow: with 4 or 8 runs of traffic its percentiles contain the true figure in
    77 to 89 of 100 cases instead of 95.

    Parameters
    ----------
    left_out : (n,) float64
        Values of the figure without each of n independent samples, at least two.
    """
    number = len(left_out)
    spread = (number - 1) / number * float(((left_out - left_out.mean()) ** 2).sum())
    return student_quantile(number - 1) * math.sqrt(spread)


def share_interval(share: float, left_out: Float, count: float) -> Interval:
    """Return the 95 % jackknife interval of a share.

    This is `jackknife_reach` on the scale of log odds, on which shares near 0 and 1 have symmetric errors. The interval
    lies between 0 and 1, and has the stated coverage near both ends, too.

    Parameters
    ----------
    share : float, 0 to 1
        Share of all samples.
    left_out : (n,) float64, 0 to 1
        Shares without each of n independent samples, at least two.
    count : float
        Number of items that the share refers to; log odds are limited to half an item from 0 and 1.
    """
    edge = 0.5 / count

    def log_odds(value: Float | float) -> Float:
        kept = np.clip(value, edge, 1.0 - edge)
        odds: Float = np.log(kept / (1.0 - kept))
        return odds

    middle, reach = float(log_odds(share)), jackknife_reach(log_odds(left_out))
    low, high = (float(0.5 + 0.5 * math.tanh(end / 2.0)) for end in (middle - reach, middle + reach))
    return min(low, share), max(high, share)


Table = TypeVar("Table", "EvaluatedDetections", "CountedTruth")


@dataclass(frozen=True, eq=False)
class EvaluatedDetections:
    """The evaluated detections of all frames, best first; d of them.

    Parameters
    ----------
    score : (d,) float64
    hit : (d,) bool
        Whether it found a road user; false otherwise.
    frame : (d,) int64
    density : (d,) float64, per square metre
    points : (d,) int64
        Returns from the road user that it found; in the box itself where it is false.
    distance : (d,) float64, metres
        From the road user that it found to the nearest sensor; from the box itself where it is false.
    """

    score: Float
    hit: Boolean
    frame: Integer
    density: Float
    points: Integer
    distance: Float

    def __len__(self) -> int:
        return len(self.score)


@dataclass(frozen=True, eq=False)
class CountedTruth:
    """The road users of all frames that count; t of them.

    Parameters
    ----------
    score : (t,) float64
        Score of the matched detection, `MISSED_SCORE` without one.
    frame : (t,) int64
    category, points, visibility, distance
        As in `GroundTruth`.
    """

    score: Float
    frame: Integer
    category: Text
    points: Integer
    visibility: Float
    distance: Float

    def __len__(self) -> int:
        return len(self.score)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Detections of all frames matched to the ground truth by one rule.

    Parameters
    ----------
    run : (f,) int64
        The run of traffic of each frame, counted from 0.
    """

    rule: Rule
    detections: EvaluatedDetections
    wanted: CountedTruth
    run: Integer

    @property
    def average_precision(self) -> float:
        """Area under the curve of the best precision at each recall or higher; NaN without counted road users.

        All-point interpolation of PASCAL VOC 2010, on all detections of all frames in one order. Equal scores make one
        point of the curve: no threshold can tell them apart.
        """
        return float(average_precisions_of_runs(self, np.ones((1, int(self.run.max(initial=0)) + 1)))[0])


def evaluate(frames: Sequence[FrameResult], rule: Rule) -> Evaluation:
    """Evaluate all detections.

    Raises
    ------
    SeipError
        No frame has a road user that counts.
    """
    matches = [match(frame, rule) for frame in frames]
    if not any(found.counted.any() for found in matches):
        raise SeipError(
            f"none of {len(frames)} frames has a {' or '.join(rule.categories)} in the region with "
            f"{rule.fewest_points} returns or more: there is no average precision without one, so evaluate on frames "
            "with traffic"
        )
    run = np.unique([frame.run for frame in frames], return_inverse=True)[1]
    return Evaluation(rule, _evaluated(frames, matches), _wanted(frames, matches), run)


def precision_recall(evaluation: Evaluation) -> tuple[Float, Float, Float]:
    """Return each score that a detection has, the highest first, with precision and recall, (s,) each.

    Of all detections with at least that score, they are the share that are hits, and the share of road users they find.
    """
    detections = evaluation.detections
    last = _last_of_equals(detections.score)
    hits = np.cumsum(detections.hit)[last]
    return detections.score[last], hits / (last + 1), hits / max(len(evaluation.wanted), 1)


def average_precision_interval(evaluation: Evaluation) -> Interval | None:
    """Return the 95 % interval of the average precision over other traffic like this, or None on too few runs.

    Only runs are independent: frames of a run resemble each other, and resampling them gives intervals that are too
    narrow. See `share_interval`. The interval does not cover the variation between trainings.
    """
    left_out = average_precisions_without_each_run(evaluation)
    if left_out is None:
        return None
    return share_interval(evaluation.average_precision, left_out, len(evaluation.wanted))


def average_precisions_without_each_run(evaluation: Evaluation) -> Float | None:
    """Return the average precision of all runs but one, for each of the r runs, (r,), or None on too few runs.

    Too few are below `MIN_TEST_RUNS` with road users that count. Two evaluations of the same frames leave out the same
    runs: the differences of what is returned are those of pairs.
    """
    if len(np.unique(evaluation.run[evaluation.wanted.frame])) < MIN_TEST_RUNS:
        return None
    return average_precisions_of_runs(evaluation, 1.0 - np.eye(int(evaluation.run.max()) + 1))


def average_precisions_of_runs(evaluation: Evaluation, times: Float | Integer) -> Float:
    """Return the average precision where runs come several times or not at all, (b,); NaN without road users.

    Parameters
    ----------
    times : (b, r) array
        How often each of the r runs is there.
    """
    detections, run = evaluation.detections, evaluation.run
    wanted = times @ np.bincount(run[evaluation.wanted.frame], minlength=times.shape[1])
    # Detections are sorted by score, so the first k of them are those above a threshold, and cumulative sums give hits
    # and detections at all thresholds. Runs may come several times without matching again: matches are within frames.
    # Precision falls from one hit to the next, so that only scores with a hit can hold the best precision at a recall
    # or beyond; the others, which are most, are left out.
    last = _last_of_equals(detections.score)
    last = last[np.diff(np.cumsum(detections.hit)[last], prepend=0) > 0]
    belongs = np.arange(times.shape[1])[:, None] == run[detections.frame]
    hits, found = (
        times @ np.cumsum(some, axis=1)[:, last].astype(np.float64) for some in (belongs & detections.hit, belongs)
    )
    precision = np.divide(hits, found, out=np.zeros(hits.shape), where=found > 0)
    # All-point interpolation: the best precision at this or a larger recall. The area is then a sum over steps of
    # recall, which is hits over the number of road users; the sum is over steps of hits, and divided at the end.
    best_from_here = np.maximum.accumulate(precision[:, ::-1], axis=1)[:, ::-1]
    areas = (np.diff(hits, axis=1, prepend=0) * best_from_here).sum(axis=1)
    return np.divide(areas, wanted, out=np.full(len(areas), np.nan), where=wanted > 0)


def too_few_runs(count: int) -> str:
    """Return a sentence that states how many test runs an interval needs, or "" if there are enough."""
    if count >= MIN_TEST_RUNS:
        return ""
    return (
        f"{counted(count, 'test run of traffic gives', 'test runs of traffic give')} no interval over traffic: only "
        f"whole runs are independent of each other, so test on {MIN_TEST_RUNS} or more, better {ADVISED_TEST_RUNS}"
    )


def balanced_score(evaluation: Evaluation) -> float:
    """Return the score with the highest F1, the harmonic mean of precision and recall; 0 without detections.

    Choose it on validation frames when false positives are compared at a fixed score.
    """
    score, precision, recall = precision_recall(evaluation)
    if not recall.any():
        return 0.0
    both = precision + recall
    balance = np.divide(precision * recall, both, out=np.zeros_like(both), where=both > 0)
    return float(score[balance.argmax()])


def part(evaluation: Evaluation, detections: Boolean, wanted: Boolean) -> Evaluation:
    """Return the evaluation restricted to some detections and some road users.

    Parameters
    ----------
    detections : (d,) bool
        Mask of the evaluated detections; their matches do not change.
    wanted : (t,) bool
        Mask of the counted road users.
    """
    return replace(
        evaluation, detections=_rows(evaluation.detections, detections), wanted=_rows(evaluation.wanted, wanted)
    )


def _wanted(frames: Sequence[FrameResult], matches: Sequence[Match]) -> CountedTruth:
    truths = [frame.truth for frame in frames]
    score = [
        np.append(frame.detected.score, MISSED_SCORE)[found.detection]  # NO_MATCH, -1, takes the last
        for frame, found in zip(frames, matches, strict=True)
    ]
    everyone = CountedTruth(
        score=np.concatenate(score),
        frame=np.repeat(np.arange(len(frames)), [len(truth) for truth in truths]),
        category=np.concatenate([truth.category for truth in truths]),
        points=np.concatenate([truth.points for truth in truths]),
        visibility=np.concatenate([truth.visibility for truth in truths]),
        distance=np.concatenate([truth.distance for truth in truths]),
    )
    return _rows(everyone, np.concatenate([found.counted for found in matches]))


def _evaluated(frames: Sequence[FrameResult], matches: Sequence[Match]) -> EvaluatedDetections:
    found, pairs = [frame.detected for frame in frames], list(zip(frames, matches, strict=True))
    everything = EvaluatedDetections(
        score=np.concatenate([boxes.score for boxes in found]),
        hit=np.concatenate([one.hit for one in matches]),
        frame=np.repeat(np.arange(len(frames)), [len(boxes) for boxes in found]),
        density=np.concatenate([boxes.density for boxes in found]),
        points=np.concatenate([one.true_values(f.truth.points, f.detected.points) for f, one in pairs]),
        distance=np.concatenate([one.true_values(f.truth.distance, f.detected.distance) for f, one in pairs]),
    )
    evaluated = np.nonzero(np.concatenate([one.evaluated for one in matches]))[0]
    return _rows(everything, evaluated[np.argsort(-everything.score[evaluated], kind="stable")])


def _rows(table: Table, rows: Boolean | Integer) -> Table:
    return replace(table, **{column.name: getattr(table, column.name)[rows] for column in fields(table)})


def _last_of_equals(score: Float) -> Integer:
    """Return the place of the last of each row of equal scores."""
    return np.nonzero(np.append(score[1:] != score[:-1], True)[: len(score)])[0]
