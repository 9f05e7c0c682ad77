"""Match detections to ground-truth boxes by IoU, best score first.

Road users count if they are of the requested categories, have their centre in the region and return enough points.
Detections are processed in descending order of score; of equal scores, the one with the largest overlap comes first.
Each is matched to the unmatched counted road user that it overlaps most, if the overlap exceeds the threshold. An
unmatched detection is ignored if it overlaps a road user that does not count, or if its centre is outside the region;
otherwise it is a false positive.

This is the rule of PASCAL VOC (Everingham et al. 2010) and COCO (Lin et al. 2014); the two differ only where road users
overlap each other. KITTI (Geiger et al. 2012) likewise ignores detections of neighbouring classes.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from seip_addon.core.base.arrays import Boolean, Float, Integer

from .frame_results import FrameResult
from .rotated_boxes import iou_matrix

VEHICLES = ("car", "van", "truck", "bus")  # categories whose average precision the study compares
NO_MATCH = -1  # in place of the index of a detection or a road user


@dataclass(frozen=True)
class Rule:
    """Rule for the road users that count, and for the overlap at which a detection matches one.

    Parameters
    ----------
    iou : float, 0 to 1
        Intersection over union that a match must exceed.
    in_space : bool
        Whether the overlap is that of the volumes; of the footprints otherwise.
    categories : tuple of str
        Categories of the counted road users and of the evaluated detections.
    fewest_points : int
        Least number of returns from a counted road user; 0 also counts those without returns.
    parked : bool or None
        True counts only parked road users, False only moving ones, None both.
    """

    iou: float = 0.7
    in_space: bool = False
    categories: tuple[str, ...] = VEHICLES
    fewest_points: int = 0
    parked: bool | None = None


@dataclass(frozen=True, eq=False)
class Match:
    """Detections of one frame matched to its ground truth; g road users, k detections.

    Parameters
    ----------
    counted : (g,) bool
        Mask of the road users that count.
    detection : (g,) int64
        Detection matched to each road user, or `NO_MATCH`.
    road_user : (k,) int64
        Road user matched to each detection, or `NO_MATCH`.
    evaluated : (k,) bool
        Mask of the detections that are hits or false positives; the others are ignored.
    """

    counted: Boolean
    detection: Integer
    road_user: Integer
    evaluated: Boolean

    @property
    def hit(self) -> Boolean:
        """Mask of the matched detections, (k,) bool."""
        hit: Boolean = self.road_user != NO_MATCH
        return hit

    def true_values(self, truth: NDArray[Any], detected: NDArray[Any]) -> NDArray[Any]:
        """Return a quantity of each detection's road user, or of the detection where it has no match.

        Parameters
        ----------
        truth : (g,) array
            Quantity of each road user.
        detected : (k,) array
            The same quantity of each detection.
        """
        values = detected.copy()
        values[self.hit] = truth[self.road_user[self.hit]]
        return values


def match(frame: FrameResult, rule: Rule) -> Match:
    """Match the detections of a frame to its ground-truth boxes."""
    truth, detected = frame.truth, frame.detected
    counted, requested = counted_road_users(frame, rule), np.isin(detected.category, rule.categories)
    overlap = np.where(requested[:, None], overlaps(detected.boxes, truth.boxes, in_space=rule.in_space), 0.0)
    best = overlap.max(axis=1, initial=0.0)
    detection, road_user = np.full(len(truth), NO_MATCH), np.full(len(detected), NO_MATCH)
    # lexsort sorts by its last key first: by score, and equal scores by their best overlap. The loop cannot be
    # vectorised, as each match depends on those before it.
    for row in np.lexsort((-best, -detected.score)):
        if best[row] <= rule.iou:
            continue
        unmatched = np.where(counted & (detection == NO_MATCH), overlap[row], 0.0)
        if unmatched.max() > rule.iou:
            road_user[row] = unmatched.argmax()
            detection[road_user[row]] = row
    # A second detection of a counted road user is not ignored: duplicates are false positives.
    ignored = (overlap[:, ~counted] > rule.iou).any(axis=1) | ~detected.inside
    return Match(counted, detection, road_user, (road_user != NO_MATCH) | (requested & ~ignored))


def counted_road_users(frame: FrameResult, rule: Rule) -> Boolean:
    """Return the mask of counted road users, (g,) bool."""
    truth = frame.truth
    counts: Boolean = np.isin(truth.category, rule.categories) & truth.inside & (truth.points >= rule.fewest_points)
    if rule.parked is None:
        return counts
    return counts & (truth.parked if rule.parked else ~truth.parked)


def overlaps(boxes: Float, others: Float, *, in_space: bool = False) -> Float:
    """Return the intersection over union of boxes (k, 7) with others (g, 7), in plan or in space, (k, g)."""
    iou = iou_matrix(torch.from_numpy(boxes), torch.from_numpy(others), in_space=in_space)
    return np.asarray(iou.numpy(), dtype=np.float64)
