r"""The format of OPV2V, which OpenCOOD reads: each sensor is an agent that shares what it sees.

OpenCOOD stands on CARLA's left-handed axes (x forward, y **right**, z up): with M = diag(1, −1, 1), a place p here is
M p there and a rotation R is M R M. A pose is x, y, z in metres and roll, yaw, pitch in degrees, of which the
rotation is [1]_

.. math::
   \begin{pmatrix}
   c_p c_y & c_y s_p s_r - s_y c_r & -c_y s_p c_r - s_y s_r \\
   s_y c_p & s_y s_p s_r + c_y c_r & -s_y s_p c_r + c_y s_r \\
   s_p & -c_p s_r & c_p c_r
   \end{pmatrix}

Clouds are in the axes of their sensor, with the intensity in the red channel of a packed colour, 8 bits. Agents are
numbered as the sensors are, from 0: a negative number would make it one that cannot be the ego vehicle.

.. [1] R. Xu et al., "OPV2V: An Open Benchmark Dataset and Fusion Pipeline for Perception with Vehicle-to-Vehicle
   Communication", ICRA 2022; OpenCOOD, opencood/utils/transformation_utils.py.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ..arrays import Float
from .format_interface import Format
from .pcd import encode
from .sample import Sample, SensorPose, TrafficRun, subset

CLASSES = {"car": "Car", "van": "Van", "truck": "Truck", "bus": "Bus"}
"""OpenCOOD knows one class, the vehicle; two-wheelers and pedestrians are none."""

SPLIT_FOLDERS = {"train": "train", "val": "validate", "test": "test"}
MAX_AGENTS = 7
MAX_AGENT_DISTANCE = 70.0
"""What OpenCOOD takes by default: agents, and metres from the ego in plan."""

FIELDS = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<f4")])
MIRROR = np.array([1.0, -1.0, 1.0])


def sample_files(sample: Sample) -> dict[str, Callable[[], bytes]]:
    """Return the cloud and the labels of each agent, ``SPLIT/RUN/AGENT/FRAME``."""
    run = sample.run
    files: dict[str, Callable[[], bytes]] = {}
    for number in range(len(run.sensors)):
        stem = f"{SPLIT_FOLDERS[run.split]}/{run.name}/{number}/{sample.frame_id}"
        files[f"{stem}.pcd"] = partial(_cloud, sample, number)
        files[f"{stem}.yaml"] = partial(_labels, sample, number)
    return files


def left_handed_pose(xyz: Float, orientation: Float) -> list[float]:
    """Return x, y, z (metres), roll, yaw, pitch (degrees) in left-handed axes.

    Parameters
    ----------
    xyz : (3,) float64, metres
        In right-handed axes.
    orientation : (3, 3) float64
        Rotation to these axes.
    """
    turn = MIRROR[:, None] * orientation * MIRROR
    pitch = math.atan2(turn[2, 0], math.hypot(turn[2, 1], turn[2, 2]))
    if math.hypot(turn[2, 1], turn[2, 2]) > 1e-9:  # below that x points straight up or down
        roll, yaw = math.atan2(-turn[2, 1], turn[2, 2]), math.atan2(turn[1, 0], turn[0, 0])
    else:
        roll, yaw = 0.0, math.atan2(-turn[0, 1], turn[1, 1])
    return [*(xyz * MIRROR).tolist(), *(math.degrees(angle) for angle in (roll, yaw, pitch))]


def notes(run: TrafficRun) -> tuple[str, ...]:
    """Name the agents that OpenCOOD would leave out."""
    ego = run.sensors[0]
    far = [sensor.label for sensor in run.sensors if _distance(sensor, ego) > MAX_AGENT_DISTANCE]
    found = []
    if len(run.sensors) > MAX_AGENTS:
        found.append(f"there are {len(run.sensors)} agents; set max_cav to that, or OpenCOOD takes {MAX_AGENTS} alone")
    if far:
        found.append(
            f"{', '.join(far)}: farther than {MAX_AGENT_DISTANCE:g} m from {ego.label}, the ego; OpenCOOD leaves them "
            "out unless COM_RANGE is raised"
        )
    return tuple(found)


def _distance(sensor: SensorPose, other: SensorPose) -> float:
    return float(np.linalg.norm(sensor.xyz[:2] - other.xyz[:2]))


def _cloud(sample: Sample, number: int) -> bytes:
    sensor, frame = sample.run.sensors[number], sample.frame
    mine = frame.sensor == number
    own = (frame.points[mine].astype(np.float64) - sensor.xyz) @ sensor.orientation * MIRROR
    red = np.round(np.clip(frame.intensity[mine], 0.0, 1.0) * 255).astype("<u4")
    points = np.empty(len(own), dtype=FIELDS)
    points["x"], points["y"], points["z"] = own.T
    points["rgb"] = (red << np.uint32(16)).astype("<u4").view("<f4")
    return encode(points)


def _labels(sample: Sample, number: int) -> bytes:
    """Return an agent's file: its pose, and of the vehicles those that it has returns from.

    A vehicle that is written though no sensor sees it is in every agent's.
    """
    sensor, boxes = sample.run.sensors[number], sample.boxes
    seen = (boxes.points[:, number] > 0) | (boxes.points.sum(axis=1) == 0)
    pose = left_handed_pose(sensor.xyz, sensor.orientation)
    keys = ("lidar_pose", "true_ego_pos", "predicted_ego_pos")
    lines = [f"{key}: {_list(pose)}" for key in keys]
    lines += ["ego_speed: 0.0", "vehicles:" if seen.any() else "vehicles: {}"]
    mine = subset(boxes, seen)
    for row, user in enumerate(mine.user):
        half = mine.size[row] / 2
        up = np.array([0.0, 0.0, half[2]])
        lines += [
            f"  {user}:",
            f"    angle: {_list([0.0, -math.degrees(mine.yaw[row]), math.degrees(mine.pitch[row])])}",
            f"    center: {_list(up)}",
            f"    extent: {_list(half)}",
            f"    location: {_list((mine.centre[row] - up) * MIRROR)}",
            f"    obj_type: {CLASSES[str(mine.category[row])]}",
            f"    speed: {_number(mine.speed[row] * 3.6)}",
        ]
    return ("\n".join(lines) + "\n").encode()


def _list(values: Sequence[float] | Float) -> str:
    return f"[{', '.join(_number(value) for value in values)}]"


def _number(value: float) -> str:
    """Return a number without an exponent, which YAML would read as text, to the nanometre."""
    return f"{round(float(value), 9) + 0.0:.9f}"


FORMAT = Format("opv2v", "OPV2V's format", CLASSES, sample_files, notes=notes)
