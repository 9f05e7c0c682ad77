r"""The OPV2V format, as OpenCOOD reads it: each sensor is an agent with its own point clouds and labels.

OpenCOOD uses CARLA's left-handed axes (x forward, y **right**, z up): with M = diag(1, −1, 1), a point p becomes M p
and a rotation R becomes M R M. A pose is x, y, z in metres and roll, yaw, pitch in degrees, with the rotation [1]_

.. math::
   \begin{pmatrix}
   c_p c_y & c_y s_p s_r - s_y c_r & -c_y s_p c_r - s_y s_r \\
   s_y c_p & s_y s_p s_r + c_y c_r & -s_y s_p c_r + c_y s_r \\
   s_p & -c_p s_r & c_p c_r
   \end{pmatrix}

Clouds are in their sensor's frame, with the intensity as the 8-bit red channel of a packed colour. Agents have the
indices of the sensors, from 0: OpenCOOD takes negative numbers for roadside units, which cannot be the ego.

.. [1] R. Xu et al., "OPV2V: An Open Benchmark Dataset and Fusion Pipeline for Perception with Vehicle-to-Vehicle
   Communication", ICRA 2022; OpenCOOD, opencood/utils/transformation_utils.py.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ...arrays import Float
from . import pcd
from .format_interface import Format
from .sample import Sample, TrafficRun, subset

CLASSES = {"car": "Car", "van": "Van", "truck": "Truck", "bus": "Bus"}
"""OpenCOOD has a single class, vehicles, without two-wheelers and pedestrians."""

SPLIT_FOLDERS = {"train": "train", "val": "validate", "test": "test"}
MAX_AGENTS, MAX_AGENT_DISTANCE = 7, 70.0  # OpenCOOD's defaults of max_cav and COM_RANGE (metres in plan from the ego)

POINT_TYPE = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<f4")])
MIRROR = np.array([1.0, -1.0, 1.0])  # the diagonal of M


def sample_files(sample: Sample) -> dict[str, Callable[[], bytes]]:
    """Return the writers of each agent's cloud and labels, by path: ``SPLIT/RUN/AGENT/FRAME.pcd`` and ``.yaml``."""
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
        Position in right-handed axes.
    orientation : (3, 3) float64
        Rotation from the sensor's frame to these axes.
    """
    rotation = MIRROR[:, None] * orientation * MIRROR
    cos_pitch = math.hypot(rotation[2, 1], rotation[2, 2])
    pitch = math.atan2(rotation[2, 0], cos_pitch)
    if cos_pitch > 1e-9:
        roll, yaw = math.atan2(-rotation[2, 1], rotation[2, 2]), math.atan2(rotation[1, 0], rotation[0, 0])
    else:  # gimbal lock: only the sum or difference of roll and yaw is known
        roll, yaw = 0.0, math.atan2(-rotation[0, 1], rotation[1, 1])
    return [*(xyz * MIRROR).tolist(), *(math.degrees(angle) for angle in (roll, yaw, pitch))]


def notes(run: TrafficRun) -> tuple[str, ...]:
    """Return warnings about agents that OpenCOOD ignores by default."""
    ego = run.sensors[0]
    distances = [float(np.linalg.norm(sensor.xyz[:2] - ego.xyz[:2])) for sensor in run.sensors]
    far = [sensor.label for sensor, away in zip(run.sensors, distances, strict=True) if away > MAX_AGENT_DISTANCE]
    warnings = []
    if len(run.sensors) > MAX_AGENTS:
        warnings.append(
            f"there are {len(run.sensors)} agents; set max_cav to that, or OpenCOOD takes {MAX_AGENTS} alone"
        )
    if far:
        warnings.append(
            f"{', '.join(far)}: farther than {MAX_AGENT_DISTANCE:g} m from {ego.label}, the ego; OpenCOOD leaves them "
            "out unless COM_RANGE is raised"
        )
    return tuple(warnings)


def _cloud(sample: Sample, number: int) -> bytes:
    sensor, frame = sample.run.sensors[number], sample.frame
    own = frame.sensor == number
    xyz = (frame.points[own].astype(np.float64) - sensor.xyz) @ sensor.orientation * MIRROR
    red = np.round(np.clip(frame.intensity[own], 0.0, 1.0) * 255).astype("<u4")
    points = np.empty(len(xyz), dtype=POINT_TYPE)
    points["x"], points["y"], points["z"] = xyz.T
    points["rgb"] = (red << np.uint32(16)).astype("<u4").view("<f4")
    return pcd.encode(points)


def _labels(sample: Sample, number: int) -> bytes:
    """Return an agent's YAML: its pose, and the vehicles with returns from it or from no sensor at all."""
    sensor, boxes = sample.run.sensors[number], sample.boxes
    listed = (boxes.points[:, number] > 0) | (boxes.points.sum(axis=1) == 0)
    pose = left_handed_pose(sensor.xyz, sensor.orientation)
    lines = [f"{key}: {_list(pose)}" for key in ("lidar_pose", "true_ego_pos", "predicted_ego_pos")]
    lines += ["ego_speed: 0.0", "vehicles:" if listed.any() else "vehicles: {}"]
    vehicles = subset(boxes, listed)
    for row, user in enumerate(vehicles.user):
        half_size = vehicles.size[row] / 2
        centre_offset = np.array([0.0, 0.0, half_size[2]])  # from the ground, where OPV2V locates a vehicle
        lines += [
            f"  {user}:",
            f"    angle: {_list([0.0, -math.degrees(vehicles.yaw[row]), math.degrees(vehicles.pitch[row])])}",
            f"    center: {_list(centre_offset)}",
            f"    extent: {_list(half_size)}",
            f"    location: {_list((vehicles.centre[row] - centre_offset) * MIRROR)}",
            f"    obj_type: {CLASSES[str(vehicles.category[row])]}",
            f"    speed: {_number(vehicles.speed[row] * 3.6)}",
        ]
    return ("\n".join(lines) + "\n").encode()


def _list(values: Sequence[float] | Float) -> str:
    return f"[{', '.join(_number(value) for value in values)}]"


def _number(value: float) -> str:
    """Return a number with nine decimals and no exponent, which PyYAML would read as text."""
    return f"{round(float(value), 9) + 0.0:.9f}"


FORMAT = Format("opv2v", "OPV2V's format", CLASSES, sample_files, notes=notes)
