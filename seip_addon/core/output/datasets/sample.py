"""Samples of a dataset: frames of traffic runs with their labels."""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float
from ...base.errors import SeipError
from ...sensing.scans.frame import Frame, Labels
from ...sensing.scans.sensor import MountedSensor

SPLITS = ("train", "val", "test")
MERGED = "merged"  # name of the cloud of all sensors together

OUTCOMES = WRITTEN, OUTSIDE, NO_CLASS, TOO_FEW = "written", "outside_region", "no_class", "too_few_points"
"""Outcomes of a label, as the manifest counts them; the first that applies of those after `WRITTEN`."""

_FILE_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,99}")


@dataclass(frozen=True, eq=False)
class TrafficRun:
    """One simulation of traffic, whole in one split: frames of a run resemble each other too much to be torn apart.

    Parameters
    ----------
    name : str
        Name of the run and of its folders, unique in a dataset.
    key : str
        Digest of all inputs of the frames: runs of one key are the same frames.
    sensors : tuple of MountedSensor
        In the order of the frames' sensor numbers.
    origin : (3,) float64, metres
        Map coordinates of the local origin: map = local + origin.
    record : mapping
        More about the simulation for the manifest (seeds, settings, versions): values that JSON can hold.
    """

    name: str
    split: str
    key: str
    sensors: tuple[MountedSensor, ...]
    origin: Float
    record: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_file_name(self.name, "the run", "give it another")
        if self.split not in SPLITS:
            raise SeipError(f"there is no split '{self.split}'; choose one of {', '.join(SPLITS)}")
        if not self.sensors:
            raise SeipError(f"the run '{self.name}' has no sensors; place some and simulate it again")
        for sensor in self.sensors:
            require_file_name(sensor.label, "the sensor", "rename its empty")
            if sensor.label.lower() == MERGED:
                raise SeipError(f"a sensor is called '{MERGED}', as is the cloud of all together; rename its empty")
        label, count = Counter(sensor.label.lower() for sensor in self.sensors).most_common(1)[0]
        if count > 1:
            raise SeipError(f"two sensors are called '{label}'; rename one")


@dataclass(frozen=True, eq=False)
class Sample:
    """A frame in a dataset.

    Parameters
    ----------
    number, frame_id
        Number of the frame in the whole dataset, from 0, and its identifier in its run.
    fates : tuple of str
        Outcome for each label of the frame, one of `OUTCOMES`.
    boxes, classes
        Labels that are written, and the class of each, as the format names it.
    """

    number: int
    frame_id: str
    run: TrafficRun
    frame: Frame
    fates: tuple[str, ...]
    boxes: Labels
    classes: tuple[str, ...]

    @property
    def name(self) -> str:
        """The number as file names have it."""
        return f"{self.number:06d}"


def make_sample(
    place: tuple[int, str], run: TrafficRun, frame: Frame, classes: Mapping[str, str], min_points: int
) -> Sample:
    """Return a frame, by its number in the dataset and its id in the run, with the labels that are to be written.

    A label needs a class of the format and ``min_points`` returns of all sensors together.
    """
    labels = frame.labels
    returns = labels.points.sum(axis=1)
    found = tuple(
        OUTSIDE if not inside else NO_CLASS if str(category) not in classes else TOO_FEW if few else WRITTEN
        for inside, category, few in zip(labels.inside, labels.category, returns < min_points, strict=True)
    )
    kept = np.array([fate == WRITTEN for fate in found], dtype=bool)
    boxes = Labels(**{part.name: getattr(labels, part.name)[kept] for part in fields(Labels)})
    names = tuple(classes[str(category)] for category in boxes.category)
    return Sample(*place, run=run, frame=frame, fates=found, boxes=boxes, classes=names)


def cloud(frame: Frame) -> NDArray[np.float32]:
    """Return x, y, z (metres, local site axes) and intensity (0 to 1) of all points, (n, 4) float32 little-endian."""
    return np.column_stack([frame.points, frame.intensity]).astype("<f4")


def require_file_name(name: str, whose: str, cure: str) -> None:
    """Raise `SeipError` unless a name can be that of a file on every system."""
    if not _FILE_NAME.fullmatch(name):
        raise SeipError(
            f"{whose} {name!r} cannot give its name to a file; {cure}, of up to 100 letters, digits, '_', '-' and '.'"
        )
