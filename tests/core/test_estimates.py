"""Intervals and rank correlation against scipy, and verdicts at their edges."""

import math

from headless.studies.claims import verdict_above, verdict_within, worst_verdict

import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st

from seip_addon.core.errors import SeipError
from seip_addon.core.estimates import (
    COUNT,
    SHARE,
    IntervalEstimate,
    jackknife_reach,
    mean_interval,
    rank_agreements,
    rank_correlation,
    rank_correlation_interval,
    share_interval,
    student_quantile,
)


@pytest.mark.parametrize("freedom", [*range(1, 31), 59, 60, 1000])
def test_student_quantiles(freedom):
    assert student_quantile(freedom) == pytest.approx(scipy.stats.t.ppf(0.975, freedom), abs=1e-9)


def test_mean_interval_of_three_seeds_by_hand():
    """Mean 0.7, standard deviation 0.1, t = 4.303: ± 4.303 · 0.1/√3 = 0.248."""
    assert mean_interval([0.6, 0.7, 0.8]) == pytest.approx((0.7 - 0.24841, 0.7 + 0.24841), abs=1e-5)


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


def test_jackknife_of_a_mean_is_students_interval():
    values = np.random.default_rng(3).normal(size=9)
    left_out = np.array([np.delete(values, row).mean() for row in range(9)])
    low, high = scipy.stats.t.interval(0.95, 8, values.mean(), scipy.stats.sem(values))
    assert jackknife_reach(left_out) == pytest.approx((high - low) / 2)


@given(st.integers(0, 100), st.lists(st.integers(0, 100), min_size=2, max_size=20))
def test_intervals_of_shares_hold_the_share_and_stay_shares(share, left_out):
    low, high = share_interval(share / 100, np.array(left_out) / 100, 50.0)
    assert 0.0 <= low <= share / 100 <= high <= 1.0


def test_one_seed_gives_no_interval():
    with pytest.raises(SeipError, match="1 seed gives no interval"):
        mean_interval([0.5])


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=3, max_size=20))
def test_rank_correlation(pairs):
    x, y = zip(*pairs, strict=True)
    if len(set(x)) == 1 or len(set(y)) == 1:
        assert math.isnan(rank_correlation(x, y))
    else:
        assert rank_correlation(x, y) == pytest.approx(scipy.stats.spearmanr(x, y).statistic, abs=1e-12)


@pytest.mark.slow
@settings(max_examples=4, deadline=None)
@given(st.integers(0, 1000))
def test_interval_of_rank_correlation(seed):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=12)
    y = x + rng.normal(size=12)
    low, high = rank_correlation_interval(x, y, seed=0)
    assert -1 <= low <= rank_correlation(x, y) <= high <= 1
    assert rank_correlation_interval(x, y, seed=0) == (low, high)
    theirs = scipy.stats.bootstrap(
        (x, y),
        lambda a, b: scipy.stats.spearmanr(a, b).statistic,
        paired=True,
        vectorized=False,
        method="percentile",
        n_resamples=500,
        rng=rng,
    ).confidence_interval
    assert (low, high) == pytest.approx(tuple(theirs), abs=0.25)


def test_too_few_pairs_give_no_interval():
    assert rank_correlation_interval([1, 2, 3], [1, 2, 3], seed=0) is None
    assert rank_correlation_interval([1, 1, 1, 1], [1, 2, 3, 4], seed=0) is None


def test_verdicts():
    assert verdict_above((0.01, 0.2)) == "holds"
    assert verdict_above((-0.2, 0.0)) == "does not hold"
    assert verdict_above((-0.01, 0.2)) == "undecided"
    assert verdict_above((0.4, 0.6), 0.5) == "undecided"
    assert verdict_within((0.1, 0.2), 0.1, 0.4) == "holds"
    assert verdict_within((0.05, 0.2), 0.1, 0.4) == "undecided"
    assert verdict_within((0.0, 0.09), 0.1, 0.4) == "does not hold"
    assert verdict_within((0.41, 0.5), 0.1, 0.4) == "does not hold"
    assert verdict_within((0.0, 0.9), 0.1, 0.4) == "undecided"
    assert worst_verdict(["holds", "undecided", "holds"]) == "undecided"
    assert worst_verdict(["undecided", "does not hold"]) == "does not hold"
    assert worst_verdict(["holds"]) == "holds"


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=3, max_size=20))
def test_rank_agreements(pairs):
    """Each row by itself, ties and all, is as scipy has it."""
    x, y = np.array(pairs, dtype=float).T
    spearman, kendall = rank_agreements(np.array([x, -x]), np.array([y, y]))
    if len(set(x)) == 1 or len(set(y)) == 1:
        assert np.isnan([spearman, kendall]).all()
    else:
        assert spearman[0] == pytest.approx(scipy.stats.spearmanr(x, y).statistic, abs=1e-12)
        assert kendall[0] == pytest.approx(scipy.stats.kendalltau(x, y).statistic, abs=1e-12)
        assert [spearman[1], kendall[1]] == pytest.approx([-spearman[0], -kendall[0]])
