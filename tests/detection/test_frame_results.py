"""What a frame's detections are set beside, counted by hand."""

import math

from headless.detection.frame_results import DENSITY_RADIUS, Detections, frame_result

import numpy as np
import pytest
import shapely

from seip_addon.core.sensing.scans.frame import Frame, Labels

REGION = shapely.box(-20, -20, 20, 20)
SENSORS = np.array([[0.0, 0.0, 6.0], [30.0, 0.0, 6.0]])


def simulated(points):
    labels = Labels(
        user=np.array([0, 1]),
        category=np.array(["van", "bus"]),
        centre=np.array([[3.0, 4.0, 6.0], [30.0, 8.0, 0.0]]),
        size=np.array([[5.0, 2.0, 2.2], [12.0, 2.5, 3.0]]),
        yaw=np.array([0.5, -2.0]),
        pitch=np.zeros(2),
        speed=np.zeros(2),
        points=np.array([[3, 4], [0, 0]]),
        visibility=np.array([0.5, 0.0]),
        inside=np.array([True, False]),
    )
    count = len(points)
    return Frame(
        time=1.5,
        points=np.array(points, dtype=np.float32).reshape(-1, 3),
        sensor=np.zeros(count, dtype=np.int16),
        delay=np.zeros(count, dtype=np.float32),
        intensity=np.zeros(count, dtype=np.float32),
        instance=np.full(count, -1, dtype=np.int32),
        foreground=np.zeros(count, dtype=np.bool_),
        labels=labels,
    )


def result(points, boxes):
    boxes = np.array(boxes, dtype=float).reshape(-1, 7)
    found = Detections(boxes, np.linspace(0.1, 0.9, len(boxes)), np.arange(len(boxes)) % 2)
    frame = simulated(points)
    return frame_result(frame, found, region=REGION, sensors=SENSORS, run="a")


def test_returns_as_a_plain_search_counts_them():
    rng = np.random.default_rng(1)
    points = rng.uniform(-10, 10, (3000, 3)).astype(np.float32)
    boxes = np.column_stack([rng.uniform(-10, 10, (20, 3)), rng.uniform(1, 14, (20, 3)), rng.uniform(-7, 7, 20)])
    told = result(points, boxes)
    for row, (x, y, z, length, width, height, yaw) in enumerate(boxes):
        offset = points.astype(float) - [x, y, z]
        turned = offset @ np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        inside = np.all(np.abs(turned) <= np.array([length, width, height]) / 2, axis=1)
        assert told.detected.points[row] == inside.sum()
        near = np.hypot(offset[:, 0], offset[:, 1]) <= DENSITY_RADIUS
        assert told.detected.density[row] == pytest.approx(near.sum() / (math.pi * DENSITY_RADIUS**2))
