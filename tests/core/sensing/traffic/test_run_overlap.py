"""Runs that are nearly the same are told from independent ones."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.traffic.run_overlap import overlap_of, require_independent, vehicle_positions
from seip_addon.core.sensing.traffic.trajectories import Trajectories, parked_users
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


def standing(x, begin=0.0, end=40.0):
    return [(begin, x, 0.0, 0.0, 0.0, 0.0), (end, x, 0.0, 0.0, 0.0, 0.0)]


def test_who_stands_in_all_of_a_run_is_parked_and_who_waits_is_not():
    waits = [(0.0, 20.0, 0.0, 0.0, 0.0, 0.0), (35.0, 20.0, 0.0, 0.0, 0.0, 0.0), (40.0, 30.0, 0.0, 0.0, 0.0, 0.0)]
    drives = [(0.0, 50.0, 0.0, 0.0, 0.0, 0.0), (40.0, 400.0, 0.0, 0.0, 0.0, 0.0)]
    run = make_trajectories(standing(0.0), waits, drives, standing(60.0, 0.0, 39.0), standing(70.0, 2.0))
    assert parked_users(run).tolist() == [True, False, False, False, False]


def test_a_circle_is_no_standing():
    turn = np.linspace(0.0, 2.0 * np.pi, 9)
    circles = [(5.0 * n, 3 * np.cos(t), 3 * np.sin(t), 0.0, 0.0, 0.0) for n, t in enumerate(turn)]
    assert parked_users(make_trajectories(circles, standing(50.0))).tolist() == [False, True]
