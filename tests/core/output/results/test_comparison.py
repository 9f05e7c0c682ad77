"""Two placements, target by target, and the text that a file keeps of them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.output.pictures.palette import (
    BOTH,
    KEPT_ONLY,
    NEITHER,
    PRESENT_ONLY,
    compare,
    packed_counts,
    unpacked_counts,
)


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3)), min_size=1, max_size=50))
def test_shares_are_those_of_sets_of_targets(pairs):
    kept, present = ({i for i, pair in enumerate(pairs) if pair[side]} for side in (0, 1))
    packed = [packed_counts(np.array([pair[side] for pair in pairs], dtype=np.int64)) for side in (0, 1)]
    shares = compare(*map(unpacked_counts, packed)).shares
    for number, targets in ((BOTH, kept & present), (KEPT_ONLY, kept - present), (PRESENT_ONLY, present - kept)):
        assert shares[number] == len(targets) / len(pairs)
    assert shares[NEITHER] == (len(pairs) - len(kept | present)) / len(pairs)
