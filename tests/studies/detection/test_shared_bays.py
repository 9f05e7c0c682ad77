"""Where two runs have parked road users in the same place."""

from headless.studies.detection.shared_bays import shared_bays

import pytest

from tests.builders.traffic_by_hand import make_trajectories


def standing(x, begin=0.0, end=40.0):
    return [(begin, x, 0.0, 0.0, 0.0, 0.0), (end, x, 0.0, 0.0, 0.0, 0.0)]


def test_shared_bays_are_the_larger_share():
    one, other = (make_trajectories(*map(standing, places)) for places in ((0.0, 10.0, 20.0), (0.5, 11.5)))
    assert shared_bays(one, other, 1.0) == shared_bays(other, one, 1.0) == pytest.approx(1 / 2)
    assert shared_bays(one, one, 1.0) == 1.0
    assert shared_bays(one, make_trajectories([(0.0, 0, 0, 0, 0, 0), (9.0, 99, 0, 0, 0, 0)]), 1.0) == 0.0
