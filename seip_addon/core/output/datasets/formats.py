"""Formats of datasets: KITTI, OpenPCDet and PCD; and files of detections as detectors write them.

.. [1] A. Geiger, P. Lenz, R. Urtasun, "Are we ready for Autonomous Driving? The KITTI Vision Benchmark Suite", CVPR
   2012; readme of the object development kit.
.. [2] OpenPCDet, docs/CUSTOM_DATASET_TUTORIAL.md.
.. [3] OpenPCDet, pcdet/datasets/custom/custom_dataset.py.
.. [4] Point Cloud Library, "The PCD (Point Cloud Data) file format", version 0.7.
"""

import io
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ...base.arrays import Float
from ...geometry.orientation import quaternion_of
from .sample import MERGED, Sample, cloud

Files = dict[str, Callable[[], bytes]]
"""Functions that return the bytes of each file, by its path in the folder of a dataset."""
Splits = Mapping[str, Sequence[str]]
"""Names of the samples of each split."""
CLASSES = {
    "car": "Car",
    "van": "Van",
    "truck": "Truck",
    "bus": "Bus",
    "motorcycle": "Motorcycle",
    "bicycle": "Cyclist",
    "pedestrian": "Pedestrian",
}
"""Names of the categories where a format leaves the choice to its user: KITTI's, as far as they go."""
KITTI_CLASS = {
    "Car": "Car",
    "Van": "Van",
    "Truck": "Truck",
    "Bus": "Truck",
    "Motorcycle": "Cyclist",
    "Cyclist": "Cyclist",
    "Pedestrian": "Pedestrian",
    "DontCare": "DontCare",
}
"""KITTI's class as which each is evaluated: OpenPCDet evaluates a custom dataset by no others."""
NO_OPENPCDET_LABEL = "0.0 0.0 0.0 1.0 1.0 1.0 0.0 DontCare\n"  # the label of a frame without any
PLAN_STEP = 6.4  # what the range is a multiple of in plan, metres: 16 pillars of 0.4, 32 of 0.2 or 64 of 0.1 m
HEIGHT_STEP = 2.0  # what the range is a multiple of in height, metres: 40 voxels of 0.05 m, as networks ask for
MARGIN = 0.5  # between the boxes and the range, metres
KITTI_CLASSES = {category: KITTI_CLASS[name] for category, name in CLASSES.items()}
"""KITTI has neither buses nor motorcycles; readers ignore or refuse a name that it does not have."""
NO_KITTI_LABEL = "DontCare -1 -1 -10 0 0 0 0 -1 -1 -1 -1000 -1000 -1000 -10\n"  # the label of a frame without any
PIXELS = 100  # width and height of the empty picture and of each box in it
_IDENTITY = "1 0 0 0 0 1 0 0 0 0 1 0"
CALIBRATION = "".join(
    f"{name}: {numbers}\n"
    for name, numbers in {
        **dict.fromkeys(("P0", "P1", "P2", "P3"), _IDENTITY),
        "R0_rect": "1 0 0 0 1 0 0 0 1",
        "Tr_velo_to_cam": "0 -1 0 0 0 0 -1 0 1 0 0 0",
        "Tr_imu_to_velo": _IDENTITY,
    }.items()
)
FULLY_VISIBLE, PARTLY_VISIBLE = 0.8, 0.4
"""Visibility from which an object counts as fully visible (0) and as partly occluded (1) and not largely (2)."""
IDENTITY = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # viewpoint in the origin
POINT_TYPE = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4")])


@dataclass(frozen=True)
class Format:
    """A format of datasets, by the key that a user types and its name.

    Parameters
    ----------
    classes : mapping of str to str
        The format's name of each category of road users. One that is absent gets no label; empty for a format that has
        only clouds.
    sample_files : callable
        From a `Sample` to functions that return the bytes of its files, by path in the dataset's folder.
    index_files : callable
        From the dataset's folder and the names of the samples by split to the bytes of the files of the dataset as a
        whole, by path; called when all samples are written.
    """

    key: str
    name: str
    classes: Mapping[str, str]
    sample_files: Callable[[Sample], Files]
    index_files: Callable[[Path, Splits], Mapping[str, bytes]] = lambda _folder, _splits: {}


def _shortest(value: float) -> str:
    """Return the shortest text that reads back as the same float64, and zero without a sign."""
    return repr(float(value) + 0.0)


def _numbers(row: Float) -> str:
    return " ".join(map(_shortest, row))


def read_labels(path: Path) -> tuple[Float, list[str]]:
    """Return the boxes, (k, 7) float64, and their classes from a label file of OpenPCDet."""
    rows = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    return np.array([row[:7] for row in rows], dtype=np.float64).reshape(-1, 7), [row[7] for row in rows]


