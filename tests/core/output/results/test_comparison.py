"""Two placements, target by target, and the text that a file keeps of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.solvers import check_solver, is_available, solver_name
from seip_addon.core.errors import SeipError
from seip_addon.core.output.results.comparison import (
    BOTH,
    KEPT_ONLY,
    NEITHER,
    PRESENT_ONLY,
    compare,
    compared_shares,
    packed_counts,
    unpacked_counts,
)


def test_each_target_is_in_one_class():
    classes = compare(np.array([0, 2, 0, 1]), np.array([0, 1, 3, 0])).of
    assert classes.tolist() == [NEITHER, BOTH, PRESENT_ONLY, KEPT_ONLY]


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3)), min_size=1, max_size=50))
def test_shares_are_those_of_sets_of_targets(pairs):
    kept, present = ({i for i, pair in enumerate(pairs) if pair[side]} for side in (0, 1))
    packed = [packed_counts(np.array([pair[side] for pair in pairs], dtype=np.int64)) for side in (0, 1)]
    shares = compared_shares(*packed)
    for number, targets in ((BOTH, kept & present), (KEPT_ONLY, kept - present), (PRESENT_ONLY, present - kept)):
        assert shares[number] == len(targets) / len(pairs)
    assert shares[NEITHER] == (len(pairs) - len(kept | present)) / len(pairs)


def test_shares_of_a_pair_are_computed_once():
    compared_shares.cache_clear()
    pair = packed_counts(np.array([1, 0])), packed_counts(np.array([1, 1]))
    assert compared_shares(*pair) == compared_shares(*pair)
    assert (compared_shares.cache_info().misses, compared_shares.cache_info().hits) == (1, 1)


def test_other_targets_are_refused():
    with pytest.raises(SeipError, match="on 2 and on 3 targets"):
        compare(np.zeros(2, int), np.zeros(3, int))


@given(st.lists(st.integers(0, 400), max_size=50))
def test_counts_come_back_up_to_255(counts):
    assert unpacked_counts(packed_counts(np.array(counts, dtype=np.int64))).tolist() == [min(n, 255) for n in counts]


@pytest.mark.parametrize("text", ["?", "AAAA"])
def test_damaged_counts_are_said(text):
    with pytest.raises(SeipError, match="damaged"):
        unpacked_counts(text)


def test_the_automatic_solver_is_one_that_runs():
    assert is_available(solver_name("auto"))
    assert check_solver("auto") == check_solver(solver_name("auto"))
    assert solver_name("cbc") == "cbc"
