"""Runs that are nearly the same are told from independent ones."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.traffic.run_overlap import overlap_of, require_independent, vehicle_positions
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from tests.builders.traffic_by_hand import make_trajectories

SHIPPED = Path(__file__).parents[4] / "scenes"
RUN = Trajectories.load(SHIPPED / "junction_traffic" / "run-1.npz")


def shares(*runs):
    places = [vehicle_positions(f"run {number}", run) for number, run in enumerate(runs)]
    return [overlap_of(one, other) for one, other in combinations(places, 2)]


def less_one_sample(run):
    """Without the last sample of the last road user."""
    first = run.first.copy()
    first[-1] -= 1
    kept = {name: getattr(run, name)[:-1] for name in ("time", "position", "yaw", "pitch", "speed")}
    return replace(run, first=first, **kept)


def later(run):
    return replace(run, time=run.time + 7.0)


def beside(run):
    """Each road user a little off its way."""
    off = np.random.default_rng(1).normal(0, 0.3, (len(run), 2)).repeat(np.diff(run.first), axis=0)
    return replace(run, position=run.position + np.column_stack((off, np.zeros(len(off)))))


@pytest.mark.parametrize("copy", [less_one_sample, later, beside])
def test_a_copy_is_refused_whatever_its_bytes_are(copy):
    (share,) = shares(RUN, copy(RUN))
    assert share > 0.75
    with pytest.raises(SeipError, match=r"one and two are nearly the same traffic: \d+% of the vehicles"):
        require_independent([(vehicle_positions("one", RUN), vehicle_positions("two", copy(RUN)))])


@pytest.mark.parametrize("folder", ["junction_traffic", "junction_traffic_dense", "corridor_traffic"])
def test_shipped_runs_are_independent(folder):
    runs = [Trajectories.load(path) for path in sorted((SHIPPED / folder).glob("*.npz"))]
    assert max(shares(*runs)) < 0.3


def test_the_share_is_that_of_the_vehicles_within_a_metre():
    def standing(*places):
        return [[(0.0, x, 0.0, 0.0, 0.0, 0.0), (10.0, x, 0.0, 0.0, 0.0, 0.0)] for x in places]

    one, other = make_trajectories(*standing(0, 10, 20, 30)), make_trajectories(*standing(0.9, 11.1, 50))
    assert shares(one, other) == [pytest.approx(1 / 3)]  # of the other's three; of the four a quarter
