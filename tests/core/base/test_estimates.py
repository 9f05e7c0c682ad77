"""Intervals against scipy."""

import math

import numpy as np
import pytest
import scipy.stats

from seip_addon.core.base.estimates import IntervalEstimate, quantile_of, student_quantile


@pytest.mark.parametrize("freedom", [1, 30, 1000])
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


@pytest.mark.parametrize("share", [0.05, 0.5])
def test_a_quantile_is_in_its_interval_as_often_as_is_said(share):
    rng, hits = np.random.default_rng(0), 0
    for _ in range(600):
        found = quantile_of(rng.standard_normal(200), share)
        assert found.low <= found.value <= found.high
        hits += found.low <= scipy.stats.norm.ppf(share) <= found.high
    assert hits / 600 > 0.93
