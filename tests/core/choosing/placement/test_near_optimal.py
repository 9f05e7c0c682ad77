"""What is said of the near-optimal set."""

import numpy as np
import pytest

from seip_addon.core.choosing.placement.near_optimal import NearOptimalSet

ONE_APART = "13 placements cover within 1% of the best; they use 14 positions, some share "


@pytest.mark.parametrize(
    ("number", "complete", "in_common", "message"),
    [
        (13, True, (3, 5, 0, 4, 1), f"{ONE_APART}none of its 4 positions"),
        (13, False, (3, 5, 0, 4, 1), f"at least {ONE_APART}none of its 4 positions"),
        (13, False, (0, 0, 0, 12, 1), f"at least {ONE_APART}only 3 of its 4 positions"),
        (
            3,
            True,
            (0, 3),
            "3 placements cover within 1% of the best; they use 14 positions, all share its 1 position",
        ),
        (1, True, (0, 0, 1), "no other placement covers within 1% of the best"),
        (1, False, (0, 0, 1), "whether other placements cover within 1% of the best is not known"),
    ],
)
def test_no_more_placements_are_claimed_than_were_found(number, complete, in_common, message):
    """A search that ended early has found some of them: there may be no further ones."""
    placements = np.zeros((number, len(in_common) - 1), np.int64)
    near = NearOptimalSet(0.01, placements, np.ones(number), complete, np.array(in_common), 14)
    assert near.message == message
