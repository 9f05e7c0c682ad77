"""What goes into the charts, from what was measured."""

import numpy as np
import pytest
import shapely

from tests.builders.labelled_frames import box, detected, frame, truth

pytest.importorskip("torch", reason="the detector's torch is optional")

from headless.detection.chart_data import error_view
from headless.detection.matching import Rule

RULE = Rule()
TOLD = frame(
    truth([box(0), box(20), box(40)], distance=[5, 15, 25], inside=[True, True, False]),
    detected([box(0), box(20), box(90), box(-90)], [0.9, 0.3, 0.6, 0.7], inside=[True, True, True, False]),
)


def test_error_view_shows_what_reaches_the_score():
    place = {"cloud": np.zeros((4, 3), np.float32), "region": shapely.box(0, 0, 1, 1), "sensors": np.ones((1, 3))}
    view = error_view("a", TOLD, RULE, score=0.5, **place)
    assert view.wanted.tolist() == [True, True, False]
    assert view.missed.tolist() == [False, True, False]
    assert view.false.tolist() == [False, True, False]  # outside the region nothing is false
    assert view.truth[0].tolist() == [0, 0, 4.5, 1.8, 0]
    assert error_view("a", TOLD, RULE, score=0.1, **place).missed.tolist() == [False, False, False]
