"""The cell index finds what comparing all with all finds."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.sensing.visibility.target_index import TargetIndex


@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 60),
    st.integers(0, 200),
    st.floats(1e-3, 30),
    st.sampled_from([0.0, 5e6]),
)
def test_same_as_all_pairs(seed: int, targets: int, points: int, delta: float, shift: float) -> None:
    random = np.random.default_rng(seed)
    xyz = random.uniform(-20, 20, (targets, 3)) * (1, 1, 0.1) + shift
    returns = random.uniform(-30, 30, (points, 3)) * (1, 1, 0.1) + shift
    gap = returns[:, None] - xyz[None]
    squared = gap[:, :, 0] ** 2 + gap[:, :, 1] ** 2 + gap[:, :, 2] ** 2
    expected = np.flatnonzero((squared < delta**2).any(axis=0))
    assert np.unique(TargetIndex(xyz, delta).pairs_within_delta(returns)[1]).tolist() == expected.tolist()


def test_the_distance_is_strictly_less() -> None:
    index = TargetIndex(np.array([[0.0, 0.0, 0.0]]), 1.0)
    assert index.pairs_within_delta(np.array([[1.0, 0.0, 0.0]]))[1].tolist() == []
    assert index.pairs_within_delta(np.array([[np.nextafter(1.0, 0.0), 0.0, 0.0]]))[1].tolist() == [0]
    assert index.pairs_within_delta(np.array([[0.0, 0.0, 2.0]]))[1].tolist() == []


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(0, 60))
def test_pairs_are_all_that_are_near(seed: int, targets: int, points: int) -> None:
    random = np.random.default_rng(seed)
    xyz, returns = random.uniform(-5, 5, (targets, 3)), random.uniform(-8, 8, (points, 3))
    gap = returns[:, None] - xyz[None]
    squared = gap[:, :, 0] ** 2 + gap[:, :, 1] ** 2 + gap[:, :, 2] ** 2
    point, target = TargetIndex(xyz, 2.0).pairs_within_delta(returns)
    assert sorted(map(list, zip(point.tolist(), target.tolist(), strict=True))) == np.argwhere(squared < 4.0).tolist()
    assert (np.diff(point) >= 0).all()