def image_sets(splits: Splits) -> dict[str, bytes]:
    """Return ``ImageSets/SPLIT.txt``: the name of a sample on each line."""
    return {
        f"ImageSets/{split}.txt": "".join(f"{name}\n" for name in names).encode() for split, names in splits.items()
    }


def _openpcdet_files(sample: Sample) -> Files:
    """Return ``points`` and ``labels`` of a sample.

    Boxes are the middle, the size and the heading counter-clockwise from +x, so that nothing is converted [2]_. The
    reader stumbles over a frame without a label, and drops labels called ``DontCare`` [3]_: such a frame gets one of
    these, and stays in its split, where a detection in it is a false one.
    """
    points = io.BytesIO()
    np.save(points, cloud(sample.frame), allow_pickle=False)
    values = np.column_stack([sample.boxes.centre, sample.boxes.size, sample.boxes.yaw])
    rows = (f"{_numbers(row)} {name}\n" for row, name in zip(values, sample.classes, strict=True))
    lines = "".join(rows) or NO_OPENPCDET_LABEL
    return {f"points/{sample.name}.npy": points.getvalue, f"labels/{sample.name}.txt": lines.encode}


def _openpcdet_index(folder: Path, splits: Splits) -> dict[str, bytes]:
    """Return the splits, and a configuration whose range holds every box."""
    boxes = [np.empty((0, 7))]
    for name in (name for names in splits.values() for name in names):
        found, classes = read_labels(folder / f"labels/{name}.txt")
        boxes.append(found[[kind != "DontCare" for kind in classes]])
    return {**image_sets(splits), "custom_dataset.yaml": _configuration(np.concatenate(boxes)).encode()}


def point_cloud_range(boxes: Float) -> Float:
    """Return x, y, z from and to, (6,) float64 in metres, that hold all boxes, multiples of `PLAN_STEP`, `HEIGHT_STEP`.

    Boxes (k, 7) are middle, size and heading; without any the range lies around the origin.
    """
    x, y, z, length, width, height, heading = boxes.T if len(boxes) else np.zeros((7, 1))
    along, across = np.abs(np.cos(heading)), np.abs(np.sin(heading))
    reach = np.column_stack([along * length + across * width, across * length + along * width, height]) / 2 + MARGIN
    middle = np.column_stack([x, y, z])
    low, high = (middle - reach).min(axis=0), (middle + reach).max(axis=0)
    centre = np.round((low[:2] + high[:2]) / 2, 1)
    half = PLAN_STEP / 2 * np.ceil(np.maximum(high[:2] - centre, centre - low[:2]) / (PLAN_STEP / 2))
    bottom = math.floor(low[2] * 10) / 10
    top = bottom + HEIGHT_STEP * math.ceil((high[2] - bottom) / HEIGHT_STEP)
    return np.round([*(centre - half), bottom, *(centre + half), top], 1)


def _configuration(boxes: Float) -> str:
    """Return the YAML text: values that JSON writes are YAML too."""
    extent = point_cloud_range(boxes).tolist()
    return Template(Path(__file__).with_name("custom_dataset.yaml").read_text(encoding="utf-8")).substitute(
        classes=json.dumps(list(CLASSES.values())),
        range=json.dumps(extent),
        kitti=json.dumps(KITTI_CLASS),
        height=round(extent[5] - extent[2], 1),
    )


def _kitti_files(sample: Sample) -> Files:
    """Return ``velodyne``, ``label_2``, ``calib`` and ``image_2`` of a sample, with a camera in the origin along +x.

    Labels are in the camera's axes (x right, y down, z forward): the middle of the underside, height, width, length,
    and the rotation about y, which is −heading − π/2 [1]_. The calibration turns axes and nothing else, so that what
    comes back in LiDAR axes is exact. Evaluators leave out objects less than 25 or 40 pixels high: each box in the
    picture is 100 × 100. Its readers want a picture and, of a frame without labels, a line ``DontCare``, as KITTI has.
    """
    part = "testing" if sample.run.split == "test" else "training"
    return {
        f"{part}/velodyne/{sample.name}.bin": lambda: cloud(sample.frame).tobytes(),
        f"{part}/label_2/{sample.name}.txt": partial(_label_file, sample),
        f"{part}/calib/{sample.name}.txt": CALIBRATION.encode,
        f"{part}/image_2/{sample.name}.png": _empty_picture,
    }


def _label_file(sample: Sample) -> bytes:
    boxes = sample.boxes
    numbers, alpha = camera_boxes(boxes.centre, boxes.size, boxes.yaw)
    occluded = np.where(boxes.visibility >= FULLY_VISIBLE, 0, np.where(boxes.visibility >= PARTLY_VISIBLE, 1, 2))
    lines = "".join(
        f"{name} 0 {hidden} {_shortest(angle)} 0 0 {PIXELS} {PIXELS} {_numbers(row)}\n"
        for name, hidden, angle, row in zip(sample.classes, occluded, alpha, numbers, strict=True)
    )
    return (lines or NO_KITTI_LABEL).encode()


