"""Rank correlations against scipy."""

from headless.studies.rank_correlation import rank_agreements

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=3, max_size=20))
def test_rank_correlations(pairs):
    x, y = np.array(pairs, dtype=float).T
    agreements = rank_agreements(x, y)
    if len(set(x)) == 1 or len(set(y)) == 1:
        assert np.isnan(agreements).all()
    else:
        theirs = scipy.stats.spearmanr(x, y).statistic, scipy.stats.kendalltau(x, y).statistic
        assert agreements == pytest.approx(theirs, abs=1e-12)
