"""OpenPCDet's custom dataset.

Boxes are the middle, the size and the heading counter-clockwise from +x, so that nothing is converted [1]_. Its
reader stumbles over a frame without a label, and drops labels called ``DontCare`` [2]_: such a frame gets one of
these, and stays in its split, where a detection in it is a false one.

.. [1] OpenPCDet, docs/CUSTOM_DATASET_TUTORIAL.md.
.. [2] OpenPCDet, pcdet/datasets/custom/custom_dataset.py.
"""

import io
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...arrays import Float
from .format_interface import Format
from .label_files import CLASSES, image_sets, label_lines, read_labels
from .sample import Sample, cloud

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
"""As which of KITTI's classes each is evaluated, which is all that OpenPCDet evaluates a custom dataset by."""

NO_LABEL = "0.0 0.0 0.0 1.0 1.0 1.0 0.0 DontCare\n"  # the label of a frame without any
PLAN_STEP = 6.4  # what the range is a multiple of in plan, metres: 16 pillars of 0.4, 32 of 0.2 or 64 of 0.1 m
HEIGHT_STEP = 2.0  # what the range is a multiple of in height, metres: 40 voxels of 0.05 m, as networks ask for
MARGIN = 0.5  # between the boxes and the range, metres

PILLAR_SIZE = 0.2


def sample_files(sample: Sample) -> dict[str, Callable[[], bytes]]:
    """Return ``points`` and ``labels`` of a sample."""
    return {
        f"points/{sample.name}.npy": lambda: _npy(sample),
        f"labels/{sample.name}.txt": lambda: label_lines(sample, sample.boxes.centre).encode() or NO_LABEL.encode(),
    }


def index_files(folder: Path, splits: Mapping[str, Sequence[str]]) -> dict[str, bytes]:
    """Return the splits, and a configuration whose range holds every box."""
    return {**image_sets(splits), "custom_dataset.yaml": _configuration(_label_boxes(folder, splits)).encode()}


def point_cloud_range(boxes: Float) -> Float:
    """Return x, y, z from and to, (6,) float64 in metres, that hold all boxes, multiples of `PLAN_STEP`, `HEIGHT_STEP`.

    Parameters
    ----------
    boxes : (k, 7) float64
        Middle, size, heading; without any the range lies around the origin.
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


def _npy(sample: Sample) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, cloud(sample.frame), allow_pickle=False)
    return buffer.getvalue()


def _label_boxes(folder: Path, splits: Mapping[str, Sequence[str]]) -> Float:
    boxes = [np.empty((0, 7))]
    for name in (name for names in splits.values() for name in names):
        found, classes = read_labels(folder / f"labels/{name}.txt")
        boxes.append(found[[kind != "DontCare" for kind in classes]])
    return np.concatenate(boxes)


def _configuration(boxes: Float) -> str:
    """Return the YAML text: values that JSON writes are YAML too."""
    extent = point_cloud_range(boxes)
    features = ["x", "y", "z", "intensity"]
    values = {
        "DATASET": "CustomDataset",
        "DATA_PATH": "../data/custom",
        "CLASS_NAMES": list(CLASSES.values()),
        "POINT_CLOUD_RANGE": extent.tolist(),
        "MAP_CLASS_TO_KITTI": KITTI_CLASS,
        "DATA_SPLIT": {"train": "train", "test": "val"},
        "INFO_PATH": {"train": ["custom_infos_train.pkl"], "test": ["custom_infos_val.pkl"]},
        "POINT_FEATURE_ENCODING": {
            "encoding_type": "absolute_coordinates_encoding",
            "used_feature_list": features,
            "src_feature_list": features,
        },
        "DATA_AUGMENTOR": {
            "DISABLE_AUG_LIST": ["placeholder"],
            "AUG_CONFIG_LIST": [
                {"NAME": "random_world_flip", "ALONG_AXIS_LIST": ["x", "y"]},
                {"NAME": "random_world_rotation", "WORLD_ROT_ANGLE": [-0.78539816, 0.78539816]},
                {"NAME": "random_world_scaling", "WORLD_SCALE_RANGE": [0.95, 1.05]},
            ],
        },
        "DATA_PROCESSOR": [
            {"NAME": "mask_points_and_boxes_outside_range", "REMOVE_OUTSIDE_BOXES": True},
            {"NAME": "shuffle_points", "SHUFFLE_ENABLED": {"train": True, "test": False}},
            {
                "NAME": "transform_points_to_voxels",
                "VOXEL_SIZE": [PILLAR_SIZE, PILLAR_SIZE, round(float(extent[5] - extent[2]), 1)],
                "MAX_POINTS_PER_VOXEL": 32,
                "MAX_NUMBER_OF_VOXELS": {"train": 40000, "test": 40000},
            },
        ],
    }
    head = "# CLASS_NAMES: for the model's configuration. What next: OpenPCDet, docs/CUSTOM_DATASET_TUTORIAL.md\n"
    return head + "".join(f"{key}: {json.dumps(value)}\n" for key, value in values.items())


FORMAT = Format("openpcdet", "OpenPCDet's custom dataset", CLASSES, sample_files, index_files)
