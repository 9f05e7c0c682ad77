"""Companions of pedestrians: beside them, never in another road user, and the same for the same seed."""

from pathlib import Path

from headless.studies.site_training.companions import with_companions

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.traffic.overlaps import find_overlaps
from seip_addon.core.sensing.traffic.trajectories import Trajectories

RUN = Path(__file__).parents[3] / "scenes" / "junction_traffic_dense" / "run-21.npz"


@pytest.fixture(scope="module")
def alone():
    return Trajectories.load(RUN)


@pytest.fixture(scope="module")
def grouped(alone):
    return finish(with_companions(alone, 3))


def test_companions_keep_near_the_one_they_walk_with(alone, grouped):
    names = {user.name: number for number, user in enumerate(alone.users)}
    for number in range(len(alone), len(grouped)):
        leader = names[grouped.users[number].name.rsplit(" companion ", 1)[0]]
        own = slice(*grouped.first[number : number + 2])
        theirs = slice(*grouped.first[leader : leader + 2])
        np.testing.assert_array_equal(grouped.time[own], grouped.time[theirs])
        apart = np.linalg.norm(grouped.position[own] - grouped.position[theirs], axis=1)
        assert apart.min() > 0.5
        assert apart.max() < 2.1
        assert np.ptp(apart) < 1e-6


def test_no_companion_overlaps_anyone(alone, grouped):
    before = {tuple(pair) for pair in finish(find_overlaps(alone)).pair.tolist()}
    assert {tuple(pair) for pair in finish(find_overlaps(grouped)).pair.tolist()} <= before
