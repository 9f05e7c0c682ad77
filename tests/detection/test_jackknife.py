"""Jackknife intervals against scipy."""

import numpy as np
import pytest
import scipy.stats

pytest.importorskip("torch", reason="the detector's torch is optional")

from headless.detection.average_precision import jackknife_reach


def test_jackknife_of_a_mean_is_students_interval():
    values = np.random.default_rng(3).normal(size=9)
    left_out = np.array([np.delete(values, row).mean() for row in range(9)])
    low, high = scipy.stats.t.interval(0.95, 8, values.mean(), scipy.stats.sem(values))
    assert jackknife_reach(left_out) == pytest.approx((high - low) / 2)