def camera_boxes(centre: Float, size: Float, yaw: Float) -> tuple[Float, Float]:
    """Return boxes in the camera's axes, from their middles, lengths, widths and heights (k, 3), and yaws (k,).

    Returns
    -------
    numbers : (k, 7) float64
        Height, width, length, the middle of the underside, and the rotation about y.
    alpha : (k,) float64, radians
        The angle at which the camera sees each.
    """
    length, width, height = size.T
    x, y, z = centre.T
    camera = np.column_stack([-y, height / 2 - z, x])
    rotation = _wrapped(-yaw - np.pi / 2)
    # rounded: numpy's versions differ in the last digit of an arctangent
    alpha = np.round(_wrapped(rotation - np.arctan2(camera[:, 0], camera[:, 2])), 6)
    return np.column_stack([height, width, length, camera, rotation]), alpha


def _wrapped(angle: Float) -> Float:
    """Return angles in [-π, π)."""
    wrapped: Float = np.mod(angle + np.pi, 2 * np.pi) - np.pi
    return wrapped


def _empty_picture() -> bytes:
    buffer = io.BytesIO()
    Image.new("RGB", (PIXELS, PIXELS)).save(buffer, "PNG")
    return buffer.getvalue()


def _pcd_files(sample: Sample) -> Files:
    """Return ``SPLIT/RUN/SENSOR/FRAME.pcd`` of every sensor and of all together, binary [4]_.

    All clouds are in the site's local axes, so that they lie over each other when they are opened together. The
    viewpoint of a sensor's cloud is the sensor's pose, that of the merged cloud is the identity.
    """
    points = cloud(sample.frame)

    def only(number: int) -> Callable[[], bytes]:
        sensor = sample.run.sensors[number]
        viewpoint = (*sensor.xyz.tolist(), *quaternion_of(sensor.orientation).tolist())
        return lambda: encode(points[sample.frame.sensor == number].view(POINT_TYPE)[:, 0], viewpoint)

    labels = [sensor.label for sensor in sample.run.sensors]
    clouds = {MERGED: lambda: encode(points.view(POINT_TYPE)[:, 0])}
    clouds |= {label: only(number) for number, label in enumerate(labels)}
    run = sample.run
    return {f"{run.split}/{run.name}/{folder}/{sample.frame_id}.pcd": content for folder, content in clouds.items()}


def encode(points: NDArray[Any], viewpoint: Sequence[float] = IDENTITY) -> bytes:
    """Return a structured array of little-endian float32 fields, (n,), as a binary PCD file.

    The viewpoint is the position (metres) and orientation (quaternion w, x, y, z) of the sensor in the points' axes.
    """
    names = points.dtype.names or ()
    lines = (
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        f"FIELDS {' '.join(names)}",
        f"SIZE {' '.join('4' for _ in names)}",
        f"TYPE {' '.join('F' for _ in names)}",
        f"COUNT {' '.join('1' for _ in names)}",
        f"WIDTH {len(points)}",
        "HEIGHT 1",
        f"VIEWPOINT {' '.join(f'{round(number, 9) + 0.0:.12g}' for number in viewpoint)}",
        f"POINTS {len(points)}",
        "DATA binary",
    )
    return ("\n".join(lines) + "\n").encode() + points.tobytes()


def kitti_results(boxes: Float, categories: Sequence[str], score: Float) -> str:
    """Return a line of KITTI's results for each detection: a label, and the score (0 to 1).

    Boxes (k, 7) are x, y, z of the middle, length, width, height (metres) and yaw (radians) in local site axes.
    """
    numbers, alpha = camera_boxes(boxes[:, :3], boxes[:, 3:6], boxes[:, 6])
    return "".join(
        f"{KITTI_CLASSES[category]} -1 -1 {_shortest(angle)} 0 0 {PIXELS} {PIXELS} {_numbers(row)} {_shortest(one)}\n"
        for category, angle, row, one in zip(categories, alpha, numbers, score, strict=True)
    )


def openpcdet_results(boxes: Float, categories: Sequence[str], score: Float) -> str:
    """Return a line ``x y z dx dy dz heading class score`` for each detection; see `kitti_results`."""
    return "".join(
        f"{_numbers(row)} {CLASSES[category]} {_shortest(points)}\n"
        for row, category, points in zip(boxes, categories, np.asarray(score), strict=True)
    )


FORMATS: dict[str, Format] = {
    kind.key: kind
    for kind in (
        Format("openpcdet", "OpenPCDet's custom dataset", CLASSES, _openpcdet_files, _openpcdet_index),
        Format(
            *("kitti", "KITTI's object detection format", KITTI_CLASSES, _kitti_files),
            lambda _folder, splits: image_sets(splits),
        ),
        Format("pcd", "PCD clouds", {}, _pcd_files),
    )
}
"""Formats of datasets by the names that a user types."""
