"""Rank correlation against scipy."""

import math

from headless.studies.rank_correlation import rank_correlation, rank_correlation_interval

import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st


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
