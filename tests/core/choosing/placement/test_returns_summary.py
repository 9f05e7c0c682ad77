"""Returns from road users in figures for people."""

import numpy as np
import pytest

from seip_addon.core.choosing.placement.returns_summary import CrossingReturns, ReturnsSummary, share_reached


@pytest.mark.parametrize(
    ("least", "text"),
    [(0.71, "(0.71)"), (4.9999, "(4.9)")],
)
def test_a_crossing_with_few_returns_is_not_said_to_have_enough(least, text):
    crossings = (CrossingReturns("Mill Lane", least), CrossingReturns("Rope Lane", 5.0))
    (warning,) = ReturnsSummary(40.0, {}, crossings).warnings()
    assert warning == f"fewer than 5 returns from a pedestrian at the worst point of: Mill Lane {text}"


def test_a_share_of_returns_is_one_of_returns_and_not_of_their_logarithm():
    best, greedy = np.log(46.685), np.log(45.22)
    assert share_reached(greedy, best, of_returns=True) == pytest.approx(45.22 / 46.685)
    assert share_reached(500.0, 512.0, of_returns=False) == pytest.approx(500 / 512)
    assert share_reached(0.0, 0.0, of_returns=False) == 1.0
