"""Label and split text files that several formats share."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ...arrays import Float
from .sample import Sample, shortest

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


def label_lines(sample: Sample, xyz: Float) -> str:
    """Return a line ``x y z dx dy dz heading class`` for each box, from which the same float64 are read back.

    Parameters
    ----------
    xyz : (k, 3) float64, metres
        The place of each box by which the format goes.
    """
    boxes = sample.boxes
    values = np.column_stack([xyz, boxes.size, boxes.yaw])
    return "".join(
        f"{' '.join(shortest(value) for value in row)} {name}\n"
        for row, name in zip(values, sample.classes, strict=True)
    )


def read_labels(path: Path) -> tuple[Float, list[str]]:
    """Return the boxes, (k, 7) float64, and their classes from a file of `label_lines`."""
    rows = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    return np.array([row[:7] for row in rows], dtype=np.float64).reshape(-1, 7), [row[7] for row in rows]


def image_sets(splits: Mapping[str, Sequence[str]]) -> dict[str, bytes]:
    """Return ``ImageSets/SPLIT.txt``: the name of a sample on each line."""
    return {
        f"ImageSets/{split}.txt": "".join(f"{name}\n" for name in names).encode() for split, names in splits.items()
    }
