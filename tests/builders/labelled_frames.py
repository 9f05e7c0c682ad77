"""Frames whose road users and detections are told, not simulated."""

import math

from headless.detection.frame_results import EvaluatedBoxes, FrameResult, GroundTruth

import numpy as np
import pytest

SIZES = {"car": (4.5, 1.8, 1.5), "van": (5.5, 2.0, 2.2), "truck": (9.0, 2.5, 3.5), "pedestrian": (0.6, 0.6, 1.7)}


def box(x, y=0.0, yaw=0.0, *, size=SIZES["car"]):
    return (x, y, size[2] / 2, *size, yaw)


def truth(boxes, *, category="car", points=100, visibility=1.0, inside=True, distance=10.0, parked=False):
    count = len(boxes)
    return GroundTruth(
        boxes=np.array(boxes, dtype=float).reshape(-1, 7),
        category=np.broadcast_to(np.array(category, dtype=np.str_), count),
        points=np.broadcast_to(np.array(points, dtype=np.int64), count),
        visibility=np.broadcast_to(np.array(visibility, dtype=float), count),
        inside=np.broadcast_to(np.array(inside), count),
        distance=np.broadcast_to(np.array(distance, dtype=float), count),
        parked=np.broadcast_to(np.array(parked), count),
    )


def detected(boxes, score, *, category="car", points=100, density=20.0, inside=True, distance=10.0):
    count = len(boxes)
    return EvaluatedBoxes(
        boxes=np.array(boxes, dtype=float).reshape(-1, 7),
        score=np.array(score, dtype=float),
        category=np.broadcast_to(np.array(category, dtype=np.str_), count),
        points=np.broadcast_to(np.array(points, dtype=np.int64), count),
        density=np.broadcast_to(np.array(density, dtype=float), count),
        inside=np.broadcast_to(np.array(inside), count),
        distance=np.broadcast_to(np.array(distance, dtype=float), count),
    )


def frame(there, found, *, run="test", time=0.0):
    return FrameResult(run, time, there, found)


def traffic(seed, *, frames=20, cars=12, noise=0.15, false=0.3, seconds=0.5, run="test"):
    """Cars that stand apart, detected more or less well, some not, and things that are no cars."""
    rng = np.random.default_rng(seed)
    told = []
    for number in range(frames):
        places = rng.permutation(100)[:cars]
        boxes = np.column_stack(
            [
                places % 10 * 12.0 + rng.uniform(-2, 2, cars),
                places // 10 * 12.0 + rng.uniform(-2, 2, cars),
                np.full(cars, 0.8),
                rng.uniform(3.6, 5.2, cars),
                rng.uniform(1.6, 2.0, cars),
                rng.uniform(1.4, 1.9, cars),
                rng.uniform(-math.pi, math.pi, cars),
            ]
        )
        seen = rng.random(cars) < 0.85
        spread = noise * np.array([1, 1, 0.5, 1, 0.5, 0.5, 0.3])
        good = boxes[seen] + rng.normal(0, 1, (seen.sum(), 7)) * spread
        double = good[rng.random(len(good)) < 0.1] + rng.normal(0, 0.1, 7)
        wrong = boxes[rng.random(cars) < false] + np.array([6, 5, 0, 0, 0, 0, 1.0])
        score = np.concatenate([rng.beta(5, 2, len(good)), rng.beta(3, 3, len(double)), rng.beta(2, 4, len(wrong))])
        distance, points = rng.uniform(3, 80, cars), rng.integers(0, 400, cars)
        found = np.concatenate([good, double, wrong])
        told.append(
            frame(
                truth(boxes, distance=distance, points=points, visibility=rng.random(cars)),
                detected(found, score, distance=rng.uniform(3, 80, len(found)), density=rng.gamma(2, 10, len(found))),
                run=run,
                time=number * seconds,
            )
        )
    return told


def near_and_far():
    """Return a frame. Near: found, found; one false at 0.8. Far: found at 0.5, missed, one false at 0.7."""
    there = truth(
        [box(0), box(20), box(40), box(60)],
        distance=[5, 15, 45, 55],
        points=[300, 200, 30, 0],
        visibility=[1.0, 0.9, 0.4, 0.0],
    )
    found = detected(
        [box(0), box(20), box(40), box(200), box(300)],
        [0.9, 0.6, 0.5, 0.8, 0.7],
        distance=[6, 14, 39, 10, 50],
        points=[300, 200, 30, 7, 2],
        density=[40, 30, 8, 10, 0.5],
    )
    return frame(there, found)


def values(bins):
    """Return the values of bins, None for a bin without a value."""
    return [None if math.isnan(one.value) else pytest.approx(one.value) for one in bins]
