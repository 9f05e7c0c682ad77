"""Small merged clouds of made-up streets: the sides of road users that roadside sensors see, and the ground."""

from dataclasses import replace

import numpy as np

from seip_addon.core.sensing.scans.frame import STATIC_INSTANCE, Frame, Labels

SIZES = {"car": (4.4, 1.8, 1.5), "truck": (9.0, 2.5, 3.4), "bicycle": (1.8, 0.6, 1.7), "pedestrian": (0.5, 0.6, 1.75)}
SENSORS = np.array([[16.0, 16.0, 5.0], [-16.0, -16.0, 5.0]])


def street_frame(seed, *, half=16.0, users=6, rays=6000, time=0.0, kinds=tuple(SIZES)):
    """Return a frame of a square of 2 · half metres, seen by two sensors at its corners."""
    random = np.random.default_rng(seed)
    boxes, names = _parked(random, half, users, kinds)
    clouds = [_ground(random, half, rays)]
    instances = [np.full(len(clouds[0]), STATIC_INSTANCE)]
    for number, box in enumerate(boxes):
        cloud = _surface(random, box, rays)
        clouds.append(cloud)
        instances.append(np.full(len(cloud), number))
    points = np.concatenate(clouds)
    instance = np.concatenate(instances)
    counts = np.bincount(instance[instance >= 0], minlength=len(boxes))
    labels = Labels(
        user=np.arange(len(boxes)),
        category=np.array(names, dtype=np.str_),
        centre=boxes[:, :3],
        size=boxes[:, 3:6],
        yaw=boxes[:, 6],
        pitch=np.zeros(len(boxes)),
        speed=np.zeros(len(boxes)),
        points=np.stack((counts, np.zeros_like(counts)), axis=1),
        visibility=np.minimum(counts / 100, 1.0),
        inside=np.ones(len(boxes), dtype=bool),
    )
    return Frame(
        time=time,
        points=(points + random.normal(0, 0.01, points.shape)).astype(np.float32),
        sensor=np.zeros(len(points), dtype=np.int16),
        delay=np.zeros(len(points), dtype=np.float32),
        intensity=random.uniform(0.1, 0.9, len(points)).astype(np.float32),
        instance=instance.astype(np.int32),
        foreground=instance >= 0,
        labels=labels,
    )


def _parked(random, half, count, kinds):
    boxes, names = np.zeros((0, 7)), []
    for _ in range(1000):
        if len(boxes) == count:
            break
        name = str(random.choice(kinds))
        length, width, height = np.array(SIZES[name]) * random.uniform(0.9, 1.1)
        x, y = random.uniform(-half + 4, half - 4, 2)
        apart = np.hypot(boxes[:, 0] - x, boxes[:, 1] - y)
        if (apart > (boxes[:, 3] + length) / 2 + 0.5).all():
            yaw = random.choice([0.0, np.pi / 2, np.pi, -np.pi / 2]) + random.normal(0, 0.05)
            boxes = np.vstack((boxes, [x, y, height / 2, length, width, height, yaw]))
            names.append(name)
    return boxes, names


def _ground(random, half, rays):
    xy = random.uniform(-half, half, (rays, 2))
    return np.column_stack((xy, np.zeros(rays)))


def _surface(random, box, rays):
    """Points on the sides that face a sensor, and on the lower front half of the roof, fewer the farther it is."""
    z, length, width, height, yaw = box[2:]
    found = []
    for sensor in SENSORS:
        count = int(min(400, rays / max(4.0, ((sensor[:2] - box[:2]) ** 2).sum()) * 6))
        ahead = np.array([np.cos(yaw), np.sin(yaw)])
        left = np.array([-ahead[1], ahead[0]])
        toward = sensor[:2] - box[:2]
        along = random.uniform(-length / 2, length / 2, count)
        aside = np.full(count, np.sign(toward @ left) * width / 2)
        ends = random.random(count) < width / (length + width)
        along[ends] = np.sign(toward @ ahead) * length / 2
        aside[ends] = random.uniform(-width / 2, width / 2, ends.sum())
        up = random.uniform(0.1, np.where(along > 0.2 * length, 0.6 * height, height), count)
        found.append(np.column_stack((box[:2] + along[:, None] * ahead + aside[:, None] * left, z - height / 2 + up)))
    return np.concatenate(found)


def cloud_frame(cloud):
    """Return a frame with some foreground points (n, 4) and nobody in it."""
    empty = street_frame(0, users=0)
    count = len(cloud)
    return replace(
        empty,
        points=cloud[:, :3],
        intensity=cloud[:, 3],
        sensor=np.zeros(count, dtype=np.int16),
        delay=np.zeros(count, dtype=np.float32),
        instance=np.full(count, -1, dtype=np.int32),
        foreground=np.ones(count, dtype=np.bool_),
    )
