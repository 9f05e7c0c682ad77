"""Frames whose every return from a road user lies in that road user's box, from a seed."""

import hashlib
from pathlib import Path

import numpy as np

from seip_addon.core.base.progress import finish
from seip_addon.core.output.datasets.dataset_folder import write_dataset
from seip_addon.core.output.datasets.formats import FORMATS
from seip_addon.core.output.datasets.sample import TrafficRun
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.frame import STATIC_INSTANCE, Frame, Labels
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.traffic.trajectories import CATEGORIES

ORIGIN = np.array([389_123.456, 5_712_345.678, 87.25])
SIZES = {
    "car": (4.5, 1.8, 1.5),
    "van": (5.5, 2.0, 2.4),
    "truck": (9.0, 2.5, 3.6),
    "bus": (12.0, 2.55, 3.1),
    "motorcycle": (2.2, 0.8, 1.5),
    "bicycle": (1.8, 0.6, 1.7),
    "pedestrian": (0.6, 0.7, 1.75),
}


def rotation(yaw, pitch=0.0, roll=0.0):
    """Right-handed, z up: turned left by yaw, nose up by pitch, left side up by roll; (3, 3)."""
    cy, sy, cp, sp, cr, sr = (f(angle) for angle in (yaw, pitch, roll) for f in (np.cos, np.sin))
    turn = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    nod = np.array([[cp, 0, -sp], [0, 1, 0], [sp, 0, cp]])
    lean = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    return turn @ nod @ lean


def make_sensors(count=2, tilt=0.0):
    random = np.random.default_rng(count)
    return tuple(
        MountedSensor(
            label=f"S{number + 1}",
            model=load_catalogue()["type2"],
            xyz=np.array([*random.uniform(-30, 30, 2), 6.0]),
            orientation=rotation(random.uniform(-np.pi, np.pi), *random.uniform(-tilt, tilt, 2)),
        )
        for number in range(count)
    )


def make_frame(seed=0, users=7, static=50, sensors=2, time=0.0, pitch=0.0, outside=0.0):
    """Every user has 0 to 9 returns; headings cover all quadrants, the multiples of π/2 among them."""
    random = np.random.default_rng(seed)
    category = np.array([CATEGORIES[number % len(CATEGORIES)] for number in range(users)], dtype=np.str_)
    size = np.array([SIZES[kind] for kind in category]).reshape(-1, 3) * random.uniform(0.9, 1.1, (users, 3))
    centre = np.column_stack([random.uniform(-60, 60, (users, 2)), random.uniform(0, 2, users) + size[:, 2] / 2])
    quarter = random.integers(-2, 2, users) * (np.pi / 2)
    yaw = quarter + np.where(random.random(users) < 0.3, 0.0, random.uniform(0, np.pi / 2, users))
    nod = random.uniform(-pitch, pitch, users) if pitch else np.zeros(users)
    instance = np.repeat(np.arange(users), random.integers(0, 10, users))
    where = random.uniform(-0.45, 0.45, (len(instance), 3))
    on_users = np.array(
        [centre[i] + rotation(yaw[i], nod[i]) @ (size[i] * part) for i, part in zip(instance, where, strict=True)]
    ).reshape(-1, 3)
    points = np.concatenate([on_users, random.uniform(-80, 80, (static, 3))]).astype(np.float32)
    number = random.integers(0, sensors, len(points)).astype(np.int16)
    order = np.argsort(number, kind="stable")
    owner = np.concatenate([instance, np.full(static, STATIC_INSTANCE)]).astype(np.int32)
    returns = np.zeros((users, sensors), dtype=np.int64)
    np.add.at(returns, (instance, number[: len(instance)]), 1)
    labels = Labels(
        user=np.arange(users),
        category=category,
        centre=centre,
        size=size,
        yaw=yaw,
        pitch=nod,
        speed=random.uniform(0, 15, users),
        points=returns,
        visibility=random.random(users),
        inside=random.random(users) >= outside,
    )
    return Frame(
        time=time,
        points=points[order],
        sensor=number[order],
        delay=random.uniform(0, 0.1, len(points)).astype(np.float32),
        intensity=random.random(len(points)).astype(np.float32),
        instance=owner[order],
        foreground=owner[order] != STATIC_INSTANCE,
        labels=labels,
    )


def make_frames(seed=0, count=3, **how):
    return [(f"{number:06d}", make_frame(seed=[seed, number], time=number / 10, **how)) for number in range(count)]


def make_run(name="a", split="train", key=None, sensors=None, **more):
    return TrafficRun(
        name=name,
        split=split,
        key=key or f"key of {name}",
        sensors=sensors or make_sensors(),
        origin=ORIGIN,
        record={"seeds": {"traffic": 3, "scans": 5}},
        **more,
    )


def write(kind, frames, run, folder, **settings):
    return finish(write_dataset(FORMATS[kind], frames, run, folder, **settings))


def contents(folder):
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(Path(folder).rglob("*"))
        if path.is_file()
    }
