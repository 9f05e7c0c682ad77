"""Jackknife intervals against scipy."""

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("torch", reason="the detector's torch is optional")

from headless.detection.average_precision import jackknife_reach, share_interval


def test_jackknife_of_a_mean_is_students_interval():
    values = np.random.default_rng(3).normal(size=9)
    left_out = np.array([np.delete(values, row).mean() for row in range(9)])
    low, high = scipy.stats.t.interval(0.95, 8, values.mean(), scipy.stats.sem(values))
    assert jackknife_reach(left_out) == pytest.approx((high - low) / 2)


@given(st.integers(0, 100), st.lists(st.integers(0, 100), min_size=2, max_size=20))
def test_intervals_of_shares_hold_the_share_and_stay_shares(share, left_out):
    low, high = share_interval(share / 100, np.array(left_out) / 100, 50.0)
    assert 0.0 <= low <= share / 100 <= high <= 1.0
