"""Average precision as the KITTI benchmark computes it (Geiger et al. 2012; 40 points since Simonelli et al. 2019).

It differs from the interpolated average precision that other tools report under the same names. First, each road user
is matched with the highest-scoring of the detections that overlap it enough. The scores of these matches give at most
41 thresholds: the scores at which recall is nearest to multiples of 1/40. At each threshold, detections are matched
again, each road user with the detection that overlaps it most. The precision at a threshold is the best at this or a
lower threshold; it is zero at recalls that are not reached. AP40 leaves out the threshold at recall 0, AP11 takes every
fourth. With fewer than 41 road users there are fewer thresholds, and even a perfect detector scores less than 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from headless.detection.frame_results import FrameResult
from headless.detection.matching import Rule, must_be_found, of_its_kind, overlaps

import numpy as np

from seip_addon.core.arrays import Boolean, Float, Integer

RECALL_POINTS = 41


class Kitti(NamedTuple):
    """KITTI's average precisions, 0 to 1: over 40 points of recall, and over 11."""

    ap40: float
    ap11: float


@dataclass(frozen=True, eq=False)
class _Scene:
    """A frame prepared for matching: k detections in the given order, and their overlaps with road users.

    ``near`` has the detections that overlap a road user enough, with their overlaps, for each road user; ``blamed``
    (k,) whether a detection is a false positive if it matches nothing; ``counted`` whether a road user counts.
    """

    score: Float
    blamed: Boolean
    counted: Boolean
    near: tuple[tuple[Integer, Float], ...]


def kitti(frames: Sequence[FrameResult], rule: Rule) -> Kitti:
    """Return the average precisions of the detections of all frames as KITTI computes them."""
    scenes = [_scene(frame, rule) for frame in frames]
    wanted = sum(int(scene.counted.sum()) for scene in scenes)
    thresholds = _thresholds(np.concatenate([_scores_of_hits(scene) for scene in scenes]), wanted)
    precision = np.zeros(RECALL_POINTS)
    for place, threshold in enumerate(thresholds):
        hits, false = np.sum([_count(scene, threshold) for scene in scenes], axis=0)
        precision[place] = hits / max(hits + false, 1)
    # KITTI takes the best precision at this or a larger recall, so that precision never rises with recall.
    precision = np.maximum.accumulate(precision[::-1])[::-1]
    return Kitti(ap40=float(precision[1:].mean()), ap11=float(precision[::4].mean()))


def _scene(frame: FrameResult, rule: Rule) -> _Scene:
    kind = of_its_kind(frame, rule)
    overlap = np.where(kind[:, None], overlaps(frame, rule), 0.0)
    near = [(np.nonzero(column > rule.iou)[0], column[column > rule.iou]) for column in overlap.T]
    return _Scene(frame.detected.score, kind & frame.detected.inside, must_be_found(frame, rule), tuple(near))


def _scores_of_hits(scene: _Scene) -> Float:
    """Return the scores of the hits if each road user is matched with its highest-scoring free detection."""
    free = np.ones(len(scene.score), dtype=np.bool_)
    found = []
    for counts, (rows, _) in zip(scene.counted, scene.near, strict=True):
        left = rows[free[rows]]
        if len(left):
            best = left[scene.score[left].argmax()]
            free[best] = False
            if counts:
                found.append(scene.score[best])
    return np.array(found, dtype=np.float64)


def _thresholds(scores: Float, wanted: int) -> list[float]:
    """Return the scores at which recall is nearest to 0, 1/40, 2/40 and so on."""
    ordered = np.sort(scores)[::-1].tolist()
    thresholds: list[float] = []
    recall = 0.0
    for place, score in enumerate(ordered):
        is_last = place == len(ordered) - 1
        here, beyond = (place + 1) / wanted, (place + 2) / wanted
        if is_last or beyond - recall >= recall - here:
            thresholds.append(score)
            recall += 1 / (RECALL_POINTS - 1)  # summed as KITTI does: ties depend on its rounding
    return thresholds


def _count(scene: _Scene, threshold: float) -> tuple[int, int]:
    """Return the numbers of hits and of false detections with at least a threshold score."""
    free = scene.score >= threshold
    hits = 0
    for counts, (rows, overlap) in zip(scene.counted, scene.near, strict=True):
        takes = np.where(free[rows], overlap, 0.0)
        if takes.any():
            free[rows[takes.argmax()]] = False
            hits += int(counts)
    return hits, int(np.count_nonzero(free & scene.blamed))
