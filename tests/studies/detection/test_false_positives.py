"""False detections on frames with known ones."""

import math

import pytest

from tests.builders.labelled_frames import near_and_far

pytest.importorskip("torch", reason="the detector's torch is optional")

from headless.detection.average_precision import evaluate
from headless.detection.matching import Rule
from headless.studies.detection.case_study import false_positives

AT_07 = Rule()


def test_false_positives_and_how_many_are_in_sparse_places():
    """Around half of the hits the density is under 30: both false ones are in sparser places."""
    evaluation = evaluate([near_and_far()], AT_07)
    assert false_positives(evaluation, 0.1) == (2, 1)
    # From 0.9 on there is one hit with density 40, and nothing is false.
    per_frame, sparse = false_positives(evaluation, 0.9)
    assert per_frame == 0
    assert math.isnan(sparse)
