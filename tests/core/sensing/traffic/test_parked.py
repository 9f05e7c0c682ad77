"""Who is parked."""

import numpy as np

from seip_addon.core.sensing.traffic.trajectories import parked_users
from tests.builders.traffic_by_hand import make_trajectories


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
