"""Ground that vehicles were seen to move over, and vehicles that stand beside it."""

import math
from types import SimpleNamespace

from headless.detection.traffic_ground import apart, moved_ground

import numpy as np
import pytest

INTERVAL = 0.5


def result(number, boxes, scores=None, interval=INTERVAL, category="car"):
    table = np.array([[x, y, 0.8, 4.5, 1.8, 1.6, yaw] for x, y, yaw in boxes]).reshape(-1, 7)
    score = np.full(len(table), 0.9) if scores is None else np.array(scores)
    detected = SimpleNamespace(boxes=table, score=score, category=np.full(len(table), category))
    return SimpleNamespace(time=number * interval, detected=detected)


def turning(number):
    """Return where a car is that turns left with a radius of 12 m at 6 m/s."""
    angle = number * INTERVAL * 6 / 12
    return 12 * math.sin(angle), 12 - 12 * math.cos(angle), angle


def test_moving_cars_are_on_their_ground_and_a_bush_and_a_parked_car_beside_it_are_apart():
    straight = [(-30 + 10 * INTERVAL * number, -4.0, 0.0) for number in range(10)]
    turn = [turning(number) for number in range(6)]
    bush, parked, queue = (5.0, 25.0, 0.3), (-20.0, -9.0, 0.0), (-10.0, -4.5, 0.0)
    random = np.random.default_rng(1)
    frames = []
    for number in range(10):
        noise = random.normal(0, 0.15, (3, 2))
        standing = [(x + dx, y + dy, yaw) for (x, y, yaw), (dx, dy) in zip((bush, parked, queue), noise, strict=True)]
        frames.append(result(number, [straight[number], *turn[number : number + 1], *standing]))
    ground = moved_ground(frames, 0.5)
    for number, frame in enumerate(frames):
        moving = 2 if number < 6 else 1
        assert apart(frame.detected, ground).tolist() == [False] * moving + [True, True, False]


@pytest.mark.parametrize("seed", range(20))
def test_flickering_boxes_along_a_barrier_hardly_make_ground(seed):
    random = np.random.default_rng(seed)
    posts = [(x, 10.0, 0.0) for x in random.uniform(-40, 40, 6)]
    frames = [result(number, [one for one in posts if random.random() < 0.3]) for number in range(40)]
    beside = [apart(frame.detected, moved_ground(frames, 0.5)) for frame in frames]
    assert np.concatenate(beside).mean() > 0.5


def test_frames_far_apart_low_scores_and_pedestrians_make_no_ground():
    path = [(-30 + 5.0 * number, 0.0, 0.0) for number in range(8)]
    assert moved_ground([result(n, [one]) for n, one in enumerate(path)], 0.5).area > 60
    assert moved_ground([result(n, [one], interval=1.5) for n, one in enumerate(path)], 0.5).is_empty
    assert moved_ground([result(n, [one], [0.4]) for n, one in enumerate(path)], 0.5).is_empty
    assert moved_ground([result(n, [one], category="pedestrian") for n, one in enumerate(path)], 0.5).is_empty
    assert moved_ground([result(n, []) for n in range(8)], 0.5).is_empty


def test_a_car_does_not_move_sideways_nor_at_once_to_another_speed():
    assert moved_ground([result(n, [(0.0, 5.0 * n, 0.0)]) for n in range(3)], 0.5).is_empty
    assert moved_ground([result(n, [(x, 0.0, 0.0)]) for n, x in enumerate((0.0, 1.0, 12.0))], 0.5).is_empty
