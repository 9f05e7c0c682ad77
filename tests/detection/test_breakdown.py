"""Where detection fails, on frames that are told."""

import pytest

from tests.builders.labelled_frames import box, detected, frame, near_and_far, truth, values

pytest.importorskip("torch", reason="the detector's torch is optional")

from headless.detection.average_precision import evaluate
from headless.detection.breakdown import average_precision_by, recall_by_category
from headless.detection.matching import Rule

AT_07 = Rule()


def test_recall_by_category():
    there = truth([box(0), box(20), box(40), box(60)], category=["car", "truck", "truck", "pedestrian"])
    found = detected([box(0), box(20), box(40)], [0.9, 0.6, 0.4], category=["car", "truck", "truck"])
    evaluation = evaluate([frame(there, found)], AT_07)
    assert recall_by_category(evaluation, 0.5) == {"car": (1.0, 1), "truck": (0.5, 2)}
    assert recall_by_category(evaluation, 0.95) == {"car": (0.0, 1), "truck": (0.0, 2)}


def test_average_precision_by_distance():
    """Near: hit, false, hit of two: 1/2 · 1 + 1/2 · 2/3. Far: false, hit of two: 1/2 · 1/2. The box of the far hit
    lies at 39 m, but the car it found at 45 m."""
    bins = average_precision_by(evaluate([near_and_far()], AT_07), "distance", (0, 40, 60, 100))
    assert [(one.low, one.high, one.wanted) for one in bins] == [(0, 40, 2), (40, 60, 2), (60, 100, 0)]
    assert values(bins) == [5 / 6, 1 / 4, None]
