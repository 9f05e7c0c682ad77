"""Intervals of means over seeds."""

from headless.studies.mean_over_seeds import COUNT, mean_interval

import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.estimates import SHARE


def test_mean_interval_of_three_seeds_by_hand():
    """Mean 0.7, standard deviation 0.1, t = 4.303: ± 4.303 · 0.1/√3 = 0.248."""
    assert mean_interval([0.6, 0.7, 0.8]) == pytest.approx((0.7 - 0.24841, 0.7 + 0.24841), abs=1e-5)


def test_three_seeds_are_covered_nineteen_times_of_twenty():
    rng = np.random.default_rng(1)
    intervals = np.array([mean_interval(values) for values in rng.normal(0.5, 0.1, (2000, 3))])
    assert ((intervals[:, 0] <= 0.5) & (intervals[:, 1] >= 0.5)).mean() == pytest.approx(0.95, abs=0.015)


def test_intervals_of_means_stay_within_what_is_possible():
    assert mean_interval([0.001, 0.003, 0.02], SHARE)[0] == 0.0
    assert mean_interval([0.97, 0.99, 1.0], SHARE)[1] == 1.0
    assert mean_interval([2.0, 60.0, 3.0], COUNT)[0] == 0.0
    assert mean_interval([0.6, 0.61, 0.62], SHARE) == mean_interval([0.6, 0.61, 0.62])


def test_cutting_off_what_is_impossible_loses_no_coverage():
    values = np.random.default_rng(2).beta(0.4, 3.6, (2000, 3))
    held = [[low <= 0.1 <= high for low, high in (mean_interval(v), mean_interval(v, SHARE))] for v in values]
    assert all(plain == cut for plain, cut in held)


def test_one_seed_gives_no_interval():
    with pytest.raises(SeipError, match="1 seed gives no interval"):
        mean_interval([0.5])
