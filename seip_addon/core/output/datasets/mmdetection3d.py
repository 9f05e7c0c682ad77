"""mmdetection3d's format since version 1.1: points as float32 and one information file for each split.

Boxes are in LiDAR coordinates: heading counter-clockwise from +x, and the middle of the **underside** [1]_. The text
files in ``labels`` are those that the documentation asks of a custom dataset, with the same boxes [2]_; the
information files are made from them.

.. [1] mmdetection3d, docs/en/user_guides/coord_sys_tutorial.md.
.. [2] mmdetection3d, docs/en/advanced_guides/customize_dataset.md.
"""

import pickle
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .format_interface import Format
from .label_files import CLASSES, image_sets, label_lines, read_labels
from .sample import Sample, cloud

LABELS = {name: number for number, name in enumerate(CLASSES.values())}
PICKLE_PROTOCOL = 4  # whichever Python writes it, the bytes are the same


def sample_files(sample: Sample) -> dict[str, Callable[[], bytes]]:
    """Return ``points`` and ``labels`` of a sample."""
    boxes = sample.boxes
    underside = boxes.centre - boxes.size * np.array([0.0, 0.0, 0.5])
    return {
        f"points/{sample.name}.bin": lambda: cloud(sample.frame).tobytes(),
        f"labels/{sample.name}.txt": lambda: label_lines(sample, underside).encode(),
    }


def index_files(folder: Path, splits: Mapping[str, Sequence[str]]) -> dict[str, bytes]:
    """Return the splits and their information files."""
    infos = {f"custom_infos_{split}.pkl": _information(folder, names) for split, names in splits.items()}
    return {**image_sets(splits), **infos}


def _information(folder: Path, names: Sequence[str]) -> bytes:
    value = {
        "metainfo": {"categories": LABELS, "dataset": "custom", "info_version": "1.1"},
        "data_list": [
            {
                "sample_idx": int(name),
                "lidar_points": {"num_pts_feats": 4, "lidar_path": f"{name}.bin"},
                "instances": _instances(folder / f"labels/{name}.txt"),
            }
            for name in names
        ],
    }
    return pickle.dumps(value, protocol=PICKLE_PROTOCOL)


def _instances(path: Path) -> list[dict[str, Any]]:
    boxes, classes = read_labels(path)
    return [{"bbox_3d": box, "bbox_label_3d": LABELS[name]} for box, name in zip(boxes.tolist(), classes, strict=True)]


FORMAT = Format("mmdetection3d", "mmdetection3d's format", CLASSES, sample_files, index_files)
