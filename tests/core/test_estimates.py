"""Intervals against scipy."""

import math

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.estimates import IntervalEstimate, jackknife_reach, share_interval, student_quantile


@pytest.mark.parametrize("freedom", [*range(1, 31), 59, 60, 1000])
def test_student_quantiles(freedom):
    assert student_quantile(freedom) == pytest.approx(scipy.stats.t.ppf(0.975, freedom), abs=1e-9)


@pytest.mark.parametrize(
    ("estimate", "words"),
    [
        ((0.0071, -0.001, 0.0152), "0.71 points [-0.10, 1.52] more"),
        ((-0.0071, -0.0152, 0.001), "0.71 points [-0.10, 1.52] less"),
        ((-0.0071, -math.inf, math.inf), "0.71 points less [too few data for an interval]"),
        ((0.0, 0.0, 0.0), "0.00 points [0.00, 0.00] more"),
    ],
)
def test_a_loss_is_called_a_loss(estimate, words):
    assert IntervalEstimate(*estimate).as_change() == words


def test_jackknife_of_a_mean_is_students_interval():
    values = np.random.default_rng(3).normal(size=9)
    left_out = np.array([np.delete(values, row).mean() for row in range(9)])
    low, high = scipy.stats.t.interval(0.95, 8, values.mean(), scipy.stats.sem(values))
    assert jackknife_reach(left_out) == pytest.approx((high - low) / 2)


@given(st.integers(0, 100), st.lists(st.integers(0, 100), min_size=2, max_size=20))
def test_intervals_of_shares_hold_the_share_and_stay_shares(share, left_out):
    low, high = share_interval(share / 100, np.array(left_out) / 100, 50.0)
    assert 0.0 <= low <= share / 100 <= high <= 1.0
