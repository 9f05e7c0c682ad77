"""Rules of average precision, one table for every command."""

from collections.abc import Sequence

import numpy as np

from seip_addon.core.base.errors import SeipError
from seip_addon.core.output.results.detection_record import Precision

from .average_precision import average_precision_interval, evaluate
from .frame_results import FrameResult
from .matching import Rule
from .settings import CLASS_CATEGORIES

SMALL_OVERLAP = 0.5  # at which classes of small road users are evaluated, as KITTI does
SMALL_CLASSES = ("cycle", "pedestrian")
CLASSES = {"vehicles": "bev_0.7", "two-wheelers": "motorcycle_bicycle_0.5", "pedestrians": "pedestrian_0.5"}
"""Rule for each class of road users by which placements are compared; the first is the study's own."""


def _of_class(name: str) -> tuple[str, Rule]:
    overlap = SMALL_OVERLAP if name in SMALL_CLASSES else Rule().iou
    categories = CLASS_CATEGORIES[name]
    return f"{'_'.join(categories)}_{overlap:g}", Rule(iou=overlap, categories=categories)


RULES = {
    "bev_0.7": Rule(),
    "bev_0.5": Rule(iou=0.5),
    "3d_0.7": Rule(in_space=True),
    "bev_0.7_from_5_points": Rule(fewest_points=5),
    "bev_0.7_moving": Rule(parked=False),
    "bev_0.7_parked": Rule(parked=True),
    **dict(_of_class(name) for name in CLASS_CATEGORIES),
}
"""Rules by which average precision is taken; the first is the study's own."""

MAIN_RULE = next(iter(RULES.values()))


def precision_by(frames: Sequence[FrameResult], rule: Rule) -> Precision:
    """Return the average precision of all detections by a rule."""
    try:
        found = evaluate(frames, rule)
    except SeipError:  # nobody counts
        return Precision(np.nan, None, 0)
    return Precision(found.average_precision, average_precision_interval(found), len(found.wanted))


def precisions(frames: Sequence[FrameResult]) -> dict[str, Precision]:
    """Return the average precision by every rule, by its name."""
    return {name: precision_by(frames, rule) for name, rule in RULES.items()}
