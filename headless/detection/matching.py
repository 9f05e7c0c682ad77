"""Match detections to ground-truth boxes by IoU, best score first.

The rule: detections take turns, the best score first (of equal scores the one that overlaps its road user most). Each
takes, of the road users that count and that none has taken, the one it overlaps most, if the overlap exceeds the
threshold. One that finds none of these, but overlaps a road user that does not count, or has its middle outside the
region, is not evaluated. All others are false.

This is the rule of PASCAL VOC (Everingham et al. 2010) and COCO (Lin et al. 2014); the two differ where road users
overlap each other. Road users count if they are of the requested categories, have their centre in the region and
return enough points. Detections of others are ignored, as those of neighbouring classes in KITTI (Geiger et al. 2012).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from seip_addon.core.arrays import Boolean, Float, Integer

from .frame_results import FrameResult
from .rotated_boxes import in_plan, iou_matrix, iou_matrix_3d

VEHICLES = ("car", "van", "truck", "bus")  # categories whose average precision the study compares
NO_MATCH = -1  # index that stands for no match, of a detection and of a road user


@dataclass(frozen=True)
class Rule:
    """Rule of matching: the counted road users, and the overlap of a match.

    Parameters
    ----------
    iou : float, 0 to 1
        Intersection over union that a detection has to exceed.
    in_space : bool
        Whether boxes have to agree in height as well; in plan otherwise.
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
    """Detections matched to the ground truth of one frame; g road users, k detections.

    Parameters
    ----------
    counted : (g,) bool
        Whether the road user is one that had to be found.
    found_by : (g,) int64
        The detection that found it, `NO_MATCH` where none did.
    found : (k,) int64
        The road user that each detection found, `NO_MATCH` where it found none that counts.
    evaluated : (k,) bool
        Whether the detection is a hit or a false positive; the others are ignored.
    """

    counted: Boolean
    found_by: Integer
    found: Integer
    evaluated: Boolean

    @property
    def hit(self) -> Boolean:
        """Whether each detection found a road user that counts, (k,) bool."""
        hit: Boolean = self.found != NO_MATCH
        return hit

    def of_found(self, of_truth: NDArray[Any], own: NDArray[Any]) -> NDArray[Any]:
        """Return for each detection a quantity of the road user that it found; its own where it found none."""
        values = own.copy()
        values[self.hit] = of_truth[self.found[self.hit]]
        return values


def match(frame: FrameResult, rule: Rule) -> Match:
    """Match the detections of a frame to its ground-truth boxes."""
    truth, detected = frame.truth, frame.detected
    counted = must_be_found(frame, rule)
    overlap = np.where(
        of_its_kind(frame, rule)[:, None], overlaps(detected.boxes, truth.boxes, in_space=rule.in_space), 0.0
    )
    best = overlap.max(axis=1, initial=0.0)
    found_by, found = np.full(len(truth), NO_MATCH), np.full(len(detected), NO_MATCH)
    # lexsort sorts by its last key first: by score, and equal scores by their best overlap. The loop cannot be
    # vectorised, as each detection takes only road users that the ones before it left.
    for row in np.lexsort((-best, -detected.score)):
        if best[row] <= rule.iou:
            continue
        free = np.where(counted & (found_by == NO_MATCH), overlap[row], 0.0)
        if free.max() > rule.iou:
            found[row] = free.argmax()
            found_by[found[row]] = row
    # A second detection of a counted road user is not excused: it is a false positive, which punishes duplicates.
    excused = (overlap[:, ~counted] > rule.iou).any(axis=1) | ~detected.inside
    return Match(counted, found_by, found, (found != NO_MATCH) | (of_its_kind(frame, rule) & ~excused))


def must_be_found(frame: FrameResult, rule: Rule) -> Boolean:
    """Return the mask of counted road users, (g,) bool."""
    truth = frame.truth
    counts: Boolean = np.isin(truth.category, rule.categories) & truth.inside & (truth.points >= rule.fewest_points)
    if rule.parked is None:
        return counts
    return counts & (truth.parked if rule.parked else ~truth.parked)


def of_its_kind(frame: FrameResult, rule: Rule) -> Boolean:
    """Return the mask of detections of the requested categories, (k,) bool."""
    return np.isin(frame.detected.category, rule.categories)


def overlaps(boxes: Float, others: Float, *, in_space: bool = False) -> Float:
    """Return the intersection over union of boxes (k, 7) with others (g, 7), in plan or in space, (k, g)."""
    one, other = torch.from_numpy(boxes), torch.from_numpy(others)
    found = iou_matrix_3d(one, other) if in_space else iou_matrix(in_plan(one), in_plan(other))
    return np.asarray(found.numpy(), dtype=np.float64)
