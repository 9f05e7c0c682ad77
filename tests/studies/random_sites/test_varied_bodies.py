"""Sizes drawn for road users, as those of real ones."""

from headless.studies.random_sites.varied_bodies import KINDS, draw_size

import numpy as np
import pytest

from seip_addon.core.sensing.traffic.trajectories import CATEGORIES


@pytest.mark.parametrize("category", CATEGORIES)
def test_means_and_spreads_are_those_of_the_table(category):
    random = np.random.default_rng(3)
    found = np.array([draw_size(category, random) for _ in range(3000)])
    kinds = list(KINDS[category].values())
    assert sum(kind.share for kind in kinds) == pytest.approx(1.0)
    shares = np.array([kind.share for kind in kinds])
    rows = np.array([(kind.length, kind.width, kind.height) for kind in kinds])
    mean = shares @ rows[..., 0]
    cut = 0.85  # a standard deviation of normal values within two of them is 0.88, of three that all are, less
    spread = np.sqrt(shares @ (rows[..., 0] ** 2 + (cut * rows[..., 1]) ** 2) - mean**2)
    assert found.mean(axis=0) == pytest.approx(mean, abs=4 * spread.max() / np.sqrt(len(found)))
    assert found.std(axis=0) == pytest.approx(spread, rel=0.08)
    low, high = (rows[..., 0] + 2 * sign * rows[..., 1] for sign in (-1, 1))
    assert (found >= low.min(axis=0) - 0.006).all()
    assert (found <= high.max(axis=0) + 0.006).all()
