"""Intervals of means over seeds."""

from headless.studies.detection.claims import mean_interval

import numpy as np
import pytest


def test_mean_interval_of_three_seeds_by_hand():
    """Mean 0.7, standard deviation 0.1, t = 4.303: ± 4.303 · 0.1/√3 = 0.248."""
    assert mean_interval([0.6, 0.7, 0.8]) == pytest.approx((0.7 - 0.24841, 0.7 + 0.24841), abs=1e-5)


def test_three_seeds_are_covered_nineteen_times_of_twenty():
    rng = np.random.default_rng(1)
    intervals = np.array([mean_interval(values) for values in rng.normal(0.5, 0.1, (2000, 3))])
    assert ((intervals[:, 0] <= 0.5) & (intervals[:, 1] >= 0.5)).mean() == pytest.approx(0.95, abs=0.015)
